"""Mask sources: what turns a command into pixels of the main picture, and the list of them.

A source of one's own is a class with a `mask` method, made known by `register_mask_source`; then `--env.mask_source`,
`--robot.mask_source` and `lerobot-excav demos --env.mask_source` take its name.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.pinhole import PinholeCamera
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.plugins import load_plugins
from lerobot_excav.errors import ConfigurationError, require, require_choice

Pixels = NDArray[np.bool_]


class MaskView(Protocol):
    """What a source may look at: the main camera at the moment at which the mask is asked for."""

    @property
    def camera(self) -> PinholeCamera:
        """Where the main camera stands, and how it projects."""

    @property
    def scene_key(self) -> tuple[int, ...]:
        """Numbers of scene set, scene and perhaps cycle; on a real machine any that name the situation."""

    def picture(self) -> NDArray[np.uint8]:
        """Return the main picture, (H, W, 3) uint8."""

    def depth_m(self) -> NDArray[np.float32]:
        """Return the distance along the optical axis, registered with the picture, (H, W) float32 [m]."""

    def other_commands(self) -> list[Command]:
        """Return what else could be commanded now, in the order of the targets; there may be nothing."""

    def true_mask(self, command: Command) -> Pixels:
        """Return what a simulator knows, (H, W) bool, whatever stands before the target.

        Raises:
            ConfigurationError: There is no simulator.
        """


@dataclass(frozen=True, kw_only=True)
class TargetMask:
    """A mask, and where it comes from.

    Attributes:
        pixels: What it marks, (H, W) bool.
        target_id: Target that it shows; None if it shows none.
        source: Name of the source.
        parameters: What the source and its corruptions were set to.
    """

    pixels: Pixels
    target_id: int | None
    source: str
    parameters: Mapping[str, Any] = field(default_factory=dict)

    @property
    def img(self) -> NDArray[np.uint8]:
        """The mask as a picture, (H, W, 3) uint8 of {0, 255}."""
        return np.repeat(np.where(self.pixels, 255, 0).astype(np.uint8)[..., None], 3, axis=-1)


class MaskSource(Protocol):
    """Makes masks."""

    def mask(self, view: MaskView, command: Command) -> TargetMask | None:
        """Return the mask of a command, or None if nothing was found; an empty mask counts as nothing."""


_SOURCES: dict[str, Callable[[], MaskSource]] = {}


def register_mask_source(name: str, make: Callable[[], MaskSource]) -> None:
    """Make a source known by its name in `mask_source` settings; making the same one known again changes nothing.

    Raises:
        ConfigurationError: Another source has this name.
    """
    known = _SOURCES.setdefault(name, make)
    require(known is make, f"the mask source {name!r} exists; give the new one another name")


def mask_source_names() -> tuple[str, ...]:
    """Return the names of all sources, those of other packages included."""
    load_plugins()
    return tuple(_SOURCES)


def make_mask_source(name: str) -> MaskSource:
    """Make a source.

    Raises:
        ConfigurationError: There is none of this name.
    """
    require_choice("mask_source", name, mask_source_names())
    return _SOURCES[name]()


class MaskMissingError(ConfigurationError):
    """A source has found no mask, and waiting did not help."""
