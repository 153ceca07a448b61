"""Replaying recorded actions and comparing what comes out with what was recorded."""

import numpy as np

from lerobot_excav.datasets.complete.resimulation import STATE_TOLERANCE
from lerobot_excav.datasets.format.episode_table import EpisodeTable
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.episode import replay
from lerobot_excav.datasets.record.rig import Rig


def replay_problem(rig: Rig, recorded: EpisodeTable, *, fps: int) -> str:
    """Play an episode again and describe how it deviates.

    Args:
        rig: Makes the environment.
        recorded: The episode with state, action, task state and `excav.*` columns.
        fps: Frames per second of the dataset.

    Returns:
        The first deviation beyond tolerance, or an empty string.
    """
    pair = recorded.pair
    settings = DemonstrationSettings.of(
        pair.env,
        scene_set=pair.scene_set,
        fps=fps,
        episode_length=recorded.environment.replay_length(recorded.length),
        **recorded.settings,
    )
    env = rig.environment(settings)
    try:
        played = replay(env, recorded.action, pair)
    finally:
        env.close()
    state = np.abs(played.state - recorded.state).max(axis=1)
    if state.max() > STATE_TOLERANCE:
        frame = int(np.argmax(state > STATE_TOLERANCE))
        return f"replay leaves the recorded state at frame {frame} (up to {state.max():.3g} rad)"
    task = np.abs(played.task_state - recorded.task_state)
    if task.max() > recorded.environment.task_state_tolerance:
        name = recorded.environment.task_state_names[int(np.argmax(task.max(axis=0)))]
        return f"replay gives another {name} (by up to {task.max():.3g})"
    if played.success != recorded.success:
        return f"replay ends with success={played.success}, recorded {recorded.success}"
    return ""
