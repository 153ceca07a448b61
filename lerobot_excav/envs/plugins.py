"""Tasks and mask sources from other packages."""

from functools import cache
from importlib.metadata import entry_points

GROUP = "lerobot_excav.plugins"
"""Group of the entry points by which a package names modules that register its tasks and mask sources."""


@cache
def load_plugins() -> None:
    """Import what other packages name as entry points, once."""
    for entry_point in entry_points(group=GROUP):
        entry_point.load()
