"""Simulated machines as LeRobot robots, for recording, replay, teleoperation and rollout."""
