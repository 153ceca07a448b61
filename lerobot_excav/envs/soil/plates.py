"""The outer faces of a bucket's plates, as samples that the ground can press on."""

import math
from dataclasses import dataclass

import numpy as np

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.tool import ToolGeometry

PLATE_THICKNESS_M = 0.02
"""Thickness of the plates (guess: wear plate with its strips)."""

_PIECE_LENGTH_M = 0.2
"""Longest piece of the profile that one row of patches stands for."""


@dataclass(frozen=True, kw_only=True, eq=False)
class OuterFaces:
    """Samples of the outer faces of a bucket, in its frame."""

    points_t: Array  # (m, 3) on the outer faces [m]
    normals_t: Array  # (m, 3) unit vectors out of the bucket
    areas_m2: Array  # (m,) what each stands for
    breadths_m: Array  # (m,) its share of the breadth of the footing that the profile makes; zero for side plates

    @classmethod
    def of(cls, geometry: ToolGeometry, rows: int) -> "OuterFaces":
        """Sample the profile in so many lateral rows, and the side plates in one triangle per corner."""
        shell, sides = _shell_samples(geometry, rows), _side_samples(geometry)
        points, normals, areas, breadths = (np.concatenate(pair) for pair in zip(shell, sides, strict=True))
        return cls(
            points_t=points + PLATE_THICKNESS_M * normals, normals_t=normals, areas_m2=areas, breadths_m=breadths
        )


def _shell_samples(geometry: ToolGeometry, rows: int) -> tuple[Array, Array, Array, Array]:
    """Return points, normals, areas and breadths along the profile, from the edge to the lip."""
    width = geometry.inner_width_m
    lateral = (np.arange(rows) + 0.5) / rows * width - 0.5 * width
    points: list[tuple[float, float, float]] = []
    normals: list[tuple[float, float, float]] = []
    lengths: list[float] = []
    for start, end in zip(geometry.profile_t[:-1], geometry.profile_t[1:], strict=True):
        length = float(np.linalg.norm(end - start))
        along = (end - start) / length
        pieces = math.ceil(length / _PIECE_LENGTH_M)
        for k in range(pieces):
            x, z = start + (k + 0.5) / pieces * (end - start)
            points.extend((x, y, z) for y in lateral)
            normals.extend([(along[1], 0.0, -along[0])] * rows)
            lengths.extend([length / pieces] * rows)
    breadths = np.array(lengths) / rows
    return np.array(points), np.array(normals), breadths * width, breadths


def _side_samples(geometry: ToolGeometry) -> tuple[Array, Array, Array, Array]:
    """Return the same for the two side plates: triangles between the centroid and each side of the profile."""
    centre = geometry.centroid_t[[0, 2]]
    first, second = geometry.profile_t, np.roll(geometry.profile_t, -1, axis=0)
    middle = (first + second + centre) / 3.0
    a, b = first - centre, second - centre
    area = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    points, normals = [], []
    for side in (-1.0, 1.0):
        points.append(np.insert(middle, 1, side * 0.5 * geometry.inner_width_m, axis=1))
        normals.append(np.tile([0.0, side, 0.0], (len(middle), 1)))
    return np.concatenate(points), np.concatenate(normals), np.tile(area, 2), np.zeros(2 * len(middle))
