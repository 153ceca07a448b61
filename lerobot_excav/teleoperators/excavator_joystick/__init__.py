"""A gamepad as a LeRobot teleoperator of the excavator."""
