"""Corrupted masks: what a wrong or an imprecise mask does to a policy, asked of any source.

Conditions test whether a policy obeys the mask; noise is the error that a segmentation makes.
"""

from dataclasses import replace

import numpy as np

from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.source import MaskSource, MaskView, Pixels, TargetMask
from lerobot_excav.errors import ExcavError, require

MASK_CONDITIONS = ("correct", "zero", "random", "mismatched")
"""`correct`; `zero`: an empty mask; `random`: the same blob elsewhere in the picture, off its place; `mismatched`: the
mask of another target, or as `random` where no other can be commanded."""

MASK_NOISES = ("none", "shift", "erode", "dilate", "flicker")
"""`none`; `shift`: moved in a random direction, kept inside the picture; `erode`: without the pixels near its outside
(city-block distance); `dilate`: with those near it; `flicker`: as `shift`, in another direction at every frame."""

_SHIFT_TRIES = 1000
_STREAM, _FLICKER_STREAM, _DROPOUT_STREAM = 0x3A5C, 0x3A5D, 0x3A5E  # name these families of random streams


class CorruptedSource:
    """Wraps a source: the same scene and target are always shown the same corruption.

    Args:
        source: Where the right masks come from.
        condition: One of `MASK_CONDITIONS`.
        noise: One of `MASK_NOISES`, added to what the condition shows.
        noise_px: Size of the noise [px].
        dropout: Share of the frames at which an empty mask is shown, drawn for each frame by itself.
    """

    def __init__(self, source: MaskSource, *, condition: str, noise: str, noise_px: int, dropout: float = 0.0) -> None:
        self._source = source
        self._condition, self._noise, self._noise_px, self._dropout = condition, noise, noise_px, dropout

    def mask(self, view: MaskView, command: Command) -> TargetMask | None:
        """Return the corrupted mask of a command.

        Raises:
            ConfigurationError: The source returns something else than a mask of the picture's size.
            ExcavError: No other place is free for the blob of a `random` mask.
        """
        key = (*view.scene_key, command.target_id)
        rng = np.random.default_rng(np.random.SeedSequence(_STREAM, spawn_key=key))
        shown = self._under_condition(view, command, rng)
        if shown is None or self._condition == "zero":
            return shown
        pixels = noisy_pixels(shown.pixels, self._noise, self._noise_px, rng)
        corruption = {"condition": self._condition, "noise": self._noise, "noise_px": self._noise_px}
        return replace(shown, pixels=pixels, parameters={**shown.parameters, **corruption}) if pixels.any() else None

    def at_frame(self, mask: TargetMask, view: MaskView, command: Command, frame: int) -> TargetMask:
        """Return a mask of this source as it is shown at a frame: itself, unless it flickers or drops out."""
        return self.dropped(self.flickered(mask, view, command, frame), view, command, frame)

    def flickered(self, mask: TargetMask, view: MaskView, command: Command, frame: int) -> TargetMask:
        """Return a mask of this source where it lies at a frame: on its place, unless it flickers."""
        if self._noise != "flicker" or not mask.pixels.any():
            return mask
        rng = _at_frame(_FLICKER_STREAM, view, command, frame)
        return replace(mask, pixels=noisy_pixels(mask.pixels, "shift", self._noise_px, rng))

    def dropped(self, mask: TargetMask, view: MaskView, command: Command, frame: int) -> TargetMask:
        """Return a mask as it is, or an empty one at the frames at which it drops out."""
        if not self._dropout or _at_frame(_DROPOUT_STREAM, view, command, frame).random() >= self._dropout:
            return mask
        return replace(mask, pixels=np.zeros_like(mask.pixels))

    def _under_condition(self, view: MaskView, command: Command, rng: np.random.Generator) -> TargetMask | None:
        if self._condition == "zero":
            size = (view.camera.height, view.camera.width)
            empty = np.zeros(size, dtype=bool)
            return TargetMask(pixels=empty, target_id=None, source="none", parameters={"condition": "zero"})
        others = view.other_commands() if self._condition == "mismatched" else []
        if others:
            return self._found(view, others[int(rng.choice(len(others)))])
        mask = self._found(view, command)
        if mask is None or self._condition == "correct":
            return mask
        return replace(mask, pixels=moved_elsewhere(mask.pixels, rng), target_id=None)

    def _found(self, view: MaskView, command: Command) -> TargetMask | None:
        """Ask the source; an empty mask counts as nothing."""
        mask = self._source.mask(view, command)
        if mask is None:
            return None
        size = (view.camera.height, view.camera.width)
        source, pixels = type(self._source).__name__, getattr(mask, "pixels", None)
        require(
            isinstance(mask, TargetMask) and isinstance(pixels, np.ndarray),
            f"the mask source {source} returned a {type(mask).__name__}; return a TargetMask, or None for nothing",
        )
        require(
            mask.pixels.shape == size and mask.pixels.dtype == bool,
            f"the mask source {source} returned pixels of shape {mask.pixels.shape} and type {mask.pixels.dtype}; "
            f"return {size} of bool, the size of the main picture",
        )
        return mask if mask.pixels.any() else None


