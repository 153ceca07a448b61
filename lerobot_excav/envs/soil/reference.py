"""Slow, obvious versions of the compiled kernels, written from their definitions.

Tests hold each kernel against its twin here; nothing else uses this module.
"""

import math

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.soil.parameters import GRAVITY_M_S2
from lerobot_excav.envs.soil.relaxation import FLOW_FRACTION, REST_TAN
from lerobot_excav.envs.soil.tool import ToolGeometry

Array = NDArray[np.float64]


def sweep(
    heights: Array,
    ceiling: Array,
    cell_m: tuple[float, float],
    slope_tan: float,
    border_height: float,
) -> tuple[Array, float]:
    """Return the heights after one avalanche sweep of all columns, and the height that ran over the border."""
    nx, ny = heights.shape
    result, over_border = heights.copy(), 0.0
    padded = np.pad(heights, 1, constant_values=border_height)
    limit = np.pad(ceiling, 1, constant_values=math.inf)
    for a, b in [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]:
        distance = math.hypot(a * cell_m[0], b * cell_m[1])
        other = padded[1 + a : 1 + a + nx, 1 + b : 1 + b + ny]
        with np.errstate(invalid="ignore"):  # a closed border is as high as its ceiling: infinite
            room = limit[1 + a : 1 + a + nx, 1 + b : 1 + b + ny] - other
        excess = np.minimum(heights - other - slope_tan * distance, room)
        flows = (excess > REST_TAN * distance) & (heights <= ceiling)
        moved = np.where(flows, FLOW_FRACTION * excess, 0.0)
        result -= moved
        arrived = np.zeros((nx + 2, ny + 2))
        arrived[1 + a : 1 + a + nx, 1 + b : 1 + b + ny] = moved
        result += arrived[1:-1, 1:-1]
        over_border += float(arrived.sum() - arrived[1:-1, 1:-1].sum())
    return result, over_border


def inside(planes: Array, points_t: Array) -> NDArray[np.bool_]:
    """Tell which of (n, 3) tool points are inside of all half-spaces."""
    return np.asarray((points_t @ planes[:, :3].T <= planes[:, 3]).all(axis=1))


def column_interval(
    planes: Array, position: Array, rotation: Array, xy: Array, z: Array
) -> tuple[float, float] | None:
    """Return the lowest and highest of (n,) heights at which a vertical line is inside, or None."""
    points = np.column_stack([np.full_like(z, xy[0]), np.full_like(z, xy[1]), z])
    hit = inside(planes, (points - position) @ rotation)
    return (float(z[hit].min()), float(z[hit].max())) if hit.any() else None


def crossed_face(planes: Array, before: Array, now: Array) -> int:
    """Return the half-space that a path from outside entered last, or -1 if it started inside of all."""
    start, end = planes[:, :3] @ before - planes[:, 3], planes[:, :3] @ now - planes[:, 3]
    outside = np.flatnonzero(start > 0)
    if len(outside) == 0:
        return -1
    return int(outside[np.argmax(start[outside] / (start[outside] - end[outside]))])


def retained_volume(
    geometry: ToolGeometry, slope_tan: float, pitch: float, support: float, spacing_m: float = 0.002
) -> float:
    """Return the volume [m3] of all points on a lattice that are retained, by the rules of `capacity`."""
    cos, sin = math.cos(pitch), math.sin(pitch)
    profile = geometry.profile_t @ np.array([[cos, sin], [-sin, cos]])
    edge, lip = profile[0], profile[-1]
    lower, upper = (edge, lip) if edge[1] <= lip[1] else (lip, edge)
    start = lower + support * (upper - lower)
    half = 0.5 * geometry.inner_width_m
    centres = np.arange(-half + spacing_m / 2, half, spacing_m)
    total = 0.0
    for u in np.arange(profile[:, 0].min() + spacing_m / 2, profile[:, 0].max(), spacing_m):
        crossings = _vertical_crossings(profile, u)
        (floor, floor_is_opening), (roof, roof_is_opening) = crossings[0], crossings[-1]
        closed = support > 0 and min(lower[0], start[0]) <= u <= max(lower[0], start[0])
        if floor_is_opening and not closed:
            continue
        surface = min(start[1] + slope_tan * abs(u - start[0]), upper[1] + slope_tan * abs(u - upper[0]))
        top = np.full_like(centres, roof if closed else min(surface, roof))
        if roof_is_opening and not closed:
            top = np.minimum(surface, roof + slope_tan * (half - np.abs(centres)))
        total += float(np.maximum(0.0, top - floor).sum())
    return total * spacing_m**2


def _vertical_crossings(profile: Array, u: float) -> list[tuple[float, bool]]:
    """Return heights at which a vertical line meets the closed profile, low to high, and if that is the opening."""
    found = []
    for k in range(len(profile)):
        (u0, v0), (u1, v1) = profile[k], profile[(k + 1) % len(profile)]
        if (u0 - u) * (u1 - u) < 0:
            found.append((v0 + (v1 - v0) * (u - u0) / (u1 - u0), k == len(profile) - 1))
    return sorted(found)


def wedge_area(depths: Array, spacing_m: float, failure: float) -> float:
    """Return the area between a failure plane and depths of the edge below the surface sampled along it."""
    reach = np.arange(len(depths)) * spacing_m
    thickness = depths - reach * math.tan(failure)
    ends = np.flatnonzero(thickness <= 0)
    if len(ends):
        thickness = thickness[: ends[0]]
    return float(np.sum(thickness) * spacing_m)


def free_fall(position: Array, velocity: Array, time_s: float) -> Array:
    """Return where a parcel is after some time without contact."""
    return np.asarray(position + velocity * time_s - np.array([0.0, 0.0, 0.5 * GRAVITY_M_S2 * time_s**2]))
