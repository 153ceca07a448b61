"""Twin of the avalanches (`bed`, `momentum`, `flow`): one sub-step, column by column and face by face."""

import math

import numpy as np

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.envs.soil.layer import Ground, Layer
from lerobot_excav.envs.soil.momentum import (
    CREEP_M_S,
    HOLD_TAN,
    PATIENCE_S,
    REST_M_S,
    START_TAN,
    STEEPER_PER_S,
    THINNEST_M,
    friction,
)
from validation import Array

_WAYS = np.linspace(0.0, 1.0, 4001)
"""Points between two neighbours over which soil may come down."""


def steepest(heights: Array, cell_m: float) -> float:
    """Return the tangent of the slope at which every column is supported by its neighbours (`supported_height`)."""
    low, high = 0.0, float(np.ptp(heights)) / cell_m
    ground = Ground(0.0, 0.0, 1.0, cell_m, cell_m, math.inf)
    for i, j in np.ndindex(heights.shape):
        low_here, high_here = low, high
        own = float(heights[i, j])
        if own <= supported_height(heights, ground._replace(slope_tan=low), i, j, own) + 1e-12:
            continue
        for _ in range(30):
            middle = 0.5 * (low_here + high_here)
            held = own <= supported_height(heights, ground._replace(slope_tan=middle), i, j, own) + 1e-12
            low_here, high_here = (low_here, middle) if held else (middle, high_here)
        low = high_here
    return low


def supported_height(support: Array, ground: Ground, i: int, j: int, own: float) -> float:
    """Return how high a column can stand: the least height, over all points around it, of soil there and slope to it.

    The points are those of the straight lines between a neighbour along an axis and one on the diagonal.
    """
    nx, ny = support.shape

    def height(p: int, q: int) -> float:
        return float(support[p, q]) if 0 <= p < nx and 0 <= q < ny else ground.border_height

    best = own
    for di, dj in [(-1, 0), (1, 0), (0, -1), (0, 1)]:
        for turn in (-1, 1):
            near, far = height(i + di, j + dj), height(i + di + turn * abs(dj), j + dj + turn * abs(di))
            step, side = (ground.dx, ground.dy) if dj == 0 else (ground.dy, ground.dx)
            if own - near <= 0.5 * ground.slope_tan * step:
                continue  # no way down on this side
            if math.isfinite(near) and math.isfinite(far):
                line = (1.0 - _WAYS) * near + _WAYS * far + ground.slope_tan * np.hypot(step, _WAYS * side)
                best = min(best, float(line.min()))
            for one, way in ((near, step), (far, math.hypot(step, side))):
                best = min(best, one + ground.slope_tan * way)
    return best


def _columns(layer: Layer, axis: int, i: int, j: int) -> list[tuple[int, int] | None]:
    """Return the columns before and after a face; None outside of the field."""
    nx, ny = layer.heights.shape
    pair = [(i - 1 + axis, j - axis), (i, j)]
    return [(p, q) if 0 <= p < nx and 0 <= q < ny else None for p, q in pair]


def _depth(layer: Layer, column: tuple[int, int] | None) -> float:
    return 0.0 if column is None else float(layer.heights[column] - layer.bed[column])


def _slope(heights: Array, ground: Ground, axis: int, i: int, j: int) -> tuple[float, float, float]:
    if math.isinf(ground.border_height):
        padded = np.pad(heights, 1, mode="edge")
    else:
        padded = np.pad(heights, 1, constant_values=ground.border_height)
    steps = (ground.dx, ground.dy) if axis == 0 else (ground.dy, ground.dx)
    if axis == 1:
        padded, i, j = padded.T, j, i
    before, after = padded[i], padded[i + 1]  # rows on both sides of the face; its column is j + 1
    mean = 0.5 * (before + after)
    left, right = (mean[j + 1] - mean[j]) / steps[1], (mean[j + 2] - mean[j + 1]) / steps[1]
    aside = 0.5 * (left + right) if left * right > 1e-9 else max(left, right, key=abs)
    down = float((after[j + 1] - before[j + 1]) / steps[0])
    lower = min((before, after), key=lambda row: row[j + 1])
    turned = max(0.0, float(lower[j + 1] - min(lower[j], lower[j + 2])) / steps[1])
    return down, float(aside), math.hypot(down, min(turned, 4.0 * abs(down)))


