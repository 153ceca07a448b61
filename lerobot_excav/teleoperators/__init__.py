"""LeRobot teleoperators that drive the simulated machines: a gamepad, a page in a browser, the scripted operators."""
