"""Dig regions: where on a pile a scoop can be commanded, and the image mask that commands it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.excavator.cameras import MAIN
from lerobot_excav.envs.excavator.constants import BUCKET_INNER_WIDTH_M
from lerobot_excav.envs.excavator.layout import cylinder_from_world, world_from_cylinder
from lerobot_excav.envs.excavator.visibility import seen_area_px
from lerobot_excav.envs.settings import TARGETS_PER_SCENE
from lerobot_excav.errors import ExcavError

PATCH_SIZE_M = 0.8
"""Edge of the square patch on the ground plane [m] (design: about 0.8 m x 0.8 m)."""

# Feasibility of a dig region (kind: tuned on train scenes, with the scripted operator).
RADIUS_RANGE_M = (3.5, 5.9)
LEAST_MEAN_HEIGHT_M = 0.38
LEAST_DISTANCE_M = 1.0
DIG_LENGTH_M = 1.4
CUT_DEPTH_M = 0.55
LEAST_DIGGABLE_M3 = 0.40

LEAST_MASK_PX = 60.0
"""Least area of a mask in the main view of 96 x 128 pixels, the machine left out (kind: tuned)."""

_PICTURE_HEIGHT_PX = 96


class TooFewTargetsError(ExcavError):
    """A pile has no room for the wanted number of dig regions."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """A square patch of the ground plane, turned towards the machine.

    Attributes:
        center_w: Centre on the soil surface [m], shape (3,), world frame.
        yaw_rad: Direction from the machine to the patch [rad].
        size_m: Edge length [m].
    """

    center_w: NDArray[np.float64]
    yaw_rad: float
    size_m: float = PATCH_SIZE_M

    def contains(self, points_w: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which points lie above, on or below the patch.

        Args:
            points_w: Points [m], shape (..., 2) or (..., 3), world frame; NaN is outside.

        Returns:
            Booleans, shape (...).
        """
        offset = points_w[..., :2] - self.center_w[:2]
        cos, sin = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        along = offset[..., 0] * cos + offset[..., 1] * sin
        across = -offset[..., 0] * sin + offset[..., 1] * cos
        return np.asarray(np.maximum(np.abs(along), np.abs(across)) <= 0.5 * self.size_m)


def find_targets(
    heights_m: NDArray[np.float64],
    x_w: NDArray[np.float64],
    y_w: NDArray[np.float64],
    rng: np.random.Generator,
    *,
    count: int = TARGETS_PER_SCENE,
) -> tuple[Target, ...]:
    """Pick dig regions that are reachable and in view, hold enough soil and lie apart from each other.

    Args:
        heights_m: Soil surface above the floor [m], shape (nx, ny).
        x_w: Cell centres along x [m], shape (nx,).
        y_w: Cell centres along y [m], shape (ny,).
        rng: Source of the choice among the feasible regions.
        count: How many to pick.

    Returns:
        The targets in an order that tells nothing of their places.

    Raises:
        TooFewTargetsError: The pile offers fewer than `count` such regions.
    """
    candidates = _feasible_targets(heights_m, x_w, y_w)
    # Greedy picks can block each other: several random orders, then give up.
    for _ in range(20):
        picked: list[Target] = []
        for index in rng.permutation(len(candidates)):
            candidate = candidates[index]
            if all(_ground_distance(candidate, other) >= LEAST_DISTANCE_M for other in picked):
                picked.append(candidate)
            if len(picked) == count:
                return tuple(picked)
    raise TooFewTargetsError(
        f"the pile has room for {len(picked)} dig regions, {count} are wanted; draw another pile"
    )


