"""Names of what the excavator reports and obeys, in LeRobot's flat dictionaries.

Each scalar ends in `.pos` or `.vel`: `lerobot-rollout` drops every other name without a word.
"""

JOINTS = ("swing", "boom", "arm", "bucket")
STATE_NAMES = (*(f"{joint}.pos" for joint in JOINTS), *(f"{joint}.vel" for joint in JOINTS))
"""Joint positions [rad] and velocities [rad/s], in the order of `agent_pos`."""

ACTION_NAMES = tuple(f"{joint}.vel" for joint in JOINTS)
"""Joystick commands in [-1, 1], in the order of the environment's action."""

CAMERAS = ("main", "cab", "target_mask")

REINITIALISE = "reinitialise"
"""Side-channel key of an action: start the current scene again. LeRobot does not record it."""

NEXT_SCENE = "next_scene"
"""Side-channel key of an action: go on to the next target, or the next scene after the last one."""
