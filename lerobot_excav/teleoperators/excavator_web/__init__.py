"""A page in a browser as a LeRobot teleoperator of the excavator."""
