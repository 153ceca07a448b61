"""Colours and light of a scene: what may differ between pictures without changing the task."""

from dataclasses import dataclass

import numpy as np

Rgb = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Appearance:
    """Colours and light of the worksite.

    Attributes:
        soil_rgb: Soil, each channel in [0, 1]; so are the other colours.
        machine_rgb: Painted parts of the machine.
        ground_rgb: Ground around the dig area.
        box_rgb: Target box.
        light_dir_w: Direction in which the sunlight travels (3,), world frame; need not be of unit length.
        light_intensity: Diffuse strength of the sun, 1 is full.
    """

    soil_rgb: Rgb = (0.76, 0.60, 0.38)
    machine_rgb: Rgb = (0.93, 0.64, 0.06)
    ground_rgb: Rgb = (0.46, 0.49, 0.42)
    box_rgb: Rgb = (0.20, 0.38, 0.58)
    light_dir_w: tuple[float, float, float] = (0.55, 0.45, -0.70)
    light_intensity: float = 0.7


def draw_appearance(rng: np.random.Generator) -> Appearance:
    """Draw the look of a scene around the defaults: a little in colour, more in light."""
    default = Appearance()
    # The sun stays on the camera's side of the zenith, at 35 to 65 degrees, so that slopes always show shading.
    azimuth = rng.uniform(np.radians(0.0), np.radians(100.0))
    elevation = rng.uniform(np.radians(35.0), np.radians(65.0))
    along = np.cos(elevation)
    light_dir_w = float(along * np.cos(azimuth)), float(along * np.sin(azimuth)), float(-np.sin(elevation))
    return Appearance(
        soil_rgb=_near(rng, default.soil_rgb, 0.08),
        machine_rgb=_near(rng, default.machine_rgb, 0.05),
        ground_rgb=_near(rng, default.ground_rgb, 0.08),
        box_rgb=_near(rng, default.box_rgb, 0.08),
        light_dir_w=light_dir_w,
        light_intensity=float(rng.uniform(0.55, 0.8)),
    )


def _near(rng: np.random.Generator, rgb: Rgb, spread: float) -> Rgb:
    """Shift brightness and tint of a colour by up to `spread`."""
    shifted = np.array(rgb) + rng.uniform(-spread, spread) + rng.uniform(-0.3, 0.3, 3) * spread
    red, green, blue = (float(c) for c in np.clip(shifted, 0.0, 1.0))
    return red, green, blue
