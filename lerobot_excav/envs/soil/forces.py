"""Digging resistance: what the soil can hold against a bucket at its present pose.

Three kinds of patches (`PatchKind`): the wedge before each lateral slice of the cutting edge, the resistance of its
blunt front, and the pressure on the outer faces of the plates. Their limits depend on pose, load and ground, and on how
far plates have been pressed down, not on the direction of motion: that decides how much of them acts, see `patches`.
"""

import math
from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.envs.soil.arrays import Array, Level
from lerobot_excav.envs.soil.earthmoving import blunt_edge_factor, failure_table
from lerobot_excav.envs.soil.height_field import Grid
from lerobot_excav.envs.soil.parameters import SoilParameters
from lerobot_excav.envs.soil.patches import Patches, PatchKind
from lerobot_excav.envs.soil.pressure import PlatePressure
from lerobot_excav.envs.soil.tool import Reaction, Tool, ToolGeometry
from lerobot_excav.envs.soil.wedge import SoilStrength, edge_limits


def bearing_factors(friction_rad: float) -> tuple[float, float, float]:
    """Return the bearing capacity factors of cohesion, depth and width (Prandtl-Reissner, Vesic 1973)."""
    depth = math.exp(math.pi * math.tan(friction_rad)) * math.tan(math.pi / 4 + friction_rad / 2) ** 2
    return ((depth - 1.0) / math.tan(friction_rad), depth, 2.0 * (depth + 1.0) * math.tan(friction_rad))


def soil_strength(parameters: SoilParameters) -> SoilStrength:
    """Return what the force model knows of a soil."""
    p = parameters
    cohesion, depth, width = bearing_factors(p.friction_angle_rad)
    return SoilStrength(
        unit_weight=p.density_kg_m3 * GRAVITY_M_S2,
        friction=p.friction_angle_rad,
        steel_friction=p.steel_friction_angle_rad,
        cohesion=p.cohesion_pa,
        bearing_cohesion=cohesion,
        bearing_depth=depth,
        bearing_width=width,
        blunt=blunt_edge_factor(p.friction_angle_rad, p.steel_friction_angle_rad),
        penetration_scale=p.penetration_scale,
        table=failure_table(p.friction_angle_rad, p.steel_friction_angle_rad),
    )


def blade_force_n(parameters: SoilParameters, depth_m: float, rake_rad: float, width_m: float) -> Array:
    """Return the force on a flat blade that is pushed through level soil, by the kernels that the bucket uses.

    The blade is thin, and no heap lies before it. The depth is that of the edge below the surface,
    the rake counts from the horizontal. Returns the backward and the downward part [N], shape (2,).
    """
    p = parameters
    spacing = depth_m / 100.0
    level: Array = np.full((2, 2), depth_m)
    grid = Grid.centred((2, 2), 2.0 * spacing, 2.0 * spacing)
    rakes, ahead = (rake_rad, rake_rad), (1.0, 0.0)
    wedges = edge_limits(level, level, grid, np.zeros((1, 3)), rakes, ahead, width_m, 0.0, soil_strength(p))
    angle = rake_rad + p.steel_friction_angle_rad
    return np.asarray(wedges[0] * np.array([math.sin(angle), math.cos(angle)]))


CLEAR_M = 0.1
"""A bucket whose inside stays this far above all soil touches none; its plates are thinner (PLATE_THICKNESS_M)."""


class _Edge(NamedTuple):
    """The cutting edge of a bucket in slices; all in the frame of the tool."""

    along_t: Array  # (3,) unit vector from the edge along the bottom plate
    opening_t: Array  # (3,) unit vector from the edge to the lip
    inwards_t: Array  # (3,) unit normal of the bottom plate, into the bucket
    middles_t: Array  # (n, 3) middles of the slices [m]

    @classmethod
    def of(cls, geometry: ToolGeometry, slices: int) -> "_Edge":
        """Cut the edge of a bucket into so many slices."""
        first = geometry.profile_t[0]
        lateral = ((np.arange(slices) + 0.5) / slices - 0.5) * geometry.inner_width_m
        return cls(
            _way(first, geometry.profile_t[1]),
            _way(first, geometry.profile_t[-1]),
            -geometry.planes_t[1, :3],
            np.stack([np.full_like(lateral, first[0]), lateral, np.full_like(lateral, first[1])], axis=1),
        )


