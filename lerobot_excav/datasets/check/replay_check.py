"""Replaying recorded actions and comparing what comes out with what was recorded."""

import numpy as np

from lerobot_excav.datasets.complete.resimulation import STATE_TOLERANCE
from lerobot_excav.datasets.format.episode_table import EpisodeTable
from lerobot_excav.datasets.record.episode import replay
from lerobot_excav.datasets.record.simulation import make_replay_environment


def replay_problem(recorded: EpisodeTable, *, fps: int) -> str:
    """Play an episode again and describe how it deviates.

    Args:
        recorded: The episode with state, action, task state and `excav.*` columns.
        fps: Frames per second of the dataset.

    Returns:
        The first deviation beyond tolerance, or an empty string.
    """
    spec, pair = recorded.spec, recorded.pair
    env = make_replay_environment(
        spec, scene_set=pair.scene_set, fps=fps, columns=recorded.settings, frames=recorded.length
    )
    try:
        played = replay(env, recorded.action, pair, recorded.schedule)
    finally:
        env.close()
    state = np.abs(played.state - recorded.state).max(axis=1)
    if state.max() > STATE_TOLERANCE:
        frame = int(np.argmax(state > STATE_TOLERANCE))
        return f"replay leaves the recorded state at frame {frame} (up to {state.max():.3g} rad)"
    task = np.abs(played.task_state - recorded.task_state)
    if task.max() > spec.task_state_tolerance:
        name = spec.task_state_names[int(np.argmax(task.max(axis=0)))]
        return f"replay gives another {name} (by up to {task.max():.3g})"
    if played.success != recorded.success:
        return f"replay ends with success={played.success}, recorded {recorded.success}"
    return ""
