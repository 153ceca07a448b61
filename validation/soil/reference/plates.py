"""Twin of `parcels.plates`: a sphere against thin plates, each a convex polygon in space."""

import numpy as np

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.parcels.contact import Law
from lerobot_excav.envs.soil.parcels.plates import CLOSEST, LARGEST_APPROACH, BoxWalls, ToolPath
from lerobot_excav.envs.soil.parcels.store import OFF_BUCKET, OUTSIDE_OF_SHELL, SHELTERED, State
from validation.soil.reference.contact import wall_contact

_DEEP_M = 100.0
"""How far box walls reach down: parcels below the floor of the box meet them too."""


def plate_polygons(profile: Array, half_width: float) -> list[Array]:
    """Return the corners (k, 3) of each plate in the tool frame: shell from edge to lip, right side, left side."""
    right, left = (np.insert(profile, 1, y, axis=1) for y in (-half_width, half_width))
    shell = [np.array([right[k], right[k + 1], left[k + 1], left[k]]) for k in range(len(profile) - 1)]
    return [*shell, right, left]


def bucket_polygons(tool: ToolPath) -> list[Array]:
    """Return the plates of a bucket, as `plate_polygons` does."""
    return plate_polygons(tool.profile, tool.half_width)


def box_polygons(box: BoxWalls) -> list[Array]:
    """Return the corners (4, 3) of the walls of a container, along its own x and y but at world height."""
    _, _, floor, half_x, half_y, top, _, _ = box
    polygons = []
    for x0, y0, x1, y1 in [
        (half_x, -half_y, half_x, half_y),
        (-half_x, -half_y, -half_x, half_y),
        (-half_x, half_y, half_x, half_y),
        (-half_x, -half_y, half_x, -half_y),
    ]:
        low = floor - _DEEP_M
        polygons.append(np.array([(x0, y0, low), (x1, y1, low), (x1, y1, top), (x0, y0, top)]))
    return polygons


def nearest_point(polygon: Array, point: Array) -> Array:
    """Return the point of a flat, convex polygon that is nearest to a point in space."""
    following = np.roll(polygon, -1, axis=0)
    normal = np.cross(polygon[1] - polygon[0], polygon[2] - polygon[0])
    normal = normal / np.linalg.norm(normal)
    foot = point - float((point - polygon[0]) @ normal) * normal
    turns = np.cross(following - polygon, foot - polygon) @ normal
    if (turns >= 0).all() or (turns <= 0).all():
        return np.asarray(foot)
    along = following - polygon
    shares = np.clip(((point - polygon) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
    on_sides = polygon + shares[:, None] * along
    return np.asarray(on_sides[np.argmin(np.linalg.norm(on_sides - point, axis=1))])


def press_bucket(
    state: State, step: int, tool: ToolPath, opening_margin: float, law: Law, dt: float, pushes: Array
) -> None:
    """Add the forces of the bucket's plates on the awake parcels, and note where each is at the bucket."""
    origin, rotation = tool.positions[step], tool.rotations[step]
    polygons = bucket_polygons(tool)
    for i in range(len(state.masses)):
        state.shell[i] = OFF_BUCKET
        if state.asleep[i]:
            continue
        point_t = (state.positions[i] - origin) @ rotation
        beyond = tool.planes[:, :3] @ point_t - tool.planes[:, 3]
        if beyond[1:].max() < 0.0 and beyond[0] < -opening_margin:
            state.shell[i] = SHELTERED
        state.near_plate[i] = 0
        for k, polygon in enumerate(polygons):
            nearest_t = nearest_point(polygon, point_t)
            surface_velocity = tool.linear + np.cross(tool.angular, rotation @ nearest_t)
            away = rotation @ (point_t - nearest_t)
            before = state.velocities[i] + dt * state.forces[i] / state.masses[i]
            touches = _press(state, i, k, away, surface_velocity, law, dt)
            if not state.load[i] and beyond[k + 1] <= 0.0:
                gained = state.velocities[i] + dt * state.forces[i] / state.masses[i] - before
                given = -state.masses[i] * gained
                pushes += np.concatenate([given, np.cross(origin + rotation @ nearest_t, given)])
            state.near_plate[i] |= touches
            if touches and beyond[k + 1] > 0.0:
                state.shell[i] = OUTSIDE_OF_SHELL


def press_box(state: State, first: int, box: BoxWalls, law: Law, dt: float) -> None:
    """Add the forces of the walls of the target box on the awake parcels."""
    x, y, _, _, _, _, cos, sin = box
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    for i in range(len(state.masses)):
        if state.asleep[i]:
            continue
        point = (state.positions[i] - np.array([x, y, 0.0])) @ turn
        for k, polygon in enumerate(box_polygons(box)):
            _press(state, i, first + k, turn @ (point - nearest_point(polygon, point)), np.zeros(3), law, dt)


def _press(state: State, i: int, plate: int, away: Array, velocity: Array, law: Law, dt: float) -> bool:
    """Add the force of one plate on a parcel that is `away` from it; tell whether they touch."""
    gap, radius = float(np.linalg.norm(away)), float(state.radii[i])
    springs = state.plate_springs[i, plate]
    if gap >= radius:
        springs[:] = 0.0
        return False
    normal = away / gap
    back = max(0.0, CLOSEST * radius - gap)
    closing = -float((state.velocities[i] - velocity) @ normal)
    state.positions[i] += back * normal
    state.velocities[i] += max(0.0, closing - LARGEST_APPROACH * (gap + back) / dt) * normal
    force, torque = wall_contact(
        springs, normal, gap, state.velocities[i] - velocity, state.spins[i], float(state.masses[i]), radius, law, dt
    )
    state.forces[i] += force
    state.torques[i] += torque
    return True
