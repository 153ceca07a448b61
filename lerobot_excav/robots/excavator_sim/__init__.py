"""The simulated excavator as a LeRobot robot."""
