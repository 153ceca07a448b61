"""A still bucket that is filled from above until soil runs off on all sides."""

import math

import numpy as np

from bench.soil import BUCKET, tool_at
from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil import PRESETS, Soil
from validation.soil.cover import pairwise_cover
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.results import Check, Result, Table

POURED_KG = 900.0
SETTLING_S = 4.0
OPENING_Z_W = 2.0
TOLERANCE = 0.1
SHEET_M = 0.1
"""Distance of the parcels that are let go at once: they must not overlap."""

AXES = {
    "preset": ("sand", "gravel", "dirt", "wet_sand"),
    "fidelity": ("standard", "fast"),
    "duration_s": (6.0, 3.0),
    "fall_m": (0.95, 0.6, 1.6),
    "speed_m_s": (0.0, 2.0),
}
"""Cases: soil, numerical effort, how long and from how high the soil is poured, and how fast it is thrown down."""


def heap_kg(preset: str) -> float:
    """Return what a level bucket holds if the soil over its rim lies at repose [kg].

    Soil below the rim by the shoelace formula; over it a hip roof, integrated numerically: at each point the height is
    that of the flank of the nearest side.
    """
    soil = PRESETS[preset]
    x, z = BUCKET.profile_t.T
    area = 0.5 * abs(float(x @ np.roll(z, -1) - z @ np.roll(x, -1)))
    length, width = float(np.hypot(x[0] - x[-1], z[0] - z[-1])), BUCKET.inner_width_m
    along, across = ((np.arange(400) + 0.5) / 400 * side for side in (length, width))
    to_rim = np.minimum(np.minimum(along, length - along)[:, None], np.minimum(across, width - across)[None, :])
    roof = float(to_rim.mean()) * length * width * math.tan(soil.friction_angle_rad)
    return (area * width + roof) * soil.density_kg_m3 / soil.swell


def poured_kg(seed: int, *, preset: str, fidelity: str, duration_s: float, fall_m: float, speed_m_s: float) -> float:
    """Pour soil over the whole opening of a level bucket in the air; return what stays in it [kg]."""
    soil = Soil(preset, fidelity=fidelity, seed=seed)
    tool = tool_at(np.array([0.0, 0.0, OPENING_Z_W]), -math.pi, np.zeros(3), 0.0)
    soil.step(TICK_S, tool)
    rim_t = np.insert(BUCKET.profile_t[[0, -1]].mean(axis=0), 1, 0.0)
    middle_w = tool.position_w + tool.rotation_w @ rim_t
    places = np.stack(np.meshgrid(np.arange(-3.5, 4.0), np.arange(-2.5, 3.0), indexing="ij"), axis=-1).reshape(-1, 2)
    rng, ticks = np.random.default_rng(seed), round(duration_s / TICK_S)
    let_go = np.diff(np.linspace(0.0, POURED_KG / soil.parcel_mass_kg, ticks + 1).astype(int), prepend=0)
    for count in (*let_go, *[0] * round(SETTLING_S / TICK_S)):
        if count:
            chosen = places[rng.choice(len(places), count, replace=False)] * SHEET_M
            points = middle_w + np.column_stack([chosen, np.full(count, fall_m)])
            soil.add_parcels(points, np.tile([0.0, 0.0, -speed_m_s], (count, 1)))
        soil.step(TICK_S, tool)
    return soil.payload_mass_kg


@experiment(
    name="filled_bucket",
    title="Bucket filled from above",
    source="Geometry: what lies over the rim lies at repose (SAE J296 with the soil's own slope in place of 1:1)",
    measures="900 kg are poured over the opening of a still, level bucket, slowly and quickly, from several heights, "
    "let go and thrown, for every soil; what stays is divided by what the bucket holds with a heap at repose.",
    gate=f"within {TOLERANCE:.0%} of the heap at repose",
)
def run(conditions: Conditions) -> Result:
    """Fill the bucket in a pairwise cover of the cases."""
    cases = pairwise_cover(AXES)[:2] if conditions.quick else pairwise_cover(AXES)
    checks, rows = [], []
    for case in track(cases, "fillings"):
        kept, expected = poured_kg(conditions.seeds[0], **case), heap_kg(case["preset"])
        label = ", ".join(str(value) for value in case.values())
        checks.append(Check(label, kept / expected, low=1.0 - TOLERANCE, high=1.0 + TOLERANCE))
        rows.append((*case.values(), kept, expected))
    header = ("soil", "fidelity", "poured in [s]", "from [m]", "thrown at [m/s]", "kept [kg]", "heap at repose [kg]")
    return Result(checks=tuple(checks), tables=(Table(header, tuple(rows)),))
