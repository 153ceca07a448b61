"""The simulated FR5 arm as a LeRobot robot."""
