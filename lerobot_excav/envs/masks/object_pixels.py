"""An object on a surface, from a point on it: by depth and colour edges, without any weights."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from lerobot_excav.envs.masks.shot import Shot

REACH_M = 0.06
"""An object is nowhere farther from its middle than this [m] (kind: guess, for objects that fit a gripper)."""

SURROUNDINGS_M = 0.15
"""How far around it the surface is looked for that it stands on [m] (kind: guess)."""

LEAST_HEIGHT_M = 0.006
"""What is lower than this over that surface belongs to it [m] (kind: guess: noise of a depth camera at 1 m)."""

GRAB_ROUNDS = 3
"""Rounds of GrabCut (kind: guess)."""


def object_by_depth(shot: Shot, place_w: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return the pixels (H, W) of the object at a place (3,) [m]: what stands out of the surface there, in one piece.

    Raises:
        ConfigurationError: The picture has no depth, or its camera is not calibrated.
    """
    points_w = shot.points_w()
    away_m = np.linalg.norm(points_w - place_w, axis=-1)
    around = away_m < SURROUNDINGS_M
    if not around.any():
        return np.zeros(shot.size, dtype=bool)
    floor_m = np.percentile(points_w[around][:, 2], 10.0)
    stands = (away_m < REACH_M) & (points_w[..., 2] > floor_m + LEAST_HEIGHT_M)
    if not stands.any():
        return np.zeros(shot.size, dtype=bool)
    pieces, _ = ndimage.label(stands, structure=np.ones((3, 3)))
    nearest = np.unravel_index(np.argmin(np.where(stands, away_m, np.inf)), stands.shape)
    return np.asarray(pieces == pieces[nearest], dtype=bool)


def object_by_colour(picture: NDArray[np.uint8], box: tuple[float, float, float, float]) -> NDArray[np.bool_]:
    """Return the pixels (H, W) of the object within a box (left, upper, right, lower) [px], by GrabCut.

    C. Rother, V. Kolmogorov, A. Blake, ACM Trans. Graph. 23 (2004) 309-314; OpenCV's implementation. The box has to
    reach a little beyond the object, for its rim is taken for background.
    """
    import cv2

    height, width = picture.shape[:2]
    left, upper = max(0, int(np.floor(box[0]))), max(0, int(np.floor(box[1])))
    right, lower = min(width, int(np.ceil(box[2]))), min(height, int(np.ceil(box[3])))
    labels = np.zeros((height, width), np.uint8)
    if right - left < 3 or lower - upper < 3:  # nothing of it, or no rim, lies in the picture
        return labels.astype(bool)
    models = [np.zeros((1, 65), np.float64) for _ in range(2)]
    cv2.setRNGSeed(0)  # it starts from clusters that are drawn
    rectangle = (left, upper, right - left, lower - upper)
    bgr = np.ascontiguousarray(picture[..., ::-1])
    cv2.grabCut(bgr, labels, rectangle, models[0], models[1], GRAB_ROUNDS, cv2.GC_INIT_WITH_RECT)
    found = np.isin(labels, (cv2.GC_FGD, cv2.GC_PR_FGD))
    pieces, count = ndimage.label(found)
    if count == 0:
        return np.asarray(found)
    sizes = ndimage.sum_labels(found, pieces, np.arange(1, count + 1))
    return np.asarray(pieces == 1 + int(np.argmax(sizes)))
