"""Twin of `parcels.ground`: the bilinear surface as a sum over its corners."""

import numpy as np

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.height_field import Grid
from lerobot_excav.envs.soil.parcels.contact import Law
from lerobot_excav.envs.soil.parcels.ground import LEAST_GAP, LIFT, Site
from lerobot_excav.envs.soil.parcels.store import SHELTERED, TOUCHES_BOX_FLOOR, TOUCHES_GROUND, TOUCHES_OUTSIDE, State
from validation.soil.reference.contact import wall_contact


def surface(heights: Array, grid: Grid, point: Array) -> tuple[float, Array]:
    """Return height and slopes (2,) of the surface that is bilinear between the cell centres and level beyond."""
    corner, share = [], []
    for axis in (0, 1):
        cells = heights.shape[axis]
        place = float(np.clip((point[axis] - grid.first_m[axis]) / grid.cell_m[axis], 0.0, cells - 1.0))
        first = min(int(place), max(cells - 2, 0))
        corner.append((first, min(first + 1, cells - 1)))
        share.append(place - first)
    along_x, along_y = (np.array([1.0 - s, s]) for s in share)
    patch = heights[np.ix_(*corner)]
    step = np.array([-1.0, 1.0])
    slopes = np.array([step @ patch @ along_y / grid.dx, along_x @ patch @ step / grid.dy])
    return float(along_x @ patch @ along_y), slopes


def ground_below(site: Site, point: Array) -> tuple[int, float, Array]:
    """Return what lies below a point (2,), its height [m] and its unit normal (3,)."""
    box = site.box
    axes = np.array([[box.cos, box.sin], [-box.sin, box.cos]])
    in_box = axes @ (point - np.array([box.x, box.y]))
    half = 0.5 * np.array(site.heights.shape) * site.grid.cell_m
    if abs(in_box[0]) < box.half_x and abs(in_box[1]) < box.half_y:
        height, slopes = surface(site.box_heights, site.box_grid, in_box)
        place, height, slopes = TOUCHES_BOX_FLOOR, height + box.floor_z, slopes @ axes
    elif (np.abs(point) < half).all():
        height, slopes = surface(site.heights, site.grid, point)
        place = TOUCHES_GROUND
    else:
        place, height, slopes = TOUCHES_OUTSIDE, site.level_z, np.zeros(2)
    normal = np.array([-slopes[0], -slopes[1], 1.0])
    return place, height, normal / np.linalg.norm(normal)


def press_ground(state: State, site: Site, law: Law, dt: float) -> None:
    """Add the forces of the ground on the awake parcels and note what each touches."""
    for i in range(len(state.masses)):
        place, height, normal = ground_below(site, state.positions[i, :2])
        gap, radius = float((state.positions[i, 2] - height) * normal[2]), float(state.radii[i])
        springs = state.ground_springs[i]
        if state.asleep[i] or state.shell[i] == SHELTERED or gap >= radius:
            state.on_ground[i] = 0
            springs[:] = 0.0
            continue
        state.on_ground[i] = 1
        state.ground[i] = place
        if not state.near_plate[i]:
            state.positions[i] += float(np.clip(LEAST_GAP * radius - gap, 0.0, LIFT * radius)) * normal
        force, torque = wall_contact(
            springs, normal, max(gap, 0.0), state.velocities[i], state.spins[i], float(state.masses[i]), radius, law, dt
        )
        state.forces[i] += force
        state.torques[i] += torque
