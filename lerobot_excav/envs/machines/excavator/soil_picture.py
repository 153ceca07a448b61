"""Pictures of the soil: skins that follow its surface, the load in the bucket, and parcels outside of it."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator import surfaces
from lerobot_excav.envs.machines.excavator.constants import TICK_S
from lerobot_excav.envs.machines.excavator.grains import Grains
from lerobot_excav.envs.machines.excavator.load_picture import LoadPicture
from lerobot_excav.envs.machines.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil import Soil

_HIDDEN_M = -0.03
_LEAST_BOX_SOIL_M = 0.005
_LOAD_GRAIN = 0.6
"""Drawn over true radius of parcels that stand out of the load, which would else bristle (kind: tuned by eye)."""


class SoilPicture:
    """Keeps the skins in a machine's model equal to a soil."""

    def __init__(self, machine: ExcavatorMachine) -> None:
        self._model: mujoco.MjModel = machine.model
        self._machine = machine
        self._terrain_grid = surfaces.terrain_grid()
        self._box_grid = surfaces.box_grid(machine.container)
        self._grains = Grains(machine.model)
        self._load = LoadPicture(machine.model)
        self._shown: dict[str, NDArray[np.float64]] = {}

    def update(self, soil: Soil) -> None:
        """Move the vertices of all skins to where the soil is now, if it has moved."""
        self._update_terrain(soil)
        self._update_box(soil)
        self._update_loose(soil)

    def _is_new(self, part: str, values: NDArray[np.float64]) -> bool:
        """Tell whether a part of the soil is not what is shown, and note that it will be."""
        if part in self._shown and np.array_equal(values, self._shown[part]):
            return False
        self._shown[part] = values.copy()
        return True

    def _update_terrain(self, soil: Soil) -> None:
        if not self._is_new("terrain", soil.heights_m):
            return
        # A hair inside the border, beyond which the soil reports bare floor.
        surface = soil.height_at((1.0 - 1e-9) * self._terrain_grid)
        vertices = surfaces.skin_vertices(self._terrain_grid, surface)
        surfaces.write_skin(self._model, surfaces.TERRAIN_SKIN, vertices)

    def _update_box(self, soil: Soil) -> None:
        boxed = soil.container_heights_m
        if boxed is None or not self._is_new("box", boxed):
            return
        surface = _resampled(boxed, self._box_grid.shape[:2])
        # Bare floor shows where there is no soil, instead of two surfaces at one height.
        surface = np.where(surface < _LEAST_BOX_SOIL_M, _HIDDEN_M, surface)
        vertices = surfaces.skin_vertices(self._box_grid, surface)
        surfaces.write_skin(self._model, surfaces.BOX_SOIL_SKIN, vertices)

    def _update_loose(self, soil: Soil) -> None:
        """Show the parcels: a skin for the load, grains for those that stand out of it and for all others."""
        # The soil steps first and the machine follows: a tick ahead, the parcels are where the bucket is now.
        positions_w = soil.parcel_positions_w + TICK_S * soil.parcel_velocities_w
        radii, is_load = soil.parcel_radii_m, soil.parcel_is_load
        tool = self._machine.tool()
        places = np.concatenate([positions_w.ravel(), is_load, tool.position_w, tool.rotation_w.ravel()])
        if not self._is_new("loose", places):
            return
        places_t = (positions_w[is_load] - tool.position_w) @ tool.rotation_w
        is_seen = ~is_load
        is_seen[is_load] = self._load.show(places_t, radii[is_load])
        self._grains.show(positions_w[is_seen], np.where(is_load, _LOAD_GRAIN, 1.0)[is_seen] * radii[is_seen])


def _resampled(heights: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return heights of cells, bilinear between their centres, at the vertices of a grid over the same rectangle."""
    along_x, along_y = (_interpolation(cells, n) for cells, n in zip(heights.shape, shape, strict=True))
    return np.asarray(along_x @ heights @ along_y.T)


@cache
def _interpolation(cells: int, vertices: int) -> NDArray[np.float64]:
    """Return the weights (vertices, cells) of linear interpolation between the centres of cells that tile a line."""
    centres = (np.arange(cells) + 0.5) / cells
    points = np.linspace(0.0, 1.0, vertices)
    return np.stack([np.interp(points, centres, unit) for unit in np.eye(cells)], axis=1)
