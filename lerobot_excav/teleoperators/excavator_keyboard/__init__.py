"""The keyboard as a LeRobot teleoperator of the excavator."""
