"""T3: soil poured on a plane makes a cone at its angle of repose."""

import math
from itertools import chain
from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil import PRESETS, Soil
from validation import Array
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.resting import steps_until_rest
from validation.soil.results import Check, Plot, Result, Series, Table

MASS_KG = 485.0
"""A bucket of sand."""

AZIMUTHS_RAD = np.radians(15.0 + 45.0 * np.arange(8))
"""None of them is one of the grid's own directions."""
RADII = (0.25, 0.75)
"""Part of the flank that is measured, as shares of the radius of the ideal cone."""

CLEARANCE_M = 0.15
"""Height of the funnel's mouth above the top of the ideal cone."""

NOZZLE_SPEED_M_S = 0.5
NOZZLE_PARCELS = 3
LAYER_S = 0.1
"""The funnel stands still; every 0.1 s three parcels side by side leave it at 0.5 m/s: 28 kg/s of sand."""

_TIME_LIMIT_S = 60.0


class Heap(NamedTuple):
    """A heap at rest."""

    preset: str
    repose_deg: float  # friction angle of the soil
    angles_deg: Array  # (8,) slope of the flank by azimuth
    height_m: float
    cone_height_m: float  # of the ideal cone of the same mass and angle
    mass_error: float  # mass on the ground over the mass poured, minus 1
    profile_m: Array  # (2, n) radius and mean height over the azimuths


def pour_heap(preset: str, *, fidelity: str, seed: int, dt_s: float) -> Heap:
    """Pour whole parcels from a funnel that stands still, and wait until everything rests; the seed turns them."""
    soil = Soil(preset, (4.0, 4.0), 0.05, fidelity, seed)
    count = round(MASS_KG / soil.parcel_mass_kg)
    poured, parameters = count * soil.parcel_mass_kg, PRESETS[preset]
    volume = poured / parameters.density_kg_m3
    height = (3.0 * volume * parameters.slope_tan**2 / math.pi) ** (1.0 / 3.0)
    _pour(soil, count, height + CLEARANCE_M, np.random.default_rng(seed), dt_s)
    radius = height / parameters.slope_tan
    return Heap(
        preset=preset,
        repose_deg=math.degrees(parameters.friction_angle_rad),
        angles_deg=np.array([_flank_deg(soil, azimuth, radius) for azimuth in AZIMUTHS_RAD]),
        height_m=float(soil.heights_m.max()),
        cone_height_m=height,
        mass_error=soil.ledger_kg()["grid"] / poured - 1.0,
        profile_m=_profile(soil, 1.5 * radius),
    )


def _pour(soil: Soil, count: int, mouth_m: float, rng: np.random.Generator, dt_s: float) -> None:
    """Pour parcels and let them come to rest."""
    every, left = round(LAYER_S / dt_s), count
    for number in chain([0], steps_until_rest(soil, dt_s=dt_s, limit_s=_TIME_LIMIT_S)):
        if left > 0 and number % every == 0:
            points = _layer(soil.parcel_radius_m, mouth_m, rng)[:left]
            soil.add_parcels(points, np.tile([0.0, 0.0, -NOZZLE_SPEED_M_S], (len(points), 1)))
            left -= len(points)


def _layer(radius_m: float, mouth_m: float, rng: np.random.Generator) -> Array:
    """Return (3, 3) parcels side by side in the mouth of the funnel [m], turned at random."""
    turned = rng.uniform(0.0, 2.0 * math.pi) + np.arange(NOZZLE_PARCELS) * 2.0 * math.pi / NOZZLE_PARCELS
    points = np.full((NOZZLE_PARCELS, 3), mouth_m)
    # A tenth more than the radius of the circle on which three spheres touch.
    points[:, :2] = 1.1 * 2.0 / math.sqrt(3.0) * radius_m * np.stack([np.cos(turned), np.sin(turned)], axis=1)
    return points


def _flank_deg(soil: Soil, azimuth_rad: float, radius_m: float) -> float:
    """Return the slope [deg] of a straight line through all columns of the flank in an eighth of the circle."""
    x, y = np.meshgrid(soil.x_w, soil.y_w, indexing="ij")
    radii = np.hypot(x, y)
    turned = np.arctan2(y, x) - azimuth_rad
    aside = np.abs((turned + math.pi) % (2.0 * math.pi) - math.pi)
    flank = (aside <= math.pi / 8.0) & (radii >= RADII[0] * radius_m) & (radii <= RADII[1] * radius_m)
    return -math.degrees(math.atan(np.polyfit(radii[flank], soil.heights_m[flank], 1)[0]))


