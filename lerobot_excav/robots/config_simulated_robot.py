"""What the configurations of all simulated robots share."""

from dataclasses import dataclass
from pathlib import Path

from lerobot.robots import RobotConfig

from lerobot_excav.envs.tasks.settings import (
    LAST_SCENE,
    TARGETS_PER_SCENE,
    require_integer,
    require_view_settings,
)
from lerobot_excav.errors import require_choice

ADVANCE_MODES = ("episode", "button")


@dataclass(kw_only=True)
class SimulatedRobotConfig(RobotConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Set up a simulated robot from LeRobot's command line.

    Attributes:
        task: Name of the task in the gym namespace `lerobot_excav`.
        fps: Frames per second of simulated time, which every `send_action` advances by one frame. Give the
            command the same: `--dataset.fps` when recording, `--fps` when rolling out.
        observation_height: Height of every picture [px].
        observation_width: Width of every picture [px].
        scene_set: Stream of scenes: `train`, `val` or `test`.
        scene_id: First scene.
        target_id: First target in it, 0 to 3.
        advance: What leads to the next target: `episode`, so that every recorded episode has its own, or
            `button`, so that only the side-channel key `next_scene` does.
        session_log: JSON Lines file about the recorded episodes (see `session_log.py`), by default
            `outputs/<robot>_sessions/<date>_<time>.jsonl` below the working directory.
    """

    task: str
    fps: int
    observation_height: int = 96
    observation_width: int = 128
    scene_set: str = "train"
    scene_id: int = 0
    target_id: int = 0
    advance: str = "episode"
    session_log: Path | None = None

    def __post_init__(self) -> None:
        """Validate the fields; the subclass validates its task.

        Raises:
            ConfigurationError: A field has a value that the simulation cannot use.
        """
        super().__post_init__()
        require_view_settings(
            "robot.",
            scene_set=self.scene_set,
            fps=self.fps,
            observation_height=self.observation_height,
            observation_width=self.observation_width,
        )
        require_integer("robot.scene_id", self.scene_id, 0, LAST_SCENE)
        require_choice("robot.target_id", self.target_id, range(TARGETS_PER_SCENE))
        require_choice("robot.advance", self.advance, ADVANCE_MODES)
