"""The bucket's shell in the plane of the boom: how far it hangs below the cutting edge, and what keeps it clear."""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lerobot_excav.envs.machines.excavator.constants import BUCKET_PROFILE_T
from lerobot_excav.envs.soil.plates import PLATE_THICKNESS_M

_PITCHES_RAD = np.arange(-1.0, -3.1, -0.005)  # from steep to rolled in
_ROUNDING_M = 1e-9


def _outside_t() -> NDArray[np.float64]:
    """Return the corners of the outside of all plates (2 n, 2) [m], in the tool frame."""
    corners = []
    for start, end in pairwise(np.array(BUCKET_PROFILE_T)):
        along = (end - start) / np.linalg.norm(end - start)
        outward = PLATE_THICKNESS_M * np.array([along[1], -along[0]])
        corners += [start + outward, end + outward]
    return np.array(corners)


_OUTSIDE_T = _outside_t()


def shell_from_edge_m(pitch_rad: ArrayLike) -> NDArray[np.float64]:
    """Return the corners of the shell's outside, from the cutting edge: outwards and upwards, (..., corners, 2) [m]."""
    pitch = np.asarray(pitch_rad)[..., None]
    cos, sin = np.cos(pitch), np.sin(pitch)
    x, z = (_OUTSIDE_T - BUCKET_PROFILE_T[0]).T
    return np.stack([x * cos - z * sin, x * sin + z * cos], axis=-1)


def hang_m(pitch_rad: ArrayLike) -> NDArray[np.float64]:
    """Return how far the lowest point of the shell lies below the cutting edge [m], for pitches of any shape [rad]."""
    return np.asarray(-shell_from_edge_m(pitch_rad)[..., 1].min(axis=-1))


def flattest_pitch_rad(edge_heights_m: ArrayLike) -> NDArray[np.float64]:
    """Return the most rolled-in pitches at which the shell stays off the rigid floor, for heights of the edge (n,) [m].

    Where it would touch at every pitch, it is the one at which it hangs least.
    """
    hangs = hang_m(_PITCHES_RAD)
    room = np.maximum(np.asarray(edge_heights_m), hangs.min())[..., None] - hangs
    last = _PITCHES_RAD.size - 1 - np.argmax(room[..., ::-1] >= -_ROUNDING_M, axis=-1)
    return np.asarray(_PITCHES_RAD[last])
