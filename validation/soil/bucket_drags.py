"""The bucket dragged in every direction: edge first, shell first, sideways, at a skim and deep."""

import math

import numpy as np

from bench.soil import BUCKET, rotation_at
from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil import Soil, Tool
from validation import Array
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.results import Check, Plot, Result, Series, Table

EXTENT_M, FLOOR_M = (5.0, 5.0), 0.6
SPEED_M_S = 0.5
DIGGING_RAD, CARRYING_RAD = -0.75 * math.pi, -math.pi
"""Pitch with the bottom plate level, and with the opening level on top."""

RAKED_RAD = math.radians(30.0) - math.atan2(0.39, -0.39)
"""Pitch with the bottom plate at a rake of 30 degrees."""

SHELL_FIRST_N = {0.05: (60.0, 200.0), 0.3: (2000.0, 8000.0)}
"""Depth [m]: wedges before an upright wall as wide as the bucket, from Rankine's to a rough one of 39 degrees."""

WAYS = {"edge first": (-1.0, 0.0), "shell first": (1.0, 0.0), "to the left": (0.0, 1.0), "to the right": (0.0, -1.0)}
AZIMUTHS_RAD = (0.0, 0.5, 1.7, 2.6)


def drag(
    pitch_rad: float, depth_m: float, way: tuple[float, float], travel_m: float, azimuth_rad: float, soil: Soil
) -> Array:
    """Drag the bucket level through fresh, level ground; return (n, 4): travel, draught, lift [N] and load [kg].

    The depth is that of its lowest inner point, the way is level in the bucket's own frame.
    """
    soil.reset(np.full(soil.heights_m.shape, soil.floor_depth_m))
    turn = about_z(azimuth_rad)
    rotation = turn @ rotation_at(pitch_rad)
    ahead = turn @ np.array([*way, 0.0])
    middle, lowest = rotation @ BUCKET.centroid_t, float((BUCKET.corners_t @ rotation.T)[:, 2].min())
    start = -0.5 * travel_m * ahead - np.array([middle[0], middle[1], depth_m + lowest])
    rows = []
    for k in range(round(travel_m / SPEED_M_S / TICK_S) + 1):
        travel = k * SPEED_M_S * TICK_S
        place = start + travel * ahead
        reaction = soil.step(
            TICK_S,
            Tool(
                geometry=BUCKET,
                position_w=place,
                rotation_w=rotation,
                linear_velocity_w=SPEED_M_S * ahead,
                angular_velocity_w=np.zeros(3),
            ),
        )
        rows.append((travel, -reaction.force_w_n @ ahead, reaction.force_w_n[2], reaction.payload_mass_kg))
    return np.array(rows)


def about_z(azimuth_rad: float) -> Array:
    """Return the rotation (3, 3) about the vertical."""
    c, s = math.cos(azimuth_rad), math.sin(azimuth_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@experiment(
    name="bucket_drags",
    title="The bucket dragged every way",
    source="Passive wedges: Rankine, Reece 1965 (formulas: they bracket, and do not count as measurements)",
    measures="The bucket is dragged level through fresh ground, 5 cm and 0.3 m deep, edge first, shell first and to "
    "both sides, in azimuths off the grid's axes; and edge first at a rake of 30° while it fills.",
    gate="shell first between the wedges before an upright wall; alike to both sides and in every azimuth; sideways as "
    "the square of the depth; a draught that grows with the load, without a jump",
)
def run(conditions: Conditions) -> Result:
    """Drag the bucket in every direction."""
    soil = Soil(conditions.preset, EXTENT_M, 0.05, conditions.fidelity, floor_depth_m=FLOOR_M)
    azimuths = AZIMUTHS_RAD[1:2] if conditions.quick else AZIMUTHS_RAD
    checks, rows = [], []
    for azimuth in track(azimuths, "azimuths"):
        first = {
            (way, depth): float(drag(CARRYING_RAD, depth, ahead, 0.0, azimuth, soil)[0, 1])
            for way, ahead in WAYS.items()
            for depth in SHELL_FIRST_N
        }
        rows += [(math.degrees(azimuth), way, depth, force) for (way, depth), force in first.items()]
        checks += _level_checks(first, f"azimuth {math.degrees(azimuth):.0f}°")
    filling = drag(RAKED_RAD, 0.2, WAYS["edge first"], 1.6, azimuths[0], soil)
    checks += _filling_checks(filling)
    table = Table(("azimuth [°]", "way", "depth [m]", "draught in fresh ground [N]"), tuple(rows))
    return Result(checks=tuple(checks), tables=(table,), plots=(_plot(filling),))


def _level_checks(first: dict[tuple[str, float], float], where: str) -> list[Check]:
    checks = [
        Check(f"{way}, {depth} m, {where}", first[way, depth], "N", low=low, high=high)
        for way in ("edge first", "shell first")
        for depth, (low, high) in SHELL_FIRST_N.items()
    ]
    left, right = (np.array([first[way, depth] for depth in SHELL_FIRST_N]) for way in ("to the left", "to the right"))
    checks.append(Check(f"left over right, {where}", float((left / right).max()), low=0.98, high=1.02))
    checks.append(Check(f"least sideways draught, {where}", float(min(left.min(), right.min())), "N", low=20.0))
    return checks


def _filling_checks(filling: Array) -> list[Check]:
    """Return how the draught grows with the load: the least slope of the smoothed curve, and its steepest rise."""
    smooth = np.convolve(filling[:, 1], np.full(15, 1.0 / 15.0), "valid")
    return [
        Check("draught with a load over that without", float(smooth[-1] / smooth[0]), low=1.5, high=6.0),
        Check(
            "greatest fall on the way, share",
            float((np.maximum.accumulate(smooth) - smooth).max() / smooth[-1]),
            high=0.1,
        ),
        Check("greatest rise within 0.15 m, share", float((smooth[15:] - smooth[:-15]).max() / smooth[-1]), high=0.35),
    ]


def _plot(filling: Array) -> Plot:
    curves = (
        Series("draught [N]", filling[:, 0], filling[:, 1], style="line"),
        Series("weight of the load [N]", filling[:, 0], 9.81 * filling[:, 3], style="dashed"),
    )
    return Plot("bucket_drag", "Dragged 0.2 m deep at a rake of 30°", "travel [m]", "force [N]", curves)
