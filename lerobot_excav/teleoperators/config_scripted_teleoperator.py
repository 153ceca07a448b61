"""What the configurations of all scripted operators share."""

from dataclasses import dataclass

from lerobot.teleoperators.config import TeleoperatorConfig

from lerobot_excav.errors import require


@dataclass(kw_only=True)
class ScriptedTeleoperatorConfig(TeleoperatorConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Set up a scripted operator from LeRobot's command line.

    Attributes:
        seed: Seeds how the operator varies what it does. With the scene and the target it fixes the
            demonstration, so recording an episode again gives the same one.
    """

    seed: int = 0

    def __post_init__(self) -> None:
        """Validate the fields.

        Raises:
            ConfigurationError: `seed` is negative.
        """
        require(self.seed >= 0, f"teleop.seed={self.seed} is not possible; give a number from 0 on.")
