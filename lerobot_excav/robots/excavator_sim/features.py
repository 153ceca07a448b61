"""Keys of an action by which a device asks for more than motion."""

REINITIALISE = "reinitialise"
"""Side-channel key of an action: start the current scene again. LeRobot does not record it."""

NEXT_SCENE = "next_scene"
"""Side-channel key of an action: go on to the next target, or the next scene after the last one."""
