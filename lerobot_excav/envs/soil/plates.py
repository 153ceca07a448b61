"""The outer faces of a bucket's plates, in pieces that the ground can press on."""

import math
from dataclasses import dataclass

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Bools
from lerobot_excav.envs.soil.tool import ToolGeometry

PLATE_THICKNESS_M = 0.02
"""Thickness of the plates, and so of the blunt cutting edge (guess: wear plate with its strips)."""

_PIECE_LENGTH_M = 0.2
"""Longest piece of the profile that one row of patches stands for."""


@dataclass(frozen=True, kw_only=True, eq=False)
class OuterFaces:
    """Pieces of the bottom and the back of a bucket and of its blunt cutting edge, in its frame.

    Each is a strip from a start to an end, straight across the bucket. Both lie on the inside of the plate; the ground
    meets the plate at one thickness along the normal from there. The edge is a line, as thick as the plate.
    """

    starts_t: Array  # (m, 3) [m]
    ends_t: Array  # (m, 3) [m]
    normals_t: Array  # (m, 3) unit vectors out of the bucket
    width_m: float  # of every piece, across the bucket
    rows: int  # how many pieces lie beside each other
    is_edge: Bools  # (m,) whether it belongs to the cutting edge

    @classmethod
    def of(cls, geometry: ToolGeometry, rows: int) -> "OuterFaces":
        """Cut the profile into pieces, from the edge to the lip, in so many lateral rows."""
        width = geometry.inner_width_m / rows
        lateral = np.asarray((np.arange(rows) + 0.5) * width - 0.5 * geometry.inner_width_m, dtype=np.float64)
        pieces = [_edge_piece(geometry.profile_t)]
        for start, end in zip(geometry.profile_t[:-1], geometry.profile_t[1:], strict=True):
            pieces += _shell_pieces(start, end)
        starts, ends, normals = (np.array(column, dtype=np.float64) for column in zip(*pieces, strict=True))
        is_edge = np.arange(len(pieces)) == 0
        return cls(
            starts_t=_across(starts, lateral),
            ends_t=_across(ends, lateral),
            normals_t=_across(normals, np.zeros(rows)),
            width_m=width,
            rows=rows,
            is_edge=np.repeat(is_edge, rows),
        )

    @property
    def areas_m2(self) -> Array:
        """(m,) area of each piece."""
        lengths = np.linalg.norm(self.ends_t - self.starts_t, axis=1)
        return np.where(self.is_edge, PLATE_THICKNESS_M, lengths) * self.width_m


def _edge_piece(profile_t: Array) -> tuple[Array, Array, Array]:
    """Return start, end and normal (x, z) of the blunt end of the bottom plate."""
    along = profile_t[1] - profile_t[0]
    along = along / np.linalg.norm(along)
    return profile_t[0], profile_t[0], -along


def _shell_pieces(start: Array, end: Array) -> list[tuple[Array, Array, Array]]:
    """Return the same for the pieces of one straight plate."""
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    count = math.ceil(length / _PIECE_LENGTH_M)
    corners = start + np.linspace(0.0, 1.0, count + 1)[:, None] * (end - start)
    normal = np.array([along[1], -along[0]])
    return [(corners[k], corners[k + 1], normal) for k in range(count)]


def _across(points: Array, lateral: Array) -> Array:
    """Repeat (n, 2) points (x, z) at all (r,) lateral places; return (n r, 3)."""
    repeated = np.repeat(points, len(lateral), axis=0)
    return np.asarray(np.insert(repeated, 1, np.tile(lateral, len(points)), axis=1))
