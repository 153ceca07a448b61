"""The environments as the commands of LeRobot see them: configurations, vector environments, the metrics file."""
