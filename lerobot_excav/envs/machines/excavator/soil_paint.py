"""The colours of the dig area in pictures for people: soil and bare ground, cuts, hollows, and marked patches."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.interpolation import resampled
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M

TEXELS = 512
"""Along each side of the dig area: one is 12 mm wide, about a pixel of a picture of 480 x 640."""

COMMANDED_RGB = (0.92, 0.16, 0.10)
SHOWN_RGB = (0.16, 0.43, 0.92)
"""Colours of the patch that is to be dug, and of the one that a policy was told to dig."""

_TEXEL_M = DIG_AREA_EXTENT_M[0] / TEXELS
_NOISE_SEED = 5  # a picture, not an experiment: the same grain in every scene

# All tuned by eye.
_BARE_M = (0.004, 0.03)  # soil from the lower to the upper height fades in over the ground
_CUT_M = (0.015, 0.09)  # so much lower than at the start, soil is shown as cut
_CUT_SHADE = np.array([0.66, 0.60, 0.56], np.float32)  # damp soil from below is darker, and less yellow
_HOLLOW = 3.5  # darkening of hollows, lightening of ridges, per metre
_HOLLOW_CELLS, _HOLLOW_RANGE = 3, (0.7, 1.25)
_MARK_SHARE, _RIM_SHARE, _RIM_M = 0.42, 0.95, 0.05


class Patch(NamedTuple):
    """A convex patch to mark."""

    corners_w: NDArray[np.float64]  # (n, 2) [m], counter-clockwise from above
    rgb: tuple[float, float, float]


class SoilPaint:
    """Paints a texture (TEXELS, TEXELS, 3) of the dig area, y first, each channel in [0, 1]."""

    def __init__(self) -> None:
        rng = np.random.default_rng(_NOISE_SEED)
        self._grain = np.clip(1.0 + 0.07 * _noise(rng, TEXELS, coarse_px=3.0), 0.75, 1.2)[..., None]
        middle = (np.arange(TEXELS) + 0.5) * _TEXEL_M - 0.5 * DIG_AREA_EXTENT_M[0]
        self._places_w = np.stack(np.meshgrid(middle, middle), axis=-1)

    def paint(
        self,
        heights_m: NDArray[np.float64],
        start_heights_m: NDArray[np.float64],
        *,
        soil_rgb: NDArray[np.float64],
        ground_rgb: NDArray[np.float64],
        patches: Sequence[Patch] = (),
    ) -> NDArray[np.float32]:
        """Return the texture.

        Args:
            heights_m: Heights of the soil now (nx, ny) [m], x first.
            start_heights_m: The same at the start of the episode.
            soil_rgb: Colour of undisturbed soil (3,).
            ground_rgb: Colour of the bare ground (3,).
            patches: What to mark.
        """
        layers = (
            _fade(heights_m, *_BARE_M),
            _fade(start_heights_m - heights_m, *_CUT_M),
            np.clip(1.0 - _HOLLOW * (_blurred(heights_m, _HOLLOW_CELLS) - heights_m), *_HOLLOW_RANGE),
        )
        covered, cut, hollow = (_texels(layer) for layer in layers)
        soil = soil_rgb * (1.0 + cut * (_CUT_SHADE - 1.0)) * hollow
        colour = np.asarray((ground_rgb + covered * (soil - ground_rgb)) * self._grain, np.float32)
        for patch in patches:
            colour = self._marked(colour, patch)
        return np.clip(colour, 0.0, 1.0)

    def _marked(self, colour: NDArray[np.float32], patch: Patch) -> NDArray[np.float32]:
        """Tint a patch, and draw its rim; both edges of the rim are one texel soft."""
        inside_m = _depth_inside(self._places_w, patch.corners_w)
        within = np.clip(inside_m / _TEXEL_M + 0.5, 0.0, 1.0)
        share = within * np.where(inside_m < _RIM_M, _RIM_SHARE, _MARK_SHARE)
        shown = share[..., None].astype(np.float32)
        return np.asarray(colour + shown * (np.array(patch.rgb, np.float32) - colour))


def _texels(cells: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return values of cells (nx, ny), x first, at the texels (TEXELS, TEXELS, 1), y first."""
    return resampled(cells.T, (TEXELS, TEXELS)).astype(np.float32)[..., None]


def _depth_inside(points_w: NDArray[np.float64], corners_w: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far points (..., 2) lie inside a convex polygon (n, 2), counter-clockwise [m]; below 0 outside."""
    along = np.roll(corners_w, -1, axis=0) - corners_w
    inward = np.stack([-along[:, 1], along[:, 0]], axis=-1) / np.linalg.norm(along, axis=1, keepdims=True)
    return np.asarray(np.min([(points_w - c) @ n for c, n in zip(corners_w, inward, strict=True)], axis=0))


def _fade(values: NDArray[np.float64], low: float, high: float) -> NDArray[np.float64]:
    """Rise smoothly from 0 at the lower to 1 at the upper value."""
    t = np.clip((values - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def _blurred(heights_m: NDArray[np.float64], reach: int) -> NDArray[np.float64]:
    """Return the mean of every cell's neighbourhood of (2 reach + 1) squared cells."""
    width = 2 * reach + 1
    sums = np.pad(np.pad(heights_m, reach, mode="edge").cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    return np.asarray(
        (sums[width:, width:] - sums[:-width, width:] - sums[width:, :-width] + sums[:-width, :-width]) / width**2
    )


def _noise(rng: np.random.Generator, size: int, *, coarse_px: float) -> NDArray[np.float32]:
    """Draw tileable noise (size, size) of unit deviation, its grains about so many pixels wide."""
    white = rng.standard_normal((size, size))
    frequency = np.hypot(*np.meshgrid(*[np.fft.fftfreq(size)] * 2))
    shaped = np.fft.ifft2(np.fft.fft2(white) / (1.0 + (coarse_px * 4.0 * frequency) ** 2) ** 0.6).real
    return np.asarray(shaped / shaped.std(), np.float32)
