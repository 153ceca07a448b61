"""Neighbours: which parcels may touch before the list is made again, and what their contacts remember."""

import math
from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Flags, Indices
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.parcels.contact import SPRINGS

SKIN = 0.4
"""Gap, in radii of the largest parcel, up to which two parcels count as neighbours (tuned for speed)."""

_CELLS = (32, 32, 16)
"""Number of different cells along x, y and z."""

_PAIRS_PER_PARCEL = 16


class Pairs(NamedTuple):
    """Neighbours i < j in rows of i. The arrays have room to spare; only the first `start[n]` pairs count."""

    start: Indices  # (capacity + 1,) where the row of each parcel begins
    partner: Indices  # (room,) j of each pair
    closed: Flags  # (room,) 1 if the pair touched when last looked at
    springs: Array  # (room, 6) memory of each contact [m]
    anchors: Array  # (capacity, 3) positions at which the list was made [m]
    first: Indices  # (room,) work space: i of the pairs in the order found
    second: Indices  # (room,) work space: j of the same
    last: Indices  # (cells,) work space: the last parcel of each cell
    before: Indices  # (capacity,) work space: the parcel before each one in its cell


def room_for(capacity: int) -> Pairs:
    """Return an empty list for up to `capacity` parcels."""
    room = _PAIRS_PER_PARCEL * capacity
    return Pairs(
        np.zeros(capacity + 1, dtype=np.int64),
        np.zeros(room, dtype=np.int64),
        np.zeros(room, dtype=np.uint8),
        np.zeros((room, SPRINGS)),
        np.zeros((capacity, 3)),
        np.zeros(room, dtype=np.int64),
        np.zeros(room, dtype=np.int64),
        np.zeros(_CELLS[0] * _CELLS[1] * _CELLS[2], dtype=np.int64),
        np.zeros(capacity, dtype=np.int64),
    )


def enlarged(pairs: Pairs, capacity: int) -> Pairs:
    """Return a copy of a list with room for more parcels."""
    new = room_for(capacity)
    while len(new.partner) < len(pairs.partner):
        new = _more_room(new)
    new.start[: len(pairs.start)] = pairs.start
    new.partner[: len(pairs.partner)] = pairs.partner
    new.closed[: len(pairs.closed)] = pairs.closed
    new.springs[: len(pairs.springs)] = pairs.springs
    return new


@kernel
def _along(position: float, size: float, axis: int) -> int:
    """Return the index of a cell along an axis. Cells repeat: far parcels in one are told apart by distance."""
    return math.floor(position / size) & (_CELLS[axis] - 1)


@kernel
def _fill_cells(positions: Array, size: float, last: Indices, before: Indices) -> None:
    """Chain the parcels of each cell."""
    last[:] = -1
    for i in range(len(positions)):
        c0 = _along(positions[i, 0], size, 0)
        c1 = _along(positions[i, 1], size, 1)
        c2 = _along(positions[i, 2], size, 2)
        index = (c0 * _CELLS[1] + c1) * _CELLS[2] + c2
        before[i] = last[index]
        last[index] = i


@kernel
def _more_room(pairs: Pairs) -> Pairs:
    """Return a list with twice the room and the same pairs found so far."""
    room = 2 * len(pairs.partner)
    first, second = np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.int64)
    for k in range(len(pairs.first)):
        first[k], second[k] = pairs.first[k], pairs.second[k]
    partner, closed = np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.uint8)
    springs = np.zeros((room, SPRINGS))
    return Pairs(pairs.start, partner, closed, springs, pairs.anchors, first, second, pairs.last, pairs.before)


