"""Scoop-v0 as data."""

from dataclasses import dataclass, fields

from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES, CAMERAS, STATE_NAMES, VIEWS
from lerobot_excav.envs.tasks.scoop.settings import CYCLE_DURATION_S, ExcavatorSettings
from lerobot_excav.envs.tasks.task import TaskSpec

CYCLE_LIMIT_S = 25.0
"""Time after which one of several cycles on a pile is given up [s]; late ones take up to 20 s (kind: tuned)."""


@dataclass(kw_only=True)
class TaskState:
    """Running measurements of one cycle, the entries of `task_state`; docs/reference defines them."""

    bucket_mass_kg: float = 0.0
    excavated_mass_kg: float = 0.0
    deposited_mass_kg: float = 0.0
    distance_to_target_m: float = 0.0
    distance_to_box_m: float = 0.0
    hard_target_contacts: int = 0
    bucket_depth_below_dig_plane_m: float = 0.0
    spill_before_target_events: int = 0


TASK_STATE_NAMES = tuple(field.name for field in fields(TaskState))

HEIGHT_CELLS = (12, 12)
"""Cells of the coarse map of heights along x and y, 0.5 m wide: a region is 0.8 m wide (kind: guess)."""

ENVIRONMENT_STATE_NAMES = (
    *("target.x_w", "target.y_w", "target.z_w", "target.sin_yaw", "target.cos_yaw"),
    *("bucket_mass_t", "box_mass_t"),
    *(f"height_m.{i}.{j}" for i in range(HEIGHT_CELLS[0]) for j in range(HEIGHT_CELLS[1])),
)
"""Elements of `environment_state`: middle of the commanded region [m] and its direction, soil in the bucket and in the
box [t], and the mean height of the soil [m] cell by cell, from the corner with the least x and y."""

SCOOP = TaskSpec(
    id="Scoop-v0",
    robot_type="excavator_sim",
    description="Dig where the mask points, carry the soil to the box and dump it there.",
    cameras=CAMERAS,
    views=VIEWS,
    state_names=STATE_NAMES,
    action_names=ACTION_NAMES,
    action_low=(-1.0,) * len(ACTION_NAMES),
    action_high=(1.0,) * len(ACTION_NAMES),
    task_state_names=TASK_STATE_NAMES,
    environment_state_names=ENVIRONMENT_STATE_NAMES,
    duration_s=CYCLE_DURATION_S,
    storage="image",
    settings=ExcavatorSettings,
    simulation_version=5,
    changes={
        1: "soil in the bucket as one volume, ballistic parcels; dig regions hidden from the main view were possible",
        2: "soil in the bucket as parcels in contact, hence other loads, forces and flows; every scene redrawn, with "
        "dig regions in view",
        3: "avalanches with momentum, cuts that stand in cohesive soil, forces of load, heap and fresh ground, impact "
        "of falling soil, another cab camera; every scene redrawn",
        4: "slopes at the limit come to rest within seconds, piles of scenes lie a little steeper; what has come loose "
        "has no cohesion, and parcels pack as they are weighed; a spill is a lifted load that is lost before the box",
        5: "the operator that digs up to later stages, and the planner that points it and Clear-v0, dig nearer to the "
        "machine and scrape thin soil, and Clear-v0 commands a region that brought nothing only after all others; "
        "soil, machine and scenes are those of version 4",
    },
    env_entry="lerobot_excav.envs.tasks.scoop.env:ExcavatorEnv",
    operator_entry="lerobot_excav.envs.tasks.scoop.operator:DigOperator",
    measures_entry="lerobot_excav.envs.tasks.scoop.measures:SCOOP_MEASURES",
    nearest_target_entry="lerobot_excav.envs.tasks.scoop.nearest_region:nearest_target",
    sticks_entry="lerobot_excav.envs.tasks.scoop.sticks:DigSticks",
    place_probe_entry="lerobot_excav.envs.tasks.scoop.place_probe:DugPlace",
    task_state_tolerance=1e-2,  # [kg], [m], or a count (kind: guess; the same build repeats exactly)
    judges_at_the_end=False,
    last_stage=19,
    cuts_rest=True,
)
