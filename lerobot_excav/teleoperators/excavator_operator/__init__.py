"""The scripted operator as a LeRobot teleoperator."""
