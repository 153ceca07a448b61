"""The static bed: what is steeper than the repose angle comes loose.

Static soil is never steeper than the repose slope s: |grad b| <= s. Where a column is too high for its lower
neighbours, its upper part becomes mobile, down to the height that they support: the eikonal equation |grad b| = s,
solved upwind on the eight triangles of a column, a neighbour along an axis and one on the diagonal. A planar slope is
exact on them whatever its azimuth. Sweeps over the columns in alternating orders (fast sweeping, Zhao 2005; recalled)
carry the failure across any number of columns, so that its speed does not depend on the size of a cell. Firm soil with
cohesion holds; it fails in another way (`standing`).
"""

import math

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.layer import FLOWING, SEEN, Ground, Layer, Window, mark_around

FAILURE_TAN = 3e-3
"""Slope above the repose slope (tangent) that the bed holds (tuned): 0.1 degrees at 39 degrees."""

_SWEEPS = 8
"""Most sweeps per sub-step, two in each of the four orders (tuned); what is left is done in the next sub-step."""


@kernel
def _behind(support: Array, ground: Ground, i: int, j: int, axis: int, sign: int, own: float) -> float:
    """Return the height that the neighbour on one side of a column supports there, with the two diagonals beside it."""
    nx, ny = support.shape
    di, dj = (sign, 0) if axis == 0 else (0, sign)
    step, side = (ground.dx, ground.dy) if axis == 0 else (ground.dy, ground.dx)
    s, p, q = ground.slope_tan, i + di, j + dj
    near = support[p, q] if 0 <= p < nx and 0 <= q < ny else ground.border_height
    if own - near <= 0.5 * s * step:
        return own
    best = near + s * step
    for turn in range(-1, 2, 2):
        p, q = i + di + turn * abs(dj), j + dj + turn * abs(di)
        far = support[p, q] if 0 <= p < nx and 0 <= q < ny else ground.border_height
        best = min(best, far + s * math.sqrt(step * step + side * side))
        across = (near - far) / side
        if 0.0 < across < s:
            along = math.sqrt(s * s - across * across)
            if across * step <= along * side:  # the steepest way down passes between the two neighbours
                best = min(best, near + step * along)
    return best


@kernel
def supported_height(support: Array, ground: Ground, i: int, j: int, own: float) -> float:
    """Return how high [m] static soil can be in a column; no more than its own height [m].

    The support (nx, ny) is the height of the static soil [m], infinite where soil cannot come down on it.
    """
    best = own
    for side in range(4):
        best = min(best, _behind(support, ground, i, j, side // 2, 2 * (side % 2) - 1, own))
    return best


@kernel
def lower_bed(layer: Layer, ground: Ground, window: Window) -> None:
    """Let the static soil of the active columns of a window fail where it is too steep; the bed changes in place.

    `support` changes with it. Columns with soil above the ceiling take no part.
    """
    active, bed, excess = layer.active, layer.bed, FAILURE_TAN * min(ground.dx, ground.dy)
    for order in range(_SWEEPS):
        changed = False
        for a in range(window.i0, window.i1):
            i = a if order % 2 == 0 else window.i0 + window.i1 - 1 - a
            for b in range(window.j0, window.j1):
                j = b if order % 4 == 0 or order % 4 == 3 else window.j0 + window.j1 - 1 - b
                why, height = active[i, j], layer.heights[i, j]
                if why == 0 or why == SEEN or (why == FLOWING and height > bed[i, j]) or height > layer.ceiling[i, j]:
                    continue  # the bed below a layer that flows is supported as before
                active[i, j] = SEEN
                supported = supported_height(layer.support, ground, i, j, bed[i, j])
                if ground.cohesion_m > 0.0:
                    supported = max(supported, layer.firm[i, j])
                if supported < bed[i, j] - excess:
                    mark_around(active, i, j)
                    active[i, j] = SEEN
                    bed[i, j] = supported
                    if layer.support[i, j] < math.inf:
                        layer.support[i, j] = supported
                    changed = True
        if not changed:
            return
