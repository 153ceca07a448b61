"""Imprecise masks of objects, snapped onto what lies under their middle: for policies trained with exact ones."""

from dataclasses import replace

import numpy as np

from lerobot_excav.envs.masks.click.source import ClickOptions, ClickSource
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.corrupted import CorruptedSource
from lerobot_excav.envs.masks.shot import reduced
from lerobot_excav.envs.masks.source import MaskView, TargetMask

LEAST_SHARE, MOST_SHARE = 0.25, 4.0
"""Pixels of the snapped mask over those of the mask; beyond, something else was marked (kind: guess)."""


class SnappedSource:
    """Marks what lies under the middle of each mask, by the click segmenter that comes with the package.

    It looks once for a command, so a mask that flickers is held as it was snapped. Where the segmenter marks nothing
    that is like the mask in size and overlaps it, the mask stays as it was.

    Args:
        source: Where the imprecise masks come from.
    """

    def __init__(self, source: CorruptedSource) -> None:
        self._source, self._clicks = source, ClickSource(ClickOptions())

    def mask(self, view: MaskView, command: Command) -> TargetMask | None:
        """Return the snapped mask of a command.

        Raises:
            ConfigurationError: The source returns something else than a mask of the picture's size.
        """
        shown = self._source.mask(view, command)
        if shown is None:
            return None
        shown = self._source.at_frame(shown, view, command, command.since_frame)
        middle = (np.argwhere(shown.pixels).mean(axis=0) + 0.5) / shown.pixels.shape
        fine = self._clicks.segmenter.pixels(view.shot().picture, *map(float, middle))
        pixels = reduced(fine, (view.camera.height, view.camera.width))
        share = pixels.sum() / shown.pixels.sum()
        found = LEAST_SHARE <= share <= MOST_SHARE and bool((pixels & shown.pixels).any())
        facts = {**shown.parameters, "snap": "snapped" if found else "nothing like it there"}
        return replace(shown, pixels=pixels if found else shown.pixels, parameters=facts)

    def at_frame(self, mask: TargetMask, view: MaskView, command: Command, frame: int) -> TargetMask:
        """Return a mask of this source as it is shown at a frame: itself."""
        return mask
