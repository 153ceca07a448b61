"""Contact of parcels with the ground: the soil of the dig area, that in the target box, the level ground around."""

import math
from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Flags, Vector
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.height_field import Grid, in_grid
from lerobot_excav.envs.soil.parcels.contact import Law, forget, wall_contact
from lerobot_excav.envs.soil.parcels.plates import BoxWalls, to_box
from lerobot_excav.envs.soil.parcels.store import SHELTERED, TOUCHES_BOX_FLOOR, TOUCHES_GROUND, TOUCHES_OUTSIDE, State

LEAST_GAP = 0.3
"""Share of its radius to which a parcel's centre may come near to the ground: ground that rises below it when others
merge lifts it without speed."""

LIFT = 0.05
"""Share of the radius by which a parcel is lifted per sub-step at most (tuned: no visible jump)."""


class Site(NamedTuple):
    """What parcels can land on; z counts from the rigid floor."""

    heights: Array  # (nx, ny) of the dig area [m]
    grid: Grid  # its first cell centre and cell sizes
    box_heights: Array  # (mx, my) of the soil in the target box above its floor [m]
    box_grid: Grid  # its grid, in the plane of the box
    box: BoxWalls
    level_z: float  # height of the ground around the dig area [m]


@kernel
def _surface(heights: Array, grid: Grid, x: float, y: float) -> Vector:
    """Return height and slopes of the bilinear surface through the cell centres; level beyond the outer ones."""
    nx, ny = heights.shape
    u = min(max((x - grid.x0) / grid.dx, 0.0), nx - 1.0)
    v = min(max((y - grid.y0) / grid.dy, 0.0), ny - 1.0)
    i, j = min(int(u), max(nx - 2, 0)), min(int(v), max(ny - 2, 0))
    k, m = min(i + 1, nx - 1), min(j + 1, ny - 1)
    a, b = u - i, v - j
    along_x = (heights[k, j] - heights[i, j]) * (1.0 - b) + (heights[k, m] - heights[i, m]) * b
    along_y = (heights[i, m] - heights[i, j]) * (1.0 - a) + (heights[k, m] - heights[k, j]) * a
    height = (heights[i, j] * (1.0 - b) + heights[i, m] * b) + a * along_x
    return height, along_x / grid.dx, along_y / grid.dy


@kernel
def ground_below(site: Site, x: float, y: float) -> tuple[int, float, Vector]:
    """Return what lies below a point, its height there [m] and its unit normal."""
    u, v = to_box(site.box, x, y)
    if abs(u) < site.box.half_x and abs(v) < site.box.half_y:
        h, su, sv = _surface(site.box_heights, site.box_grid, u, v)
        place, h = TOUCHES_BOX_FLOOR, h + site.box.floor_z
        sx, sy = site.box.cos * su - site.box.sin * sv, site.box.sin * su + site.box.cos * sv
    elif in_grid(site.heights, site.grid, x, y):
        h, sx, sy = _surface(site.heights, site.grid, x, y)
        place = TOUCHES_GROUND
    else:
        place, h, sx, sy = TOUCHES_OUTSIDE, site.level_z, 0.0, 0.0
    length = math.sqrt(1.0 + sx * sx + sy * sy)
    return place, h, (-sx / length, -sy / length, 1.0 / length)


@kernel
def places_below(site: Site, points: Array) -> Flags:
    """Return what lies below (n, 2) points, one of `store.TOUCHES_…` each."""
    places = np.zeros(len(points), dtype=np.uint8)
    for k in range(len(points)):
        places[k] = ground_below(site, points[k, 0], points[k, 1])[0]
    return places


@kernel
def press_ground(state: State, site: Site, highest: float, law: Law, dt: float) -> None:
    """Add the forces of the ground on the awake parcels and note what each touches.

    Deep inside the bucket there is no ground: the height field, one height per column, would leak in through the
    shell. No ground is higher than `highest` [m].
    """
    positions, velocities, spins = state.positions, state.velocities, state.spins
    springs, on_ground, near_plate = state.ground_springs, state.on_ground, state.near_plate
    masses, radii, asleep, shell = state.masses, state.radii, state.asleep, state.shell
    forces, torques, ground = state.forces, state.torques, state.ground
    for i in range(len(masses)):
        r = radii[i]
        if asleep[i] or shell[i] == SHELTERED or positions[i, 2] > highest + r:
            if on_ground[i]:
                on_ground[i] = 0
                forget(springs, i)
            continue
        place, height, normal = ground_below(site, positions[i, 0], positions[i, 1])
        gap = (positions[i, 2] - height) * normal[2]  # distance from the tangent plane
        if gap >= r:
            if on_ground[i]:
                on_ground[i] = 0
                forget(springs, i)
            continue
        on_ground[i] = 1
        ground[i] = place
        if gap < LEAST_GAP * r and not near_plate[i]:  # never into a plate
            lift = min(LEAST_GAP * r - gap, LIFT * r)
            for a in range(3):
                positions[i, a] += lift * normal[a]
        velocity = (velocities[i, 0], velocities[i, 1], velocities[i, 2])
        spin = (spins[i, 0], spins[i, 1], spins[i, 2])
        force, torque = wall_contact(springs, i, normal, min(max(gap, 0.0), r), velocity, spin, masses[i], r, law, dt)
        for a in range(3):
            forces[i, a] += force[a]
            torques[i, a] += torque[a]
