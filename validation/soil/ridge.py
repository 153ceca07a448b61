"""Ridges of dry sand in directions that are not those of the grid, a little too steep or a little too flat to move."""

import math

import numpy as np

from lerobot_excav.envs.soil import PRESETS
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.results import Check, Result, Table
from validation.soil.slopes import across_m, flank_deg, flowing

HEIGHT_M = 0.6
EXTENT_M = 4.0
EXCESS_DEG = 2.0
SHORTFALL_DEG = 0.5
TOLERANCE_DEG = 0.5
_STEP_S = 0.02
_LIMIT_S = 6.0

# azimuth [deg], cell [m]: every azimuth on cells of at least two sizes
CASES = (
    *((0.0, 0.05), (11.0, 0.1), (22.5, 0.05), (22.5, 0.1), (22.5, 0.04), (33.0, 0.04), (40.0, 0.05), (45.0, 0.1)),
    *((57.0, 0.05), (67.5, 0.04), (80.0, 0.1), (112.5, 0.05), (205.0, 0.04)),
)
QUICK_CASES = (22.5, 0.1), (40.0, 0.05)


@experiment(
    name="ridge",
    title="Ridge in any direction",
    source="A slope of dry sand rests at its friction angle, whatever its azimuth",
    measures="The flanks of a long ridge, 2° steeper and 0.5° flatter than repose, that face azimuths between those of "
    "the grid, on cells of three sizes; straight lines through the flanks at three places.",
    gate="2° too steep: at rest at repose ± 0.5°; 0.5° too flat: nothing moves",
)
def run(conditions: Conditions) -> Result:
    """Let ridges go that are a little steeper and a little flatter than repose."""
    sand = PRESETS["sand"]
    repose_deg = math.degrees(sand.friction_angle_rad)
    checks, rows = [], []
    for azimuth_deg, cell_m in track(QUICK_CASES if conditions.quick else CASES, "ridges"):
        count = round(EXTENT_M / cell_m)
        across = np.abs(across_m((count, count), cell_m, azimuth_deg))
        steep, flat = (
            np.maximum(0.0, HEIGHT_M - math.tan(math.radians(repose_deg + change)) * across)
            for change in (EXCESS_DEG, -SHORTFALL_DEG)
        )
        *_, field = flowing(steep, cell_m, sand.strength, _STEP_S, _LIMIT_S)
        ways = np.asarray(np.linspace(0.25, 0.75, 30) * HEIGHT_M / sand.slope_tan, dtype=np.float64)
        slopes = [
            flank_deg(field, azimuth_deg + turn, ways, offset) for turn in (0.0, 180.0) for offset in (-0.2, 0.17)
        ]
        *_, still = flowing(flat, cell_m, sand.strength, _STEP_S, _LIMIT_S)
        moved_m = float(np.abs(still.heights - flat).max())
        label = f"{azimuth_deg}°, cells of {cell_m} m"
        low, high = repose_deg - TOLERANCE_DEG, repose_deg + TOLERANCE_DEG
        checks += [
            Check(f"gentlest flank, {label}", min(slopes), "°", low=low, high=high),
            Check(f"steepest flank, {label}", max(slopes), "°", low=low, high=high),
            Check(f"motion of a flatter ridge, {label}", moved_m, "m", high=0.0),
        ]
        rows.append((azimuth_deg, cell_m, min(slopes), max(slopes), moved_m))
    header = ("azimuth [°]", "cell [m]", "gentlest flank [°]", "steepest flank [°]", "motion of the flatter one [m]")
    return Result(checks=tuple(checks), tables=(Table(header, tuple(rows)),))
