"""Pressure of the ground on the outer faces of the plates: bottom, back and side plates.

An upright face finds the passive pressure of the fundamental equation of earthmoving, spread over its depth. A face
that leans over the soil sinks into it: the pressure grows with the sinkage as Bekker measured (k z^n), up to the
bearing capacity (Vesic 1973). Where the ground falls off beside the face, as on the flanks of a pile, both are lower by
the ground factor (1 - slope)^2 (Vesic 1975). In between, this counts by the square of the downward part of the normal
(guess).

Any pressure starts from zero at contact and is whole where the soil overlaps the outer face by the thickness of the
plate: the cut clears the inside of the plates, so soil that touches one reaches as deep into its outer face.
"""

import math

import numpy as np

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.height_field import Grid, in_grid, surface_height
from lerobot_excav.envs.soil.patches import Patches, PatchKind
from lerobot_excav.envs.soil.plates import PLATE_THICKNESS_M, OuterFaces
from lerobot_excav.envs.soil.tool import Tool
from lerobot_excav.envs.soil.wedge import SoilStrength, table_row

SINKAGE_MODULUS = 1.53e6
"""Pressure at 1 m of sinkage [N/m^(n+2)] of a plate in dry sand; the part that depends on its breadth is below 1 %
(paper: LLL dry sand, Wong, Theory of Ground Vehicles, table of Bekker parameters)."""

SINKAGE_EXPONENT = 1.1
"""Exponent n of the same."""

FALL_REACH_M = 0.5
"""Distance over which the fall of the ground is read (guess: about the breadth of the bucket's bottom)."""


@kernel
def plate_overlaps(heights: Array, grid: Grid, points: Array, normals: Array) -> Array:
    """Return how far the soil before each of (m, 3) samples of the outer faces stands above it [m], at least 0.

    It is read one cell outside of the face, in so far as the face is upright; z counts from the rigid floor.
    """
    overlaps = np.zeros(len(points))
    for k in range(len(points)):
        x, y = points[k, 0] + grid.dx * normals[k, 0], points[k, 1] + grid.dx * normals[k, 1]
        if in_grid(heights, grid, x, y):
            overlaps[k] = max(0.0, surface_height(heights, grid, x, y) - points[k, 2])
    return overlaps


@kernel
def ground_factors(heights: Array, grid: Grid, points: Array) -> Array:
    """Return the share of the bearing that is left at (m, 3) points on ground that falls off towards one side, (m,)."""
    factors = np.ones(len(points))
    for k in range(len(points)):
        x, y = points[k, 0], points[k, 1]
        level = surface_height(heights, grid, x, y)
        lowest = min(
            min(surface_height(heights, grid, x - FALL_REACH_M, y), surface_height(heights, grid, x + FALL_REACH_M, y)),
            min(surface_height(heights, grid, x, y - FALL_REACH_M), surface_height(heights, grid, x, y + FALL_REACH_M)),
        )
        slope = min(max((level - lowest) / FALL_REACH_M, 0.0), 1.0)
        factors[k] = (1.0 - slope) ** 2
    return factors


@kernel
def plate_limits(
    overlaps: Array, sinkages: Array, factors: Array, normals: Array, areas: Array, breadths: Array, soil: SoilStrength
) -> Array:
    """Return the greatest push [N] of the soil on each of m samples of the outer faces.

    The soil stands `overlaps` above a sample [m], which has sunk in by `sinkages` since it met the soil [m]; `factors`
    are `ground_factors`. Normals (m, 3), areas [m2] and shares in the breadth of the footing [m] as in `OuterFaces`.
    """
    limits = np.zeros(len(overlaps))
    contacts = np.minimum(1.0, overlaps / PLATE_THICKNESS_M)
    footing = np.sum(breadths * contacts * np.maximum(0.0, -normals[:, 2]))
    for k in range(len(overlaps)):
        if overlaps[k] > 0.0:
            upright = math.sqrt(normals[k, 0] ** 2 + normals[k, 1] ** 2)
            _, cohesion, surcharge = table_row(soil.table, math.atan2(upright, normals[k, 2]))
            passive = (soil.unit_weight * overlaps[k] * surcharge + soil.cohesion * cohesion) * math.cos(
                soil.steel_friction
            )
            capacity = (
                soil.unit_weight * (overlaps[k] * soil.bearing_depth + 0.5 * footing * soil.bearing_width)
                + soil.cohesion * soil.bearing_cohesion
            )
            bearing = factors[k] * min(SINKAGE_MODULUS * sinkages[k] ** SINKAGE_EXPONENT, capacity)
            downward = max(0.0, -normals[k, 2]) ** 2
            limits[k] = areas[k] * contacts[k] * (passive + downward * (bearing - passive))
    return limits


class PlatePressure:
    """Pressure on the plates of one bucket, which remembers how far each has sunk in."""

    def __init__(self, faces: OuterFaces, soil: SoilStrength) -> None:
        self._faces = faces
        self._soil = soil
        self._sinkages: Array = np.zeros(len(faces.areas_m2))

    def patches(self, heights_m: Array, grid: Grid, tool: Tool, floor_depth_m: float, dt_s: float) -> Patches:
        """Return what the ground can hold against the plates; arguments as in `SoilResistance.react`."""
        faces = self._faces
        arms = faces.points_t @ tool.rotation_w.T
        normals = faces.normals_t @ tool.rotation_w.T
        points = tool.position_w + arms
        raised = points + np.array([0.0, 0.0, floor_depth_m])
        overlaps = plate_overlaps(heights_m, grid, raised, normals)
        velocities = tool.linear_velocity_w + np.cross(tool.angular_velocity_w, arms)
        sunk = self._sinkages + dt_s * np.einsum("ij,ij->i", velocities, normals)
        self._sinkages = np.where(overlaps > 0.0, np.maximum(0.0, sunk), 0.0)
        factors = ground_factors(heights_m, grid, raised)
        sizes = faces.areas_m2, faces.breadths_m
        limits = plate_limits(overlaps, self._sinkages, factors, normals, *sizes, self._soil)
        return Patches.alike(points, -normals, limits, math.tan(self._soil.steel_friction), PatchKind.PRESSURE)
