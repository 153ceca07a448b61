"""Tasks and mask sources from other packages."""

from functools import cache
from importlib.metadata import entry_points

from lerobot_excav.errors import ConfigurationError

GROUP = "lerobot_excav.plugins"
"""Group of the entry points by which a package names modules that register its tasks and mask sources."""


@cache
def load_plugins() -> None:
    """Import what other packages name as entry points, once.

    Raises:
        ConfigurationError: One of them fails; the message names the package.
    """
    for entry_point in entry_points(group=GROUP):
        try:
            entry_point.load()
        except Exception as error:  # whatever another package's module may raise
            package = entry_point.dist.name if entry_point.dist else "an unknown package"
            raise ConfigurationError(
                f"the entry point {entry_point.name}={entry_point.value} of {package} cannot be loaded "
                f"({type(error).__name__}: {error}); repair or uninstall {package}"
            ) from error
