"""Mask source `click`: a click, and a small network that marks what was clicked on. It needs pixels alone.

    model = "my_clicks.safetensors"  # left out: the network that comes with the package

    [[click]]
    key = "val/3/0/1"                # scene set, scene, stage, target; in Clear-v0 the cycle behind them, from 0 on
    place = [0.52, 0.61]             # shares of width and height, from the upper left corner

    [[click]]
    key = "*"                        # whatever has no entry of its own
    place = [0.40, 0.55]

Where nobody has clicked and the place of the target is known, as in a simulator, the click is that place as the camera
sees it, missed by `error_px` on either axis.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from lerobot_excav.envs.machines.pinhole import PinholeCamera
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.options import ANY, MaskOptions, Share, require_distinct
from lerobot_excav.envs.masks.shot import Shot, reduced
from lerobot_excav.envs.masks.source import MaskView, TargetMask, register_mask_source
from lerobot_excav.errors import ConfigurationError, require

if TYPE_CHECKING:
    from lerobot_excav.envs.masks.click.segmenter import ClickSegmenter

_STREAM = 0x51C3  # names the random streams of missed clicks


class Click(BaseModel):
    """Where somebody has clicked in one situation."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    key: Annotated[str, Field(min_length=1)]
    place: tuple[Share, Share]


class ClickOptions(MaskOptions):
    """Options of the source `click`.

    Attributes:
        model: File of a network; None: the one that comes with the package.
        click: Where was clicked.
        error_px: Standard deviation of clicks on known places, along each axis, in pixels of the policy's picture.
    """

    model: str | None = None
    click: tuple[Click, ...] = ()
    error_px: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0


class ClickSource:
    """Marks what was clicked on; the network runs once for a command.

    Args:
        options: What it is told.

    Raises:
        ConfigurationError: Two clicks have the same key, or the model cannot be read.
    """

    def __init__(self, options: ClickOptions) -> None:
        self._options = options
        require_distinct([click.key for click in options.click], "clicks")
        self._clicks = {click.key: click.place for click in options.click}
        self._segmenter: ClickSegmenter | None = None

    def mask(self, view: MaskView, command: Command) -> TargetMask | None:
        """Return the mask of a command; None if the network marks nothing there.

        Raises:
            ConfigurationError: Nobody has clicked and the place is not known, or the place is out of sight.
        """
        shot = view.shot()
        column, row = self._clicks.get(view.command_key(command)) or self._known(view, command, shot)
        fine = self.segmenter.pixels(shot.picture, row, column)
        pixels = reduced(fine, (view.camera.height, view.camera.width))
        if not pixels.any():
            return None
        facts = {"click": [round(column, 4), round(row, 4)], **self.segmenter.facts}
        return TargetMask(pixels=pixels, target_id=command.target_id, source="click", parameters=facts)

    @property
    def segmenter(self) -> "ClickSegmenter":
        """The network, loaded at first use: PyTorch takes seconds."""
        if self._segmenter is None:
            from lerobot_excav.envs.masks.click.segmenter import BUILT_IN, ClickSegmenter

            model = self._options.model
            self._segmenter = ClickSegmenter.load(BUILT_IN if model is None else Path(model))
        return self._segmenter

    def _known(self, view: MaskView, command: Command, shot: Shot) -> tuple[float, float]:
        """Return the click for whatever has no entry, or on the known place, as shares of width and height."""
        if ANY in self._clicks:
            return self._clicks[ANY]
        place_w, key = view.place_w(command), view.command_key(command)
        if place_w is None or shot.camera is None:
            raise ConfigurationError(
                f"mask_source='click' does not know where to click: mask_options has no click with key = {key!r}, and "
                f"none with key = {ANY!r}; add one"
            )
        return self._missed(view, command, shot.camera, place_w)

    def _missed(
        self, view: MaskView, command: Command, camera: PinholeCamera, place_w: NDArray[np.float64]
    ) -> tuple[float, float]:
        """Return a click on a known place, as shares of width and height: missed a little, but on the picture."""
        seen = camera.pixel(place_w)
        size = np.array([camera.height, camera.width])
        share = np.array([np.inf, np.inf]) if seen is None else (np.array(seen) + 0.5) / size
        require(
            bool(((share >= 0.0) & (share <= 1.0)).all()),
            f"mask_source='click': the target {view.command_key(command)!r} is out of the picture, so nobody could "
            "click on it",
        )
        rng = np.random.default_rng(np.random.SeedSequence(_STREAM, spawn_key=(*view.scene_key, command.target_id)))
        error = self._options.error_px * rng.standard_normal(2) / (view.camera.height, view.camera.width)
        row, column = np.clip(share + error, 0.0, 1.0)
        return float(column), float(row)


register_mask_source("click", ClickSource, options=ClickOptions)
