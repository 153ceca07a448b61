"""What everything that drives a simulated machine shares as a LeRobot teleoperator."""

from abc import abstractmethod
from typing import Any

from lerobot.teleoperators.teleoperator import Teleoperator


class SimulationTeleoperator(Teleoperator):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """A teleoperator that gives a machine's commands, gets no feedback and needs no calibration."""

    @property
    @abstractmethod
    def action_names(self) -> tuple[str, ...]:
        """Names of the commands, as the robot takes them."""

    @property
    def action_features(self) -> dict[str, type]:
        """Commands as the robot takes them; the keys of buttons are not recorded."""
        return dict.fromkeys(self.action_names, float)

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
