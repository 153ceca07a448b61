"""LeRobot teleoperators that drive the excavator: a gamepad, and the scripted operator."""