def _profile(soil: Soil, reach_m: float) -> Array:
    radii = np.asarray(np.linspace(0.0, reach_m, 60), dtype=np.float64)
    directions = np.stack([np.cos(AZIMUTHS_RAD), np.sin(AZIMUTHS_RAD)], axis=1)
    return np.stack([radii, soil.height_at(directions[:, None] * radii[:, None]).mean(axis=0)])


SLOPE_OF_PARCELS = (
    "Loose parcels come to rest on their own slope, which is that of rolling spheres. The avalanches of the height "
    "field only take what is steeper than the preset's angle; they cannot steepen a flank."
)


@experiment(
    code="T3",
    title="Heap and repose",
    source="The cone of a volume V: h = (3 V tan² θ / π)^(1/3); repose angle of the preset, as AGX Terrain takes it",
    measures="485 kg leave a funnel whose mouth stands still 0.15 m above the top of the ideal cone. Straight lines "
    "through the flank between a quarter and three quarters of the cone's radius in 8 sectors, each the mean of the "
    "pours with different seeds; every soil.",
    gate="the preset's angle ± 2° in 8 azimuths; mass error below 1e-9",
    reasons=dict.fromkeys(("gentlest flank", "steepest flank"), SLOPE_OF_PARCELS),
)
def run(conditions: Conditions) -> Result:
    """Pour a heap of every soil; of sand also with half the time step."""
    seeds = conditions.repeats
    cases = [(preset, TICK_S) for preset in ((conditions.preset,) if conditions.quick else PRESETS)]
    if not conditions.quick:
        cases.append(("sand", 0.5 * TICK_S))
    checks: list[Check] = []
    rows: list[tuple[float | str, ...]] = []
    profiles = []
    for preset, dt_s in track(cases, "T3 heaps"):
        heaps = [pour_heap(preset, fidelity=conditions.fidelity, seed=s, dt_s=dt_s) for s in seeds]
        label = preset if dt_s == TICK_S else f"{preset}, {dt_s} s per step"
        checks += _checks(label, heaps)
        rows += [
            (label, float(s), h.repose_deg, *map(float, h.angles_deg), h.height_m, h.cone_height_m)
            for s, h in zip(seeds, heaps, strict=True)
        ]
        if dt_s == TICK_S:
            profiles.append(heaps[0])
    header = (
        "soil",
        "seed",
        "repose [°]",
        *(f"{math.degrees(a):.0f}°" for a in AZIMUTHS_RAD),
        "height [m]",
        "ideal cone [m]",
    )
    return Result(
        checks=tuple(checks),
        tables=(Table(header, tuple(rows)),),
        plots=(_plot(profiles),),
        remarks=("The table has every pour by itself: its flanks are lumpy by the size of a parcel.",),
    )


def _checks(label: str, heaps: list[Heap]) -> list[Check]:
    angles = np.mean([heap.angles_deg for heap in heaps], axis=0)
    low, high = heaps[0].repose_deg - 2.0, heaps[0].repose_deg + 2.0
    error = max(abs(heap.mass_error) for heap in heaps)
    return [
        Check(f"gentlest flank, {label}", float(angles.min()), "°", low=low, high=high),
        Check(f"steepest flank, {label}", float(angles.max()), "°", low=low, high=high),
        Check(f"mass error, {label}", error, high=1e-9),
    ]


def _plot(heaps: list[Heap]) -> Plot:
    curves = []
    for k, heap in enumerate(heaps):
        radii, heights = heap.profile_m
        cone = np.maximum(0.0, heap.cone_height_m - math.tan(math.radians(heap.repose_deg)) * radii)
        curves.append(Series(heap.preset, radii, heights, "line", color=k))
        curves.append(Series(f"cone at {heap.repose_deg:.0f}°", radii, cone, "dashed", color=k))
    title = "A heap of 485 kg, mean of 8 azimuths"
    return Plot("heap", title, "distance from the axis [m]", "height [m]", tuple(curves))
