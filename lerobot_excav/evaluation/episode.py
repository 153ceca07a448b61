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
        mask_noise: How it was disturbed.
        mask_noise_px: By how much [px].
        is_success: Whether every part of the task succeeded.
    """

    simulation_version: int
    scene_set: str
    scene_id: int
    target_id: int
    mask_condition: str
    mask_noise: str
    mask_noise_px: int
    is_success: bool

    @classmethod
    def completed(cls, record: dict[str, Any]) -> dict[str, Any]:
        """Return a line with the entries that an early version of the simulation did not write."""
        return record

    @property
    def mask(self) -> str:
        """What the mask showed, in words."""
        noise = "" if self.mask_noise == "none" else f", {self.mask_noise} {self.mask_noise_px} px"
        return f"{self.mask_condition}{noise}"

    @property
    def key(self) -> EpisodeKey:
        """Scene and target."""
        return EpisodeKey(self.scene_set, self.scene_id, self.target_id)
