"""Replaying recorded actions and comparing what comes out with what was recorded."""

import numpy as np

from lerobot_excav.datasets.complete.resimulation import STATE_TOLERANCE, state_deviation
from lerobot_excav.datasets.format.episode_table import EpisodeTable
from lerobot_excav.datasets.record.provenance import PROVENANCE_PATH
from lerobot_excav.datasets.record.simulation import play_again
from lerobot_excav.envs.configs.provenance import package_versions


def replay_problem(recorded: EpisodeTable, *, fps: int) -> str:
    """Play an episode again; return the first deviation beyond tolerance in words, or an empty text."""
    spec = recorded.spec
    played = play_again(
        spec,
        recorded.action,
        recorded.pair,
        recorded.schedule,
        fps=fps,
        columns=recorded.settings,
        rest_frames=recorded.rest_frames,
    )
    largest, frame = state_deviation(played, recorded)
    if largest > STATE_TOLERANCE:
        return (
            f"replay leaves the recorded state at frame {frame} (up to {largest:.3g} rad) with MuJoCo "
            f"{package_versions()['mujoco']}; another version may differ, see packages in {PROVENANCE_PATH}"
        )
    task = np.abs(np.vstack([played.task_state, played.outcome]) - np.vstack([recorded.task_state, recorded.outcome]))
    if task.max() > spec.task_state_tolerance:
        name = spec.task_state_names[int(np.argmax(task.max(axis=0)))]
        return f"replay gives another {name} (by up to {task.max():.3g})"
    if played.success != recorded.success:
        return f"replay ends with success={played.success}, recorded {recorded.success}"
    return ""
