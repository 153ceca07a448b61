"""Soil that leaves the bucket: as falling parcels, or back to the ground before a buried edge."""

import math

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.cutting import push_aside
from lerobot_excav.envs.soil.height_field import Grid, HeightField, in_grid, surface_height
from lerobot_excav.envs.soil.motion import Pose
from lerobot_excav.envs.soil.parameters import SoilParameters
from lerobot_excav.envs.soil.parcels import Parcels
from lerobot_excav.envs.soil.tool import Tool, ToolGeometry

Array = NDArray[np.float64]

MAX_PARCELS = 1000
"""With this many parcels in the air, a spill adds one heavier parcel per step (bound on cost)."""

JITTER_M_S = 0.05
"""Standard deviation of the random velocity of a new parcel (guess)."""

NEGLIGIBLE_PARCELS = 0.5
"""Excess, in parcels, that stays in a bucket that still retains something: no trickle of crumbs (guess)."""

_SUPPORT_POINTS = 16
_SUPPORT_LINES = 3


def opening_ends(tool: Tool) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return (x_t, z_t) of the lower and of the upper edge of the opening [m]."""
    profile = tool.geometry.profile_t
    edge, lip = (float(profile[0, 0]), float(profile[0, 1])), (float(profile[-1, 0]), float(profile[-1, 1]))
    rise = (lip[0] - edge[0]) * tool.rotation_w[2, 0] + (lip[1] - edge[1]) * tool.rotation_w[2, 2]
    return (edge, lip) if rise >= 0.0 else (lip, edge)


@kernel
def buried_share(
    heights: Array,
    grid: Grid,
    position: Array,
    rotation: Array,
    ends: tuple[float, float, float, float],
    width: float,
) -> float:
    """Return the share of the opening, from its lower edge upwards, that soil in front of it closes.

    Args:
        heights: (nx, ny) heights [m].
        grid: First cell centre and cell sizes.
        position: (3,) tool origin; z above the rigid floor.
        rotation: (3, 3) of the tool.
        ends: x_t, z_t of the lower and of the upper edge of the opening.
        width: Inner width [m].
    """
    count = 0
    for line in range(_SUPPORT_LINES):
        y = ((line + 0.5) / _SUPPORT_LINES - 0.5) * width
        for k in range(_SUPPORT_POINTS):
            share = (k + 0.5) / _SUPPORT_POINTS
            x = ends[0] + share * (ends[2] - ends[0])
            z = ends[1] + share * (ends[3] - ends[1]) - grid[2]  # one cell in front of the opening
            p0 = position[0] + rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z
            p1 = position[1] + rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z
            p2 = position[2] + rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z
            if not in_grid(heights, grid, p0, p1) or surface_height(heights, grid, p0, p1) <= p2:
                break
            count += 1
    return count / (_SUPPORT_LINES * _SUPPORT_POINTS)


def overflow_volume(parameters: SoilParameters, payload_m3: float, retained_m3: float, dt_s: float) -> float:
    """Return the volume [m3] that leaves the bucket in a step.

    The excess decays with `spill_time_s`, and by at least one parcel per step so that it ends.
    """
    excess = payload_m3 - retained_m3
    parcel = parameters.parcel_mass_kg / parameters.density_kg_m3
    if excess <= 0.0 or (retained_m3 > 0.0 and excess < NEGLIGIBLE_PARCELS * parcel):
        return 0.0
    decayed = excess * -math.expm1(-dt_s / parameters.spill_time_s)
    return min(excess, max(decayed, parcel))


def return_to_ground(
    geometry: ToolGeometry, pose: Pose, field: HeightField, edge_t: tuple[float, float], volume: float
) -> float:
    """Put a volume on the columns in front of a buried edge; return the part [m3] that left the grid."""
    centre = geometry.centroid_t
    out = pose.rotation @ np.array([edge_t[0] - centre[0], 0.0, edge_t[1] - centre[2]])
    length = max(float(np.hypot(out[0], out[1])), 1e-12)
    direction = (float(out[0] / length), float(out[1] / length))
    count = max(1, round(geometry.inner_width_m / field.grid[3]))
    lost = 0.0
    for k in range(count):
        y = ((k + 0.5) / count - 0.5) * geometry.inner_width_m
        start = pose.position + pose.rotation @ np.array([edge_t[0], y, edge_t[1]])
        lost += push_aside(
            field.heights,
            field.active,
            field.grid,
            geometry.planes_t,
            *pose.arrays,
            (float(start[0]), float(start[1])),
            direction,
            volume / count,
        )
    field.wake()
    return lost


def _split(mass_kg: float, whole_kg: float, free: int) -> Array:
    """Split a mass into whole parcels and a remainder, or into equal heavier ones if too few are free."""
    wanted = math.ceil(mass_kg / whole_kg - 1e-9)
    count = max(1, min(wanted, free))
    if count < wanted:
        return np.full(count, mass_kg / count)
    masses = np.full(count, whole_kg)
    masses[-1] = mass_kg - whole_kg * (count - 1)
    return masses


def pour(tool: Tool, parcels: Parcels, mass_kg: float, whole_kg: float, dt_s: float, rng: Generator) -> None:
    """Let parcels be born along the spilling edge, over the whole opening as far as that faces down.

    They start with the velocity of the bucket there plus jitter, each at its own time within the step.
    """
    masses = _split(mass_kg, whole_kg, MAX_PARCELS - len(parcels))
    count = len(masses)
    lower, upper = opening_ends(tool)
    share = rng.uniform(0.0, 1.0, count) * max(0.0, float(tool.rotation_w[2, 2]))
    y = rng.uniform(-0.5, 0.5, count) * tool.geometry.inner_width_m
    arms_t = np.stack(
        [lower[0] + share * (upper[0] - lower[0]), y, lower[1] + share * (upper[1] - lower[1])], axis=1
    )
    arms = arms_t @ tool.rotation_w.T
    velocities = tool.linear_velocity_w + np.cross(tool.angular_velocity_w, arms)
    velocities = velocities + rng.normal(0.0, JITTER_M_S, (count, 3))
    fallen = rng.uniform(0.0, dt_s, (count, 1)) * velocities
    parcels.add(tool.position_w + arms + fallen, velocities, masses)