def _at_frame(stream: int, view: MaskView, command: Command, frame: int) -> np.random.Generator:
    """Return the generator of one frame of one command in one scene."""
    key = (*view.scene_key, command.target_id, frame)
    return np.random.default_rng(np.random.SeedSequence(stream, spawn_key=key))


def moved_elsewhere(inside: Pixels, rng: np.random.Generator) -> Pixels:
    """Shift a blob (H, W) inside the picture so that it does not overlap its old place.

    Raises:
        ExcavError: No other place is free for it.
    """
    rows, cols = np.nonzero(inside)
    height, width = inside.shape
    for _ in range(_SHIFT_TRIES):
        row_shift = int(rng.integers(-rows.min(), height - rows.max()))
        col_shift = int(rng.integers(-cols.min(), width - cols.max()))
        moved = _shifted(inside, row_shift, col_shift)
        if not np.any(moved & inside):
            return moved
    raise ExcavError(
        f"mask_condition='random': no free place for a blob of {rows.size} pixels in {height} x {width}; "
        "use larger observation_height and observation_width"
    )


def noisy_pixels(inside: Pixels, noise: str, size_px: int, rng: np.random.Generator) -> Pixels:
    """Return a mask (H, W) with an error of `MASK_NOISES` and of a size [px]; erosion may leave nothing of it.

    A mask that flickers has its error at each frame alone (`CorruptedSource.at_frame`).
    """
    if noise == "shift":
        angle = rng.uniform(0.0, 2.0 * np.pi)
        rows, cols = np.nonzero(inside)
        height, width = inside.shape
        row_shift = np.clip(round(size_px * np.sin(angle)), -rows.min(), height - 1 - rows.max())
        col_shift = np.clip(round(size_px * np.cos(angle)), -cols.min(), width - 1 - cols.max())
        return _shifted(inside, int(row_shift), int(col_shift))
    if noise == "dilate":
        return grown(inside, size_px)
    # Eroding the mask is dilating its outside; beyond the picture's edge lies neither.
    return ~grown(~inside, size_px) if noise == "erode" else inside.copy()


def grown(inside: Pixels, size_px: int = 1) -> Pixels:
    """Return a mask with the four neighbours of every pixel added, `size_px` times."""
    for _ in range(size_px):
        around = np.pad(inside, 1)
        inside = inside | around[2:, 1:-1] | around[:-2, 1:-1] | around[1:-1, 2:] | around[1:-1, :-2]
    return inside


def _shifted(inside: Pixels, row_shift: int, col_shift: int) -> Pixels:
    moved = np.zeros_like(inside)
    rows, cols = np.nonzero(inside)
    moved[rows + row_shift, cols + col_shift] = True
    return moved
