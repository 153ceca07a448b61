"""Keys of an action by which a device asks for more than motion."""

from collections.abc import Mapping
from typing import Any

REINITIALISE = "reinitialise"
"""Side-channel key of an action: start the current scene again. LeRobot does not record it."""

NEXT_SCENE = "next_scene"
"""Side-channel key of an action: go on to the next target, or the next scene after the last one."""


def is_pressed(action: Mapping[str, Any], key: str) -> bool:
    """Return whether an action holds a key with a value above one half."""
    return float(action.get(key, 0.0)) > 0.5