class SoilResistance:
    """Reaction of the soil to a bucket.

    Args:
        parameters: The soil.
        slices: Lateral slices of the cutting edge; the plates have half as many rows of patches.
    """

    def __init__(self, parameters: SoilParameters, slices: int) -> None:
        self._slices = slices
        self._soil = soil_strength(parameters)
        self.forget()

    def forget(self) -> None:
        """Take note that the tool is gone, or that the ground is new."""
        self._pressure: PlatePressure | None = None
        self._edge: _Edge | None = None
        self._geometry: ToolGeometry | None = None

    def react(
        self,
        heights_m: Array,
        weighed_heights_m: Array,
        grid: Grid,
        tool: Tool,
        floor_depth_m: float,
        dt_s: float,
        payload_mass_kg: float,
        payload_com_t: Array,
    ) -> Reaction:
        """Return what the soil does to the tool where it is now.

        To be called in every step: how far the plates have sunk in follows from one call to the next, `dt_s` ago.
        Heights (nx, ny) count from the rigid floor, which lies `floor_depth_m` below z = 0; the weighed ones include
        loose soil on the ground, which the wedge must lift too. The payload is what the reaction shall say.
        """
        corners_w = tool.position_w + tool.geometry.corners_t @ tool.rotation_w.T
        if corners_w[:, 2].min() + floor_depth_m > weighed_heights_m.max() + CLEAR_M:
            self.forget()
            return Reaction.free(payload_mass_kg, payload_com_t)
        ground = heights_m, weighed_heights_m, grid, tool, floor_depth_m
        pressure, edge = self._parts(tool.geometry)
        ahead = _ahead(tool.rotation_w, edge)
        patches = Patches.joined(
            self._wedges(*ground, edge, ahead, GRAVITY_M_S2 * payload_mass_kg),
            *pressure.patches(*ground, ahead, dt_s),
        )
        force, torque = patches.wrench(tool.position_w, tool.linear_velocity_w, tool.angular_velocity_w)
        return Reaction(
            force_w_n=force,
            torque_w_nm=torque,
            payload_mass_kg=payload_mass_kg,
            payload_com_t=payload_com_t,
            patches=patches,
        )

    def _parts(self, geometry: ToolGeometry) -> tuple[PlatePressure, _Edge]:
        if self._pressure and self._edge and self._geometry and self._geometry.has_shape_of(geometry):
            return self._pressure, self._edge
        self._geometry, self._edge = geometry, _Edge.of(geometry, self._slices)
        self._pressure = PlatePressure(geometry, max(2, self._slices // 2), self._soil)
        return self._pressure, self._edge

    def _wedges(
        self,
        heights_m: Array,
        weighed_heights_m: Array,
        grid: Grid,
        tool: Tool,
        floor_depth_m: float,
        edge: _Edge,
        ahead: Level,
        load_n: float,
    ) -> Patches:
        """Return the wedges before the slices of the edge, with a load of some weight in the bucket."""
        rotation = tool.rotation_w
        across = rotation @ edge.inwards_t
        edges = tool.position_w + edge.middles_t @ rotation.T
        raised = edges + np.array([0.0, 0.0, floor_depth_m])
        rakes = _rake(rotation @ edge.along_t, ahead), _rake(rotation @ edge.opening_t, ahead)
        width = float(tool.geometry.inner_width_m)
        wedges = edge_limits(heights_m, weighed_heights_m, grid, raised, rakes, ahead, width, load_n, self._soil)
        steel = self._soil.steel_friction
        # The wedge stands at the angle of friction to the plate: its normal part here, the rest as friction.
        pushes = wedges * math.cos(steel)
        normals = np.broadcast_to(-across, edges.shape)
        return Patches.alike(edges, normals, pushes, math.tan(steel), PatchKind.WEDGE)


def _way(start_t: Array, end_t: Array) -> Array:
    """Return the unit vector (3,) from one point (x, z) of the profile to another."""
    way = np.array([end_t[0] - start_t[0], 0.0, end_t[1] - start_t[1]])
    return np.asarray(way / np.linalg.norm(way))


def _rake(upwards: Array, ahead: Level) -> float:
    """Return the angle of a line that rises from the edge, from the horizontal behind it [rad]."""
    return math.atan2(upwards[2], -(upwards[0] * ahead[0] + upwards[1] * ahead[1]))


def _ahead(rotation: Array, edge: _Edge) -> Level:
    """Return the level direction half-way between the line of the bottom plate and the outside of the opening."""
    x, y, _ = (-(rotation @ edge.along_t + rotation[:, 2])).tolist()
    length = float(np.hypot(x, y))
    return (x / length, y / length) if length >= 1e-9 else (1.0, 0.0)
