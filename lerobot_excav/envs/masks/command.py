"""A command: which target, since when."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Command:
    """What is commanded from some frame of an episode on.

    Attributes:
        target_id: Index of the target among those of the scene.
        region: What the target is, as the task knows it: a patch of ground, a block.
        since_frame: How many actions had been carried out when it was given; 0 at the start.
    """

    target_id: int
    region: Any
    since_frame: int = 0