def _face(layer: Layer, ground: Ground, axis: int, i: int, j: int, dt: float) -> float:
    """Return the speed across a face after a time."""
    before, after = _columns(layer, axis, i, j)
    there = [column for column in (before, after) if column is not None]
    if len(there) < 2 and math.isinf(ground.border_height):
        return 0.0
    if any(layer.heights[column] > layer.ceiling[column] for column in there):
        return 0.0
    depths = [_depth(layer, before), _depth(layer, after)]
    if max(depths) <= THINNEST_M:
        return 0.0
    down, aside, greatest = _slope(layer.heights, ground, axis, i, j)
    crept_s = min(float(layer.crept_s[column]) for column in there)
    still_rests = greatest < ground.slope_tan + STEEPER_PER_S * crept_s
    if abs(layer.speeds[axis, i, j]) < CREEP_M_S and crept_s > PATIENCE_S and still_rests:
        return 0.0
    u, v = _carried(layer, ground, axis, i, j, sum(depths) / 2.0, dt)
    was = math.hypot(u, v)
    u, v = u - dt * GRAVITY_M_S2 * down, v - dt * GRAVITY_M_S2 * aside
    left = math.hypot(u, v) - dt * GRAVITY_M_S2 * friction(ground.slope_tan, was, max(depths))
    starts = math.hypot(down, aside) > ground.slope_tan + START_TAN
    if greatest > ground.slope_tan + HOLD_TAN:
        left = max(left, CREEP_M_S)
    elif was == 0.0:
        left = max(left, REST_M_S) if starts or left >= REST_M_S else 0.0
    elif left < REST_M_S and not starts:
        left = 0.0
    if left <= 0.0:
        return 0.0
    speed = u * left / math.hypot(u, v)
    return speed if depths[0 if speed > 0.0 else 1] > THINNEST_M else 0.0


def _carried(layer: Layer, ground: Ground, axis: int, i: int, j: int, depth: float, dt: float) -> tuple[float, float]:
    speeds, flux = layer.speeds, layer.flux
    before, after = _columns(layer, axis, i, j)
    sides = [side for pair in ((before, after), (after, before)) for side in [pair[0] or pair[1]] if side is not None]
    di, dj = 1 - axis, axis
    drift = float(np.mean([speeds[1 - axis, p + k * dj, q + k * di] for p, q in sides for k in (0, 1)]))
    steps = (ground.dx, ground.dy) if axis == 0 else (ground.dy, ground.dx)
    inflows = []  # how fast the layer at the face is replaced, and by which speed
    for along, column in ((-1, before), (1, after)):
        if column is not None:
            other = (axis, i + along * di, j + along * dj)
            inflows.append((max(-along * (flux[other] + flux[axis, i, j]), 0.0) / steps[0], other))
    for across in (-1, 1):
        far = 0 if across < 0 else 1
        through = sum(flux[1 - axis, p + far * dj, q + far * di] for p, q in sides)
        inflows.append((max(-across * through, 0.0) / steps[1], (axis, i + across * dj, j + across * di)))
    own, total = float(speeds[axis, i, j]), sum(rate for rate, _ in inflows)
    if total <= 0.0:
        return own, drift
    change = sum(rate * (speeds[other] - own) for rate, other in inflows if rate > 0.0)
    return float(own + change * min(dt / (2.0 * depth), 1.0 / total)), drift


def next_speeds(layer: Layer, ground: Ground, dt: float) -> Array:
    """Return the speeds (2, nx + 1, ny + 1) [m/s] across all faces after a time [s]."""
    nx, ny = layer.heights.shape
    result = np.zeros_like(layer.speeds)
    for axis in range(2):
        for i in range(nx + 1 - axis):
            for j in range(ny + axis):
                result[axis, i, j] = _face(layer, ground, axis, i, j, dt)
    return result


def moved(layer: Layer, ground: Ground, speeds: Array, dt: float) -> tuple[Array, float]:
    """Return the heights after the layer has moved at some speeds for a time, and the height that left the field."""
    nx, ny = layer.heights.shape
    faces = [(axis, i, j) for axis in range(2) for i in range(nx + 1 - axis) for j in range(ny + axis)]
    demand, emptied = {}, np.zeros((nx, ny))
    for face in faces:
        before, after = _columns(layer, *face)
        giver = before if speeds[face] > 0.0 else after
        if speeds[face] != 0.0 and giver is not None:
            step = ground.dx if face[0] == 0 else ground.dy
            demand[face] = abs(speeds[face]) * _depth(layer, giver) * dt / step
            emptied[giver] += demand[face]
    result, over_border = layer.heights.copy(), 0.0
    for face, height in demand.items():
        before, after = _columns(layer, *face)
        giver, taker = (before, after) if speeds[face] > 0.0 else (after, before)
        assert giver is not None
        height *= min(1.0, _depth(layer, giver) / max(emptied[giver], 1e-300))
        if taker is not None:
            height = min(height, 0.25 * max(0.0, layer.ceiling[taker] - layer.heights[taker]))
            result[taker] += height
        else:
            over_border += height
        result[giver] -= height
    return result, over_border
