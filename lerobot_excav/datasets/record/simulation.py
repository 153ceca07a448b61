"""What a worker process does: play an episode, and store it.

Workers load this module and what it imports; LeRobot, which takes seconds and a gigabyte per process, is not among it.
"""

from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.record.changes_of_mind import ChangesOfMind
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings, PlayedScenes
from lerobot_excav.datasets.record.episode import Episode, demonstrate, replay
from lerobot_excav.datasets.record.episode_store import EpisodeStore, Outcome
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.registry import task_of_settings
from lerobot_excav.envs.tasks.selection import Schedule, TargetAbsentError
from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import DatasetError, ExcavError


def simulate_scene(settings: DemonstrationSettings, scene_id: int, folder: Path) -> list[Outcome]:
    """Play all episodes of a scene that are not finished, and return the outcomes of all; runs in a worker.

    Its stages are reached once, one after the other.

    Raises:
        ExcavError: An episode could not be played; the message names it.
    """
    outcomes = []
    for stage in settings.stages_of(scene_id):
        # To find the nearest target of a later start is to reach it, so one that was found is not looked for again.
        found = EpisodeStore(folder).pairs_of_start(settings.pair(scene_id, stage, 0))
        is_known = settings.target_rule == "nearest" and len(found) == 1
        for pair in found if is_known else settings.pairs_of_start(scene_id, stage):
            outcomes += simulate_episodes(settings, pair, folder)
    return outcomes


def simulate_episodes(settings: DemonstrationSettings, pair: Pair, folder: Path) -> list[Outcome]:
    """Play an episode unless it is finished, and return its outcome in a list; runs in a worker.

    Raises:
        ExcavError: It could not be played; the message names it.
    """
    try:
        return [EpisodeStore(folder).outcome(pair) or simulate_episode(settings, pair, folder)]
    except DatasetError:
        raise
    except ExcavError as error:
        raise ExcavError(f"{pair.uid}: {error}") from error


def simulate_episode(settings: DemonstrationSettings, pair: Pair, folder: Path) -> Outcome:
    """Play one episode, store it in the folder of finished ones, and return its outcome; note it if there is none."""
    try:
        episode = play_demonstration(settings, pair)
    except TargetAbsentError:
        return EpisodeStore(folder).write_absent(pair)
    # An episode that waited for its mask has frames that no action led to: it could not be played again.
    keep = (episode.success or settings.keep_failures) and episode.mask_missing_frames == 0
    return EpisodeStore(folder).write(episode, keep_frames=keep)


def play_demonstration(played: PlayedScenes, pair: Pair, *, with_images: bool = True) -> Episode:
    """Play one episode with the scripted operator; the same arguments give the same episode.

    The environment stays open for the next call with the same settings. Without pictures it is several times faster.
    """
    env = open_environment(played.env, with_images=with_images)
    seed = played.episode_seed(pair)
    operator = played.task_spec.make_operator(np.random.default_rng(seed))
    return demonstrate(env, operator, pair, ChangesOfMind.drawn(played.change_odds, seed))


def make_environment(settings: TaskSettings, *, with_images: bool) -> MaskedTaskEnv[Any, Any]:
    """Make the environment of some settings, with pictures or without."""
    env: MaskedTaskEnv[Any, Any] = task_of_settings(settings).make_env(
        obs_type="pixels_agent_pos" if with_images else "agent_pos",
        render_mode="rgb_array" if with_images else None,
        **settings.as_dict(),
    )
    return env


def play_again(
    spec: TaskSpec,
    action: NDArray[Any],
    pair: Pair,
    schedule: Schedule,
    *,
    fps: int,
    columns: Mapping[str, str],
    rest_frames: int = 0,
) -> Episode:
    """Play the recorded actions of an episode (n, a) again, without pictures and with its own commands.

    Args:
        spec: The task.
        action: Actions.
        pair: Start and first target.
        schedule: Changes of the command.
        fps: Frames per second.
        columns: Settings that datasets keep in every frame, by name.
        rest_frames: For how many frames the machine is held still after them.
    """
    length = spec.replay_length(len(action) + rest_frames)
    settings = spec.make_settings(scene_set=pair.scene_set, fps=fps, episode_length=length, **columns)
    with closing(make_environment(settings, with_images=False)) as env:
        return replay(env, action, pair, schedule, rest_frames=rest_frames)


_open: list[tuple[TaskSettings, bool, MaskedTaskEnv[Any, Any]]] = []


def open_environment(settings: TaskSettings, *, with_images: bool) -> MaskedTaskEnv[Any, Any]:
    """Return the environment of the last call if it was the same one; to open a graphics context is slow."""
    if not _open or _open[0][:2] != (settings, with_images):
        for *_, env in _open:
            env.close()
        _open[:] = [(settings, with_images, make_environment(settings, with_images=with_images))]
    return _open[0][2]
