"""The configuration of a LeRobot command, found from the part of it that this package gets to see.

LeRobot hands an environment or a robot its own configuration only. The command's configuration holds that one, so it is
in memory, whether its values came from flags, from a file or from Python. The names of its fields are not an interface
of LeRobot: the tests run the commands for real, to notice when they change.
"""

import gc
from typing import Any


def holder_of(config: Any, field: str) -> Any | None:
    """Return the dataclass whose field of this name is this very configuration, or None if there is none."""
    for referrer in gc.get_referrers(config):
        # The fields of an object may lie in a dictionary of their own.
        for each in gc.get_referrers(referrer) if isinstance(referrer, dict) else [referrer]:
            if hasattr(type(each), "__dataclass_fields__") and getattr(each, field, None) is config:
                return each
    return None
