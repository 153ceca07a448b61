"""The arm's scripted operator as a LeRobot teleoperator."""
