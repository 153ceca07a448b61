"""Pictures of the soil: skins that follow its surface, plus the load in the bucket and flying parcels."""

from itertools import pairwise
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.excavator import surfaces
from lerobot_excav.envs.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.soil import Soil

_HIDDEN_M = -0.03
_LEAST_BOX_SOIL_M = 0.005
_LOAD_SKIN_M = 0.03
_STRAIGHT_RAD = 0.1
_UPRIGHT = np.eye(3).ravel()


class SoilPicture:
    """Keeps the model's soil skins equal to a soil, and draws its moving parts into a scene.

    Args:
        machine: The machine whose model holds the skins.
    """

    def __init__(self, machine: ExcavatorMachine) -> None:
        self._model = machine.model
        self._machine = machine
        self._terrain_grid = surfaces.terrain_grid(machine.terrain_shape_m)
        self._box_grid = surfaces.box_grid(machine.container)
        self._terrain_shown: NDArray[np.float64] | None = None
        self._box_shown: NDArray[np.float64] | None = None
        self._soil_material = self._model.material("soil").id

    def update_skins(self, soil: Soil) -> None:
        """Move the vertices of the skins to the soil's surface, where it has changed."""
        terrain = soil.heights_m
        if self._terrain_shown is None or not np.array_equal(terrain, self._terrain_shown):
            self._terrain_shown = terrain.copy()
            # A hair inside the border, beyond which the soil reports bare floor.
            surface = soil.height_at((1.0 - 1e-9) * self._terrain_grid)
            self._write(surfaces.TERRAIN_SKIN, surfaces.skin_vertices(self._terrain_grid, surface))
        boxed = soil.container_heights_m
        if boxed is not None and (self._box_shown is None or not np.array_equal(boxed, self._box_shown)):
            self._box_shown = boxed.copy()
            surface = _resampled(boxed, self._box_grid.shape[:2])
            # Bare floor shows where there is no soil, instead of two surfaces at one height.
            surface = np.where(surface < _LEAST_BOX_SOIL_M, _HIDDEN_M, surface)
            self._write(surfaces.BOX_SOIL_SKIN, surfaces.skin_vertices(self._box_grid, surface))

    def add_moving_soil(self, scene: mujoco.MjvScene, soil: Soil) -> None:
        """Append the load in the bucket and the flying parcels to a scene."""
        self._add_load(scene, soil)
        size = np.full(3, soil.parcel_radius_m)
        for position in soil.parcel_positions_w[: scene.maxgeom - scene.ngeom]:
            self._add_geom(scene, mujoco.mjtGeom.mjGEOM_SPHERE, size, position, _UPRIGHT)

    def _add_load(self, scene: mujoco.MjvScene, soil: Soil) -> None:
        """Append one slab below every straight piece of the load's free surface, as wide as the bucket."""
        surface = _corners(np.asarray(soil.payload_surface_t))
        tool = self._machine.tool()
        half_width = 0.5 * tool.geometry.inner_width_m
        for start, end in pairwise(surface):
            middle = 0.5 * (start + end)
            # A heap stands out of the opening (z < 0): there the slab reaches down to it and shows the heap's side.
            half_thickness = 0.5 * (_LOAD_SKIN_M + max(0.0, -middle[1]))
            length = float(np.hypot(*(end - start)))
            along = np.array([end[0] - start[0], 0.0, end[1] - start[1]]) / length
            into_load = np.array([-along[2], 0.0, along[0]])
            if into_load[2] < 0.0:  # the shell, and so the load, lies on the +z side of its surface
                into_load = -into_load
            center_t = np.array([middle[0], 0.0, middle[1]]) + half_thickness * into_load
            axes_t = np.column_stack([along, np.cross(into_load, along), into_load])
            self._add_geom(
                scene,
                mujoco.mjtGeom.mjGEOM_BOX,
                np.array([0.5 * length, half_width, half_thickness]),
                tool.position_w + tool.rotation_w @ center_t,
                (tool.rotation_w @ axes_t).ravel(),
            )

    def _add_geom(
        self,
        scene: mujoco.MjvScene,
        kind: Any,
        size: NDArray[np.float64],
        position_w: NDArray[np.float64],
        rotation_w: NDArray[np.float64],
    ) -> None:
        """Append one body of soil, unless the scene is full."""
        if scene.ngeom >= scene.maxgeom:
            return
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(
            geom, kind, size, position_w, rotation_w, self._model.mat_rgba[self._soil_material]
        )
        geom.matid = self._soil_material
        scene.ngeom += 1

    def _write(self, skin: str, vertices: NDArray[np.float32]) -> None:
        index = self._model.skin(skin).id
        start = self._model.skin_vertadr[index]
        self._model.skin_vert[start : start + len(vertices)] = vertices


def _corners(polyline: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the ends of a polyline's straight pieces: points at which its direction has turned."""
    if len(polyline) < 2:
        return polyline[:0]
    steps = np.diff(polyline, axis=0)
    angles = np.arctan2(steps[:, 1], steps[:, 0])
    kept, reference = [0], angles[0]
    for i, angle in enumerate(angles):
        if abs(np.angle(np.exp(1j * (angle - reference)))) > _STRAIGHT_RAD:
            kept.append(i)
            reference = angle
    kept.append(len(polyline) - 1)
    return polyline[kept]


def _resampled(heights: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the nearest cell's height at every vertex of a grid that spans the same rectangle."""
    rows, columns = (
        np.minimum((np.linspace(0.0, 1.0, n) * cells).astype(int), cells - 1)
        for n, cells in zip(shape, heights.shape, strict=True)
    )
    return heights[np.ix_(rows, columns)]
