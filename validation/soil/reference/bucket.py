"""Twin of `cutting`: what is inside of a bucket, and how it got there."""

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Bools


def inside(planes: Array, points_t: Array) -> Bools:
    """Tell which of (n, 3) tool points are inside of all half-spaces."""
    return np.asarray((points_t @ planes[:, :3].T <= planes[:, 3]).all(axis=1))


def column_interval(planes: Array, position: Array, rotation: Array, xy: Array, z: Array) -> tuple[float, float] | None:
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
