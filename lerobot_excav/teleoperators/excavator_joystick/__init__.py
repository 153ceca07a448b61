"""A gamepad as a LeRobot teleoperator of the excavator."""

from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig

__all__ = ["ExcavatorJoystickConfig"]