@kernel
def _find_near(
    positions: Array, radii: Array, asleep: Flags, first: Indices, second: Indices, last: Indices, before: Indices
) -> int:
    """Write all pairs within the skin, first < second, in no order; return their number, which may exceed the room."""
    largest = 0.0
    for i in range(len(radii)):
        largest = max(largest, radii[i])
    skin = SKIN * largest
    size = 2.0 * largest + skin
    _fill_cells(positions, size, last, before)
    count, room = 0, len(first)
    for i in range(len(positions)):
        x, y, z, r = positions[i, 0], positions[i, 1], positions[i, 2], radii[i] + skin
        c0, c1, c2 = _along(x, size, 0), _along(y, size, 1), _along(z, size, 2)
        for a in range(13, 27):  # its own cell and the 13 of its 26 neighbours that come later
            d0, d1 = (c0 + a // 9 - 1) & (_CELLS[0] - 1), (c1 + a // 3 % 3 - 1) & (_CELLS[1] - 1)
            d2 = (c2 + a % 3 - 1) & (_CELLS[2] - 1)
            j = before[i] if a == 13 else last[(d0 * _CELLS[1] + d1) * _CELLS[2] + d2]
            while j >= 0:
                dx, dy, dz = x - positions[j, 0], y - positions[j, 1], z - positions[j, 2]
                reach = r + radii[j]
                if dx * dx + dy * dy + dz * dz < reach * reach and not (asleep[i] and asleep[j]):
                    if count < room:
                        first[count], second[count] = min(i, j), max(i, j)
                    count += 1
                j = before[j]
    return count


@kernel
def _sort_rows(
    first: Indices, second: Indices, count: int, n: int, start: Indices, partner: Indices, free: Indices
) -> None:
    """Sort pairs by their first ones: write where each row begins, and the second ones row by row."""
    start[: n + 1] = 0
    for k in range(count):
        start[first[k] + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
        free[i] = start[i]
    for k in range(count):
        partner[free[first[k]]] = second[k]
        free[first[k]] += 1


@kernel
def find_pairs(positions: Array, radii: Array, asleep: Flags, old: Pairs, old_rows: Indices, new: Pairs) -> Pairs:
    """List the neighbours again; two parcels that both sleep are none.

    The memory of the list `old` is kept, in which each parcel had a row `old_rows` (n,), growing, or -1 for a new one.
    The list is written to `new`; another one is returned if that is too small.
    """
    n = len(positions)
    count = _find_near(positions, radii, asleep, new.first, new.second, new.last, new.before)
    while count > len(new.first):
        new = _more_room(new)
        count = _find_near(positions, radii, asleep, new.first, new.second, new.last, new.before)
    # The cells are done with: their space serves again.
    _sort_rows(new.first, new.second, count, n, new.start, new.partner, new.before)
    new.closed[:count] = 0
    new.springs[:count] = 0.0
    for i in range(n):
        for a in range(3):
            new.anchors[i, a] = positions[i, a]
    _remember(old_rows, old, new)
    return new


@kernel
def _remember(old_rows: Indices, old: Pairs, new: Pairs) -> None:
    """Copy the memory of closed contacts from the old list."""
    old_start, old_partner, old_closed, old_springs = old.start, old.partner, old.closed, old.springs
    start, partner, closed, springs = new.start, new.partner, new.closed, new.springs
    for i in range(len(old_rows)):
        row = old_rows[i]
        if row < 0:
            continue
        for k in range(start[i], start[i + 1]):
            other = old_rows[partner[k]]
            for m in range(old_start[row], old_start[row + 1]):
                if old_partner[m] == other and old_closed[m]:
                    closed[k] = 1
                    for a in range(SPRINGS):
                        springs[k, a] = old_springs[m, a]


@kernel
def is_outdated(positions: Array, radii: Array, anchors: Array) -> bool:
    """Tell whether parcels have moved so far against each other that unlisted ones may touch."""
    n = len(positions)
    if n == 0:
        return False
    mean = np.zeros(3)
    largest = 0.0
    for i in range(n):
        largest = max(largest, radii[i])
        for a in range(3):
            mean[a] += (positions[i, a] - anchors[i, a]) / n
    limit = (0.5 * SKIN * largest) ** 2
    for i in range(n):
        moved = 0.0
        for a in range(3):
            moved += (positions[i, a] - anchors[i, a] - mean[a]) ** 2
        if moved > limit:
            return True
    return False
