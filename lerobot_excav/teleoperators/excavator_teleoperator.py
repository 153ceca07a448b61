"""What everything that drives the excavator shares as a LeRobot teleoperator."""

from typing import Any

from lerobot.teleoperators.teleoperator import Teleoperator

from lerobot_excav.envs.features import ACTION_NAMES


class ExcavatorTeleoperator(Teleoperator):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """A teleoperator that gives the excavator's four commands, gets no feedback and needs no calibration."""

    @property
    def action_features(self) -> dict[str, type]:
        """Joystick commands in [-1, 1], as the robot takes them; the keys of buttons are not recorded."""
        return dict.fromkeys(ACTION_NAMES, float)

    @property
    def feedback_features(self) -> dict[str, type]:
        """None."""
        return {}

    @property
    def is_calibrated(self) -> bool:
        """Always: SDL calibrates gamepads, and a script needs no calibration."""
        return True

    def calibrate(self) -> None:
        """Do nothing: see `is_calibrated`."""

    def configure(self) -> None:
        """Do nothing: the configuration is complete when the teleoperator is made."""

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Do nothing: there is no feedback."""
