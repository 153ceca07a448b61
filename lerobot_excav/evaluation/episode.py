"""Outcome of one evaluation episode: what all tasks share."""

from dataclasses import dataclass
from typing import Any, NamedTuple


class EpisodeKey(NamedTuple):
    """What makes episodes of two runs comparable."""

    scene_set: str
    scene_id: int
    target_id: int

    def __str__(self) -> str:
        return f"{self.scene_set}/{self.scene_id}/{self.target_id}"


@dataclass(frozen=True, kw_only=True)
class Episode:
    """A line of a metrics file; every field of a subclass is an entry that the line must have.

    Attributes:
        simulation_version: Version of the simulation.
        scene_set: Scene set.
        scene_id: Scene.
        target_id: Target that is commanded at first.
        mask_condition: Which mask was shown.
        is_success: Whether every part of the task succeeded.
    """

    simulation_version: int
    scene_set: str
    scene_id: int
    target_id: int
    mask_condition: str
    is_success: bool

    @classmethod
    def completed(cls, record: dict[str, Any]) -> dict[str, Any]:
        """Return a line with the entries that an early version of the simulation did not write."""
        return record

    @property
    def key(self) -> EpisodeKey:
        """Scene and target."""
        return EpisodeKey(self.scene_set, self.scene_id, self.target_id)
