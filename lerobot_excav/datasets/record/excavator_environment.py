"""The excavator, as datasets see it."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from lerobot_excav.datasets.record.environment import EnvironmentDescription, Setting
from lerobot_excav.datasets.record.rig import ExcavatorRig
from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES, CAMERAS, STATE_NAMES
from lerobot_excav.envs.tasks.scoop.simulation_version import CHANGES, SIMULATION_VERSION, UNMARKED_VERSION
from lerobot_excav.envs.tasks.scoop.task_state import TASK_STATE_NAMES
from lerobot_excav.envs.tasks.settings import EXCAVATOR_EPISODE_DURATION_S, FIDELITIES, SOILS


def excavator_outcome(task_state: NDArray[Any]) -> dict[str, Any]:
    """Return masses [kg] and events of an episode from its task states, (n, 8)."""
    last = dict(zip(TASK_STATE_NAMES, task_state[-1].tolist(), strict=True))
    deposited = task_state[:, TASK_STATE_NAMES.index("deposited_mass_kg")]
    return {
        "retained_mass_kg": float(deposited[-1] - deposited[0]),
        "residual_bucket_mass_kg": last["bucket_mass_kg"],
        "excavated_mass_kg": last["excavated_mass_kg"],
        "hard_target_contacts": round(last["hard_target_contacts"]),
        "spill_before_target_events": round(last["spill_before_target_events"]),
    }


def _summary(index: pd.DataFrame) -> str:
    return f"retained mass: {index['retained_mass_kg'].mean():.0f} kg on average"


EXCAVATOR = EnvironmentDescription(
    name="excavator",
    robot_type="excavator_sim",
    tasks=("Scoop-v0",),
    cameras=CAMERAS,
    state_names=STATE_NAMES,
    action_names=ACTION_NAMES,
    action_limits=np.tile([[-1.0], [1.0]], len(ACTION_NAMES)),
    task_state_names=TASK_STATE_NAMES,
    fps=10,
    duration_s=EXCAVATOR_EPISODE_DURATION_S,
    storage="image",
    settings={
        # The first version did not write these columns.
        "soil": Setting(default="sand", choices=SOILS, unmarked="unknown"),
        "fidelity": Setting(default="standard", choices=FIDELITIES, unmarked="standard"),
    },
    simulation_version=SIMULATION_VERSION,
    changes=CHANGES,
    unmarked_version=UNMARKED_VERSION,
    # Dig regions are asked for by the mask alone; the bucket starts far from all of them.
    nearest_target=None,
    outcome=excavator_outcome,
    summary=_summary,
    rig=ExcavatorRig,
    task_state_tolerance=1e-2,  # [kg], [m], or a count (guess; the same build repeats exactly)
    judges_at_the_end=False,
)
