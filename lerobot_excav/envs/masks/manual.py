"""Mask source `manual`: what a person has drawn or clicked, from a file.

    [[mask]]
    key = "val/3/0/1"                # scene set, scene, stage, target; in Clear-v0 the cycle behind them, from 0 on
    polygon = [[0.40, 0.55], [0.48, 0.55], [0.48, 0.62], [0.40, 0.62]]

    [[mask]]
    key = "*"                        # whatever has no entry of its own
    click = [0.52, 0.61]

    [[mask]]
    key = "train/0/0/2"
    box = [0.30, 0.40, 0.38, 0.52]   # left, upper, right, lower: a little larger than the object

Places are shares of the picture's width and height, from its upper left corner. A click on an object marks the object;
one on the ground marks the region around it that the machine digs. A click needs depth; a polygon and a box do not, and
what fills the box is told by its colour.
"""

from collections.abc import Sequence
from typing import Annotated, Self

import numpy as np
from PIL import Image, ImageDraw
from pydantic import BaseModel, ConfigDict, Field, model_validator

from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.object_pixels import object_by_colour, object_by_depth
from lerobot_excav.envs.masks.options import ANY, MaskOptions, Share, require_distinct
from lerobot_excav.envs.masks.shot import Shot, reduced
from lerobot_excav.envs.masks.source import MaskView, Pixels, TargetMask, register_mask_source
from lerobot_excav.errors import ConfigurationError, require

FINER = 8
"""How many times finer a polygon is drawn than the mask (kind: guess)."""

Place = tuple[Share, Share]


class Entry(BaseModel):
    """What somebody has marked in one situation; places are shares of width and height."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    key: Annotated[str, Field(min_length=1)]
    polygon: Annotated[tuple[Place, ...], Field(min_length=3)] | None = None
    click: Place | None = None
    box: tuple[Share, Share, Share, Share] | None = None

    @model_validator(mode="after")
    def _says_one_thing(self) -> Self:
        if sum(said is not None for said in (self.polygon, self.click, self.box)) != 1:
            raise ValueError("give a polygon, a click or a box")
        return self


class ManualOptions(MaskOptions):
    """Options of the source `manual`: the masks themselves, as tables `[[mask]]`."""

    mask: tuple[Entry, ...] = ()


class ManualSource:
    """Shows what the file says of a situation.

    Args:
        options: The entries.

    Raises:
        ConfigurationError: There are none, or two have the same key.
    """

    def __init__(self, options: ManualOptions) -> None:
        require(
            bool(options.mask),
            "mask_source='manual' needs masks: give mask_options=FILE, a TOML file of tables [[mask]], each with a key "
            "and a polygon, a click or a box",
        )
        require_distinct([entry.key for entry in options.mask], "masks")
        self._entries = {entry.key: entry for entry in options.mask}

    def mask(self, view: MaskView, command: Command) -> TargetMask | None:
        """Return the mask of a command; None if it covers no pixel.

        Raises:
            ConfigurationError: The file says nothing of this situation, or a click hits nothing.
        """
        key = view.command_key(command)
        entry = self._entries.get(key) or self._entries.get(ANY)
        if entry is None:
            raise ConfigurationError(
                f"mask_options has no mask with key = {key!r}, and none with key = {ANY!r}; add one, or take others"
            )
        size = (view.camera.height, view.camera.width)
        pixels = polygon_pixels(entry.polygon, size) if entry.polygon else reduced(_meant(view, entry), size)
        if not pixels.any():
            return None
        return TargetMask(pixels=pixels, target_id=command.target_id, source="manual", parameters={"key": entry.key})


def polygon_pixels(polygon: Sequence[Place], size: tuple[int, int]) -> Pixels:
    """Return the pixels (H, W) of a picture more than half of which a polygon covers; a very thin one covers none."""
    height, width = (FINER * length for length in size)
    image = Image.new("1", (width, height))
    ImageDraw.Draw(image).polygon([(x * width - 0.5, y * height - 0.5) for x, y in polygon], fill=1)
    return reduced(np.asarray(image), size)


def _meant(view: MaskView, entry: Entry) -> Pixels:
    """Return the pixels of a shot that a click or a box means."""
    shot: Shot = view.shot()
    if entry.box is not None:
        height, width = shot.size
        left, upper, right, lower = entry.box
        return object_by_colour(shot.picture, (left * width, upper * height, right * width, lower * height))
    points_w = shot.points_w()
    assert entry.click is not None  # by its kind
    row, column = (
        min(int(share * length), length - 1) for share, length in zip(entry.click[::-1], shot.size, strict=True)
    )
    place_w = points_w[row, column]
    patch = view.patch(place_w, shot)
    meant = object_by_depth(shot, place_w) if patch is None else patch
    require(
        bool(meant[row, column]),
        f"the click {entry.click} of the mask {entry.key!r} hits nothing that can be commanded: no object, or no soil "
        "that is seen; move it",
    )
    return meant


register_mask_source("manual", ManualSource, options=ManualOptions)
