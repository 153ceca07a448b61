"""A real excavator, or its emulator, as a LeRobot robot."""
