"""The task as data, and its settings."""

from dataclasses import dataclass
from typing import ClassVar

from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.setting import setting, with_default


@dataclass(kw_only=True)
class ReachSettings(TaskSettings):
    """What a user may set."""

    ENV_TYPE: ClassVar[str] = "toy_reach"

    task: str = with_default(TaskSettings, "task", "Reach-v0")
    fps: int = with_default(TaskSettings, "fps", 10)
    table: str = setting(
        "What the table is made of",
        default="wood",
        choices=("wood", "ice"),
        is_column=True,
        changes_start=True,
    )


REACH = TaskSpec(
    id="Reach-v0",
    robot_type="toy_reach_sim",
    description="Slide to the spot that the mask marks.",
    cameras=("main", "near", "target_mask"),
    views=("overview", "main"),
    state_names=("x.pos", "y.pos"),
    action_names=("x.vel", "y.vel"),
    action_low=(-1.0, -1.0),
    action_high=(1.0, 1.0),
    task_state_names=("distance_to_target_m", "frames_on_target"),
    duration_s=4.0,
    storage="image",
    settings=ReachSettings,
    simulation_version=1,
    changes={1: "the first"},
    env_entry="toy_reach.env:ReachEnv",
    operator_entry="toy_reach.operator:ReachOperator",
    measures_entry="toy_reach.measures:REACH_MEASURES",
    nearest_target_entry="toy_reach.table:nearest_target",
    place_probe_entry="toy_reach.place_probe:ArrivedPlace",
    task_state_tolerance=1e-6,
    judges_at_the_end=False,
)
