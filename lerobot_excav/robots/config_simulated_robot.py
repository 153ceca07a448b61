"""What the configurations of all simulated robots share, besides the settings of their tasks."""

from dataclasses import dataclass
from pathlib import Path
from typing import cast

from lerobot.robots import RobotConfig

from lerobot_excav.envs.tasks.registry import task_of_settings
from lerobot_excav.envs.tasks.settings import LAST_SCENE, TARGETS_PER_SCENE, TaskSettings
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import require
from lerobot_excav.setting import setting

ADVANCE_MODES = ("episode", "button")


@dataclass(kw_only=True)
class SimulatedRobotConfig(RobotConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Set up a simulated robot from LeRobot's command line.

    Put the settings of a task before this class, and register the result with LeRobot:

        @RobotConfig.register_subclass("excavator_sim")
        @dataclass(kw_only=True)
        class ExcavatorSimConfig(ExcavatorSettings, SimulatedRobotConfig):
            PREFIX: ClassVar[str] = "robot."

    Every `send_action` advances the simulation by one frame of `fps`: give the command the same rate, as
    `--dataset.fps` when recording and as `--fps` when rolling out.

    Raises:
        ConfigurationError: A field has a value that the simulation cannot use.
    """

    scene_id: int = setting("First scene", default=0, low=0, high=LAST_SCENE)
    target_id: int = setting("First target in it", default=0, choices=tuple(range(TARGETS_PER_SCENE)))
    stage: int = setting(
        "Stage of every scene: how many cycles a seeded operator has dug in it before; reaching one takes seconds a "
        "cycle, at the first target of every scene",
        default=0,
        low=0,
    )
    advance: str = setting(
        "What leads to the next target: episode gives every recorded episode its own, button waits for the key "
        "next_scene of the side channel",
        default="episode",
        choices=ADVANCE_MODES,
    )
    session_log: Path | None = setting(
        "JSON Lines file about the recorded episodes, for lerobot-excav index; left out: "
        "outputs/<robot>_sessions/<date>_<time>.jsonl",
        default=None,
    )
    depth: bool = setting(
        "Whether the robot offers the depth image registered with the main camera, to Python code", default=False
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        cast(TaskSettings, self).require_commanded_mask()
        length = cast(TaskSettings, self).episode_length
        require(
            length is None,
            f"robot.episode_length={length} has no effect: the command ends an episode. Leave it out; lerobot-record "
            "takes --dataset.episode_time_s.",
        )
        last = self.task_spec.last_stage
        require(
            self.stage <= last,
            f"robot.stage={self.stage} is not possible with robot.task={self.task_spec.id!r}; the last stage is {last}",
        )
        starts = self.task_spec.starts_per_scene  # a robot without such a task is refused at once
        require(
            self.target_id < starts,
            f"robot.target_id={self.target_id} is not possible with robot.task={self.task_spec.id!r}, which chooses "
            "its targets itself; leave it out",
        )

    @property
    def task_spec(self) -> TaskSpec:
        """The task.

        Raises:
            ConfigurationError: This robot has no such task.
        """
        return task_of_settings(cast(TaskSettings, self))
