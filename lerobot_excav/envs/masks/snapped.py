"""Imprecise masks of objects, snapped onto what lies under their middle: for policies trained with exact ones."""

from dataclasses import replace

import numpy as np

from lerobot_excav.envs.masks.click.source import ClickOptions, ClickSource
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.corrupted import CorruptedSource
from lerobot_excav.envs.masks.shot import reduced
from lerobot_excav.envs.masks.source import MaskSource, MaskView, TargetMask

LEAST_SHARE, MOST_SHARE = 0.25, 4.0
"""Pixels of the snapped mask over those of the mask; beyond, something else was marked (kind: guess)."""


class Snapper:
    """Marks what lies under the middle of a mask, by the click segmenter that comes with the package.

    Where it marks nothing that is like the mask in size and overlaps it, the mask stays as it was.
    """

    def __init__(self) -> None:
        self._clicks = ClickSource(ClickOptions())

    def snap(self, mask: TargetMask, view: MaskView) -> TargetMask:
        """Return what lies under the middle of a mask that is not empty; its parameters say whether it was found."""
        middle = (np.argwhere(mask.pixels).mean(axis=0) + 0.5) / mask.pixels.shape
        fine = self._clicks.segmenter.pixels(view.shot().picture, *map(float, middle))
        pixels = reduced(fine, (view.camera.height, view.camera.width))
        share = pixels.sum() / mask.pixels.sum()
        found = LEAST_SHARE <= share <= MOST_SHARE and bool((pixels & mask.pixels).any())
        facts = {**mask.parameters, "snap": "snapped" if found else "nothing like it there"}
        return replace(mask, pixels=pixels if found else mask.pixels, parameters=facts)


class SnappedMasks:
    """The masks of a source, each snapped.

    Args:
        source: Where the imprecise masks come from.
    """

    def __init__(self, source: MaskSource) -> None:
        self._source, self._snapper = source, Snapper()

    def mask(self, view: MaskView, command: Command) -> TargetMask | None:
        """Return the snapped mask of a command; None where the source finds nothing, and an empty one as it is."""
        found = self._source.mask(view, command)
        return found if found is None or not found.pixels.any() else self._snapper.snap(found, view)


class SnappedSource:
    """The masks of a source that corrupts them, each snapped: once for a command, so one that flickers is held.

    Args:
        source: Where the imprecise masks come from.
    """

    def __init__(self, source: CorruptedSource) -> None:
        self._source, self._snapper = source, Snapper()

    def mask(self, view: MaskView, command: Command) -> TargetMask | None:
        """Return the snapped mask of a command.

        Raises:
            ConfigurationError: The source returns something else than a mask of the picture's size.
        """
        shown = self._source.mask(view, command)
        if shown is None:
            return None
        return self._snapper.snap(self._source.flickered(shown, view, command, command.since_frame), view)

    def at_frame(self, mask: TargetMask, view: MaskView, command: Command, frame: int) -> TargetMask:
        """Return a mask of this source as it is shown at a frame: itself, unless it drops out."""
        return self._source.dropped(mask, view, command, frame)
