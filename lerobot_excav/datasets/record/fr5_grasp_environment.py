"""The arm over a table with blocks, as datasets see it."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from lerobot_excav.datasets.record.environment import EnvironmentDescription
from lerobot_excav.datasets.record.rig import FR5GraspRig
from lerobot_excav.envs.machines.fr5.features import ACTION_NAMES, CAMERAS, STATE_NAMES
from lerobot_excav.envs.machines.fr5.workcell import ACTION_HIGH, ACTION_LOW
from lerobot_excav.envs.tasks.grasp.nearest_block import nearest_block
from lerobot_excav.envs.tasks.grasp.scene import draw_scene
from lerobot_excav.envs.tasks.grasp.simulation_version import CHANGES, SIMULATION_VERSION
from lerobot_excav.envs.tasks.grasp.task import TASK_STATE_NAMES
from lerobot_excav.envs.tasks.settings import FR5_EPISODE_DURATION_S


def fr5_grasp_outcome(task_state: NDArray[Any]) -> dict[str, Any]:
    """Return what was grasped and what lies in the tray, from the task states of an episode, (n, 8)."""
    last = dict(zip(TASK_STATE_NAMES, task_state[-1].tolist(), strict=True))
    return {
        "first_grasped_block": round(last["first_grasped_block"]),
        "target_in_tray": bool(last["target_in_tray"]),
        "blocks_in_tray": round(last["blocks_in_tray"]),
    }


def _summary(index: pd.DataFrame) -> str:
    took_target = int((index["first_grasped_block"] == index["target_id"]).sum())
    return f"first block taken: the commanded one in {took_target} of {len(index)}"


FR5_GRASP = EnvironmentDescription(
    name="fr5_grasp",
    robot_type="fr5_sim",
    tasks=("FR5Grasp-v0",),
    cameras=CAMERAS,
    state_names=STATE_NAMES,
    action_names=ACTION_NAMES,
    action_limits=np.stack([ACTION_LOW, ACTION_HIGH]),
    task_state_names=TASK_STATE_NAMES,
    fps=50,
    duration_s=FR5_EPISODE_DURATION_S,
    storage="video",
    settings={},
    simulation_version=SIMULATION_VERSION,
    changes=CHANGES,
    unmarked_version=None,
    nearest_target=lambda scene_set, scene_id: nearest_block(draw_scene(scene_set, scene_id)),
    outcome=fr5_grasp_outcome,
    summary=_summary,
    rig=FR5GraspRig,
    task_state_tolerance=1e-4,  # [m], or a count (guess; the same build repeats exactly)
    judges_at_the_end=True,
)
