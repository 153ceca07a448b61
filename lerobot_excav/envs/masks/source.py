"""Mask sources: what turns a command into pixels of the main picture, and the list of them.

A source of one's own is a class with a `mask` method, made known by `register_mask_source`; then `--env.mask_source`,
`--robot.mask_source` and `lerobot-excav demos --env.mask_source` take its name. What it can be told stands in a file,
`--env.mask_options`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.pinhole import PinholeCamera
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.options import MaskOptions, read_options
from lerobot_excav.envs.masks.shot import Shot
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

    def shot(self) -> Shot:
        """Return the sharpest picture of main that there is, with its depth; its size is that of the camera."""

    def command_key(self, command: Command) -> str:
        """Return a name of the situation and the target that a file of masks can use, such as `val/3/0/1`."""

    def place_w(self, command: Command) -> NDArray[np.float64] | None:
        """Return where the commanded target is, (3,) [m], as whoever commands it knows; None if nobody does."""

    def patch(self, place_w: NDArray[np.float64], shot: Shot) -> Pixels | None:
        """Return the pixels of a shot that show the region of the ground around a place; None if targets are objects.

        What the machine hides is not in it. It follows from depth alone, so a real machine has it too.
        """

    def words(self, command: Command) -> str:
        """Return what people call the target."""

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
        parameters: What the source and its corruptions were set to, and what they found.
        place_w: Where the source itself has chosen to act, (3,) [m], world frame, and the commanded target moves to;
            None if it shows what is commanded.
    """

    pixels: Pixels
    target_id: int | None
    source: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    place_w: NDArray[np.float64] | None = None

    @property
    def img(self) -> NDArray[np.uint8]:
        """The mask as a picture, (H, W, 3) uint8 of {0, 255}."""
        return np.repeat(np.where(self.pixels, 255, 0).astype(np.uint8)[..., None], 3, axis=-1)


class MaskSource(Protocol):
    """Makes masks."""

    def mask(self, view: MaskView, command: Command) -> TargetMask | None:
        """Return the mask of a command, or None if nothing was found; an empty mask counts as nothing."""


class _Registered(NamedTuple):
    make: Callable[..., MaskSource]
    options: type[MaskOptions] | None
    chooses: bool


_SOURCES: dict[str, _Registered] = {}


def register_mask_source(
    name: str, make: Callable[..., MaskSource], *, options: type[MaskOptions] | None = None, chooses: bool = False
) -> None:
    """Make a source known by its name in `mask_source` settings; making the same one known again changes nothing.

    Args:
        name: Its name.
        make: Makes it: called with nothing, or with its options if it has any.
        options: What it can be told.
        chooses: Whether it chooses the target itself, rather than showing the one that is commanded.

    Raises:
        ConfigurationError: Another source has this name.
    """
    known = _SOURCES.setdefault(name, _Registered(make, options, chooses))
    require(known == (make, options, chooses), f"the mask source {name!r} exists; give the new one another name")


def mask_source_names() -> tuple[str, ...]:
    """Return the names of all sources, those of other packages included."""
    load_plugins()
    return tuple(_SOURCES)


def make_mask_source(name: str, *, options: str | None = None, text: str | None = None) -> MaskSource:
    """Make a source.

    Args:
        name: Its name.
        options: TOML file of what it is told; None leaves everything as it is by default.
        text: What to look for, before what the options say.

    Raises:
        ConfigurationError: There is none of this name, or the file cannot be used.
    """
    require_choice("mask_source", name, mask_source_names())
    make, kind, _ = _SOURCES[name]
    if kind is None:
        require(options is None, f"mask_options={options} has no effect: the mask source {name!r} has no options")
        require(text is None, f"the text {text!r} has no effect: the mask source {name!r} does not read")
        return make()
    told = read_options(kind, name, None if options is None else Path(options))
    if text is not None:
        require(reads_text(name), f"the text {text!r} has no effect: the mask source {name!r} does not read")
        told = told.model_copy(update={"text": text})
    return make(told)


def reads_text(name: str) -> bool:
    """Tell whether a source can be told in words what to look for."""
    kind = _SOURCES[name].options
    return kind is not None and "text" in kind.model_fields


def chooses_target(name: str) -> bool:
    """Tell whether a source chooses the target itself, so that a commanded one cannot be shown."""
    return name in mask_source_names() and _SOURCES[name].chooses


class MaskMissingError(ConfigurationError):
    """A source has found no mask, and waiting did not help."""
