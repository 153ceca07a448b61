"""Cohesive soil: a cut stands until the weight of a wedge behind it overcomes the cohesion on the plane below it.

A plane rises from the foot of a cut at an angle t into the soil. Above it lies a wedge of area A (per width). It slides
if its weight pulls harder than friction and cohesion hold on the length B / cos t:
A (tan t - tan phi) cos^2 t > B c / gamma (Culmann 1866; recalled). Behind a straight face at the angle i this gives his
critical height 4 c / gamma sin i cos phi / (1 - cos(i - phi)). Planes are tried in 16 directions from the foot, through
the true surface; what lies on top of the soil weighs along. What is above the plane comes loose, and has no cohesion
from then on.
"""

import math

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.layer import Ground, Layer, Window, mark_around

_DIRECTIONS = 16
"""Directions of the planes around a foot (tuned): a face lies at most 11 degrees aside, which is 2 % of its way."""


@kernel
def _is_foot(heights: Array, ground: Ground, i: int, j: int) -> bool:
    """Tell whether the soil rises from a column to a neighbour more steeply than loose soil could."""
    nx, ny = heights.shape
    for a in range(max(0, i - 1), min(nx, i + 2)):
        for b in range(max(0, j - 1), min(ny, j + 2)):
            way = math.sqrt(((a - i) * ground.dx) ** 2 + ((b - j) * ground.dy) ** 2)
            if heights[a, b] - heights[i, j] > ground.slope_tan * way + 1e-6:
                return True
    return False


@kernel
def _on_ray(ground: Ground, i: int, j: int, way: float, cos: float, sin: float) -> tuple[int, int]:
    """Return the column at a distance [m] from the middle of another one."""
    return math.floor(i + way * cos / ground.dx + 0.5), math.floor(j + way * sin / ground.dy + 0.5)


@kernel
def weakest_plane(
    heights: Array, firm: Array, ground: Ground, i: int, j: int, cos: float, sin: float, top: float
) -> tuple[float, int]:
    """Return the slope (tangent) and the number of steps of the plane along a direction that holds least.

    The plane starts at the edge of the foot (i, j) and ends in the surface after some steps of a cell; no steps if all
    planes hold. Nothing within reach is higher than `top` [m].
    """
    nx, ny = heights.shape
    foot, step = heights[i, j], min(ground.dx, ground.dy)
    worst, slope, count = 1.0, 0.0, 0
    area, held = 0.0, 0.0
    for k in range(1, math.ceil((top - foot) / (ground.slope_tan * step)) + 2):
        way = (k - 0.5) * step  # from the edge of the foot to the middle of this column
        p, q = _on_ray(ground, i, j, k * step, cos, sin)
        if p < 0 or q < 0 or p >= nx or q >= ny:
            break
        rise = heights[p, q] - foot
        steepness = rise / way
        if k == 1 and steepness <= ground.slope_tan:
            break  # the foot of no face on this side
        cohesive = 0.5 * step if firm[p, q] - foot > ground.slope_tan * way else 0.0
        if steepness > ground.slope_tan:
            wedge = area + 0.5 * rise * step - 0.5 * rise * way
            pull = wedge * (steepness - ground.slope_tan) / (1.0 + steepness * steepness)
            hold = ground.cohesion_m * (held + cohesive)
            if pull > worst * hold:
                slope, count = steepness, k
                worst = pull / hold if hold > 0.0 else math.inf
        area += rise * step
        held += 2.0 * cohesive
    return slope, count


@kernel
def fail_cuts(layer: Layer, ground: Ground, window: Window) -> None:
    """Let the cuts around a window of changed columns fail that are too high; the bed changes in place."""
    heights, bed = layer.heights, layer.bed
    nx, ny = heights.shape
    if window.i1 == 0:
        return
    top = 0.0
    for i in range(nx):
        for j in range(ny):
            top = max(top, heights[i, j])
    # a wedge is smaller than relief times B, and (tan t - tan phi) cos^2 t at most (1 / cos phi - tan phi) / 2
    relief = 2.0 * ground.cohesion_m / (math.sqrt(1.0 + ground.slope_tan**2) - ground.slope_tan)
    step = min(ground.dx, ground.dy)
    reach = math.ceil(top / (ground.slope_tan * step)) + 1  # no plane through a changed column starts farther away
    for i in range(max(0, window.i0 - reach), min(nx, window.i1 + reach)):
        for j in range(max(0, window.j0 - reach), min(ny, window.j1 + reach)):
            if top - heights[i, j] <= relief or heights[i, j] >= layer.ceiling[i, j]:
                continue
            if not _is_foot(heights, ground, i, j):
                continue
            for direction in range(_DIRECTIONS):
                angle = 2.0 * math.pi * direction / _DIRECTIONS
                cos, sin = math.cos(angle), math.sin(angle)
                slope, count = weakest_plane(heights, layer.firm, ground, i, j, cos, sin, top)
                for k in range(1, count + 1):
                    p, q = _on_ray(ground, i, j, k * step, cos, sin)
                    plane = heights[i, j] + (k - 0.5) * step * slope
                    if plane < bed[p, q] and heights[p, q] <= layer.ceiling[p, q]:
                        bed[p, q] = plane
                        mark_around(layer.active, p, q)
