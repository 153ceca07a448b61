"""What a worker process does: play an episode, and store it.

Workers load this module and what it imports; LeRobot, which takes seconds and a gigabyte per process, is not among it.
"""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.episode import Environment, Episode, demonstrate
from lerobot_excav.datasets.record.episode_store import EpisodeStore
from lerobot_excav.datasets.record.rig import Rig


def simulate_episode(rig: Rig, settings: DemonstrationSettings, pair: Pair, folder: Path) -> dict[str, Any]:
    """Play one episode and store it; runs in a worker.

    Args:
        rig: Environment and operator.
        settings: What is being recorded.
        pair: Scene and target.
        folder: Folder of finished episodes.

    Returns:
        Outcome of the episode.
    """
    episode = play_demonstration(rig, settings, pair)
    return EpisodeStore(folder).write(episode, keep_frames=episode.success or settings.keep_failures)


def play_demonstration(rig: Rig, settings: DemonstrationSettings, pair: Pair) -> Episode:
    """Play one episode with the rig's operator; the same arguments give the same episode.

    The environment stays open for the next call with the same rig and settings.
    """
    env = _environment(rig, settings)
    operator = rig.operator(np.random.default_rng(settings.episode_seed(pair)))
    return demonstrate(env, operator, pair)


@lru_cache(maxsize=1)
def _environment(rig: Rig, settings: DemonstrationSettings) -> Environment:
    return rig.environment(settings)