def target_mask_img(target: Target, terrain_points_w: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Draw the mask of a target: the pixels whose soil surface point lies in the patch.

    Args:
        target: The dig region.
        terrain_points_w: Surface point seen by each pixel [m], shape (H, W, 3), NaN where there is no soil.

    Returns:
        Mask of {0, 255}, shape (H, W, 3), uint8.
    """
    inside = target.contains(terrain_points_w)
    return np.repeat(np.where(inside, 255, 0).astype(np.uint8)[..., None], 3, axis=2)


def _ground_distance(a: Target, b: Target) -> float:
    return float(np.hypot(*(a.center_w[:2] - b.center_w[:2])))


def _feasible_targets(
    heights_m: NDArray[np.float64], x_w: NDArray[np.float64], y_w: NDArray[np.float64]
) -> list[Target]:
    """Every feasible region on a 10 cm raster of the dig area."""
    step = max(1, round(0.1 / float(x_w[1] - x_w[0])))
    seen_px = seen_area_px(heights_m, x_w, y_w, MAIN, picture_height_px=_PICTURE_HEIGHT_PX)
    feasible = []
    for ix in range(0, x_w.size, step):
        for iy in range(0, y_w.size, step):
            if heights_m[ix, iy] < LEAST_MEAN_HEIGHT_M:
                continue
            center_w = np.array([x_w[ix], y_w[iy], heights_m[ix, iy]])
            radius, swing, _ = cylinder_from_world(center_w)
            target = Target(center_w=center_w, yaw_rad=swing)
            if (
                RADIUS_RANGE_M[0] <= radius <= RADIUS_RANGE_M[1]
                and _has_enough_soil(target, heights_m, x_w, y_w)
                and _sum_over_patch(target, seen_px, x_w, y_w) >= LEAST_MASK_PX
            ):
                feasible.append(target)
    return feasible


def _sum_over_patch(
    target: Target, values: NDArray[np.float64], x_w: NDArray[np.float64], y_w: NDArray[np.float64]
) -> float:
    """Sum what belongs to the cells of a patch, shape of `values`: (nx, ny)."""
    reach_m = 0.5 * np.sqrt(2.0) * target.size_m
    near_x, near_y = (
        slice(*np.searchsorted(axis_w, (centre - reach_m, centre + reach_m)))
        for axis_w, centre in ((x_w, target.center_w[0]), (y_w, target.center_w[1]))
    )
    points_w = np.stack(np.meshgrid(x_w[near_x], y_w[near_y], indexing="ij"), axis=-1)
    return float(values[near_x, near_y][target.contains(points_w)].sum())


def _has_enough_soil(
    target: Target, heights_m: NDArray[np.float64], x_w: NDArray[np.float64], y_w: NDArray[np.float64]
) -> bool:
    patch = _sample(heights_m, x_w, y_w, target, (-PATCH_SIZE_M / 2, PATCH_SIZE_M / 2))
    dig_path = _sample(heights_m, x_w, y_w, target, (-DIG_LENGTH_M, 0.1))
    diggable_m3 = np.minimum(dig_path, CUT_DEPTH_M).mean() * BUCKET_INNER_WIDTH_M * (DIG_LENGTH_M + 0.1)
    return bool(patch.mean() >= LEAST_MEAN_HEIGHT_M and diggable_m3 >= LEAST_DIGGABLE_M3)


def _sample(
    heights_m: NDArray[np.float64],
    x_w: NDArray[np.float64],
    y_w: NDArray[np.float64],
    target: Target,
    along_range_m: tuple[float, float],
) -> NDArray[np.float64]:
    """Heights at the nearest cells of a strip of bucket width along the dig direction [m], shape (12, 5)."""
    radius, swing, _ = cylinder_from_world(target.center_w)
    along = radius + np.linspace(*along_range_m, 12)
    across = np.linspace(-BUCKET_INNER_WIDTH_M / 2, BUCKET_INNER_WIDTH_M / 2, 5)
    points = world_from_cylinder(along[:, None], swing + across[None, :] / radius)
    cell = float(x_w[1] - x_w[0])
    ix = np.clip(np.rint((points[..., 0] - x_w[0]) / cell).astype(int), 0, x_w.size - 1)
    iy = np.clip(np.rint((points[..., 1] - y_w[0]) / cell).astype(int), 0, y_w.size - 1)
    return np.asarray(heights_m[ix, iy])
