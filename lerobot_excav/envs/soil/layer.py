"""State of the soil in a height field: a mobile layer on a static bed, and which columns are looked at."""

from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Flags
from lerobot_excav.envs.soil.compiled import kernel


class Window(NamedTuple):
    """Ranges of the columns of a height field: from i0 to before i1 along x, from j0 to before j1 along y."""

    i0: int
    i1: int
    j0: int
    j1: int

    def union(self, other: "Window") -> "Window":
        """Return the smallest window that holds both; an empty one does not count."""
        if self.i1 <= self.i0 or self.j1 <= self.j0:
            return other
        if other.i1 <= other.i0 or other.j1 <= other.j0:
            return self
        return Window(min(self.i0, other.i0), max(self.i1, other.i1), min(self.j0, other.j0), max(self.j1, other.j1))


class Layer(NamedTuple):
    """Columns (nx, ny) and the faces between them.

    Face [0, i, j] lies between the columns (i - 1, j) and (i, j), face [1, i, j] between (i, j - 1) and (i, j).
    """

    heights: Array  # (nx, ny) of the surface above the floor [m]
    bed: Array  # (nx, ny) of the static soil [m]; what lies above it is mobile
    firm: Array  # (nx, ny) of the soil that was never loosened [m]; what lies above it has swelled and has no cohesion
    active: Flags  # (nx, ny) columns that the next sub-step looks at: 0 or one of `CHANGED`, `FLOWING`, `SEEN`
    ceiling: Array  # (nx, ny) height up to which soil can flow [m]: the underside of the bucket, else infinite
    speeds: Array  # (2, nx + 1, ny + 1) of the mobile layer across the faces [m/s]
    flux: Array  # (2, nx + 1, ny + 1) of the mobile layer across the faces [m2/s]
    next_speeds: Array  # work array of the same shape
    bed_before: Array  # (nx, ny) work array: the bed at the start of a sub-step [m]
    support: Array  # (nx, ny) work array: the bed [m], infinite where soil cannot come down on it
    share: Array  # (nx, ny) work array: share of its outflow that a column has soil for
    crept_s: Array  # (nx, ny) how long soil has moved there [s] since a change from outside or a fast flow (`momentum`)

    @classmethod
    def empty(cls, shape: tuple[int, int]) -> "Layer":
        """Return columns of no soil at rest without a ceiling."""
        faces = (2, shape[0] + 1, shape[1] + 1)
        return cls(
            heights=np.zeros(shape),
            bed=np.zeros(shape),
            firm=np.zeros(shape),
            active=np.zeros(shape, dtype=np.uint8),
            ceiling=np.full(shape, np.inf),
            speeds=np.zeros(faces),
            flux=np.zeros(faces),
            next_speeds=np.zeros(faces),
            bed_before=np.zeros(shape),
            support=np.zeros(shape),
            share=np.zeros(shape),
            crept_s=np.zeros(shape),
        )


CHANGED, FLOWING, SEEN = 1, 2, 3
"""Why a column is active: it or a neighbour was changed from outside or failed; soil flows there or next to it, or has
just stopped; or one of the two, and its bed has been looked at since."""


class Ground(NamedTuple):
    """What flows, and on what grid."""

    slope_tan: float  # as in `parameters.Strength`
    cohesion_m: float  # as there [m]
    swell: float  # as there
    dx: float  # cell size along x [m]
    dy: float  # the same along y [m]
    border_height: float  # of the level ground around the field [m]; infinite closes the border


@kernel
def mark_around(active: Flags, i: int, j: int, why: int = CHANGED) -> None:
    """Mark a column and its neighbours active, for a reason."""
    nx, ny = active.shape
    for a in range(max(0, i - 1), min(nx, i + 2)):
        for b in range(max(0, j - 1), min(ny, j + 2)):
            active[a, b] = why


@kernel
def wider(active: Flags, window: Window) -> Window:
    """Return a window with one column more on each side, as far as there are columns."""
    nx, ny = active.shape
    return Window(max(window.i0 - 1, 0), min(window.i1 + 1, nx), max(window.j0 - 1, 0), min(window.j1 + 1, ny))


@kernel
def active_window(active: Flags, inside: Window) -> Window:
    """Return a window with all active columns, and one column more on each side; empty if none is active.

    They are looked for in a window and one column more on each side of it.
    """
    search = wider(active, inside)
    i0, i1, j0, j1 = active.shape[0], 0, active.shape[1], 0
    for i in range(search.i0, search.i1):
        for j in range(search.j0, search.j1):
            if active[i, j]:
                i0, i1 = min(i0, i), max(i1, i + 1)
                j0, j1 = min(j0, j), max(j1, j + 1)
    return wider(active, Window(i0, i1, j0, j1)) if i1 > 0 else Window(0, 0, 0, 0)
