"""LeRobot teleoperators that drive the simulated machines: a gamepad, and the scripted operators."""
