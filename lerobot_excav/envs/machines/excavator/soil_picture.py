"""Pictures of the soil: skins that follow its surface, the load in the bucket, and parcels outside of it."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator import surfaces
from lerobot_excav.envs.machines.excavator.constants import TICK_S
from lerobot_excav.envs.machines.excavator.grains import Grains
from lerobot_excav.envs.machines.excavator.interpolation import resampled, smooth
from lerobot_excav.envs.machines.excavator.load_picture import LoadPicture
from lerobot_excav.envs.machines.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.machines.excavator.settled import settled_grains
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil import Soil

_THINNEST_BOX_SOIL_M = 0.006
"""The soil in the box is drawn this much too low: where it is thinner, the floor hides it, and its edge is a smooth
contour instead of whole triangles that come and go."""
_LOAD_GRAIN = 0.6
"""Drawn over true radius of parcels that stand out of the load, which would else bristle (kind: tuned by eye)."""


class SoilPicture:
    """Keeps the skins of a model equal to a soil.

    Args:
        model: Made from `mjcf.build_spec`: the machine's own, or one for other pictures.
        machine: The machine, whose bucket carries the load.
        terrain_spacing_m: With which the model was built.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        machine: ExcavatorMachine,
        *,
        terrain_spacing_m: float = surfaces.POLICY_SPACING_M,
    ) -> None:
        self._model = model
        self._machine = machine
        self._terrain_grid = surfaces.terrain_grid(terrain_spacing_m)
        self._box_grid = surfaces.box_grid(machine.container)
        self._grains = Grains(model)
        self._load = LoadPicture(model)
        # Several pictures of one model write the same skins: what is shown is known of the model, not of the picture.
        self._shown = machine.soil_shown if model is machine.model else dict[str, NDArray[np.float64]]()

    def update(self, soil: Soil, start_heights_m: NDArray[np.float64]) -> None:
        """Move the vertices of all skins to where the soil is now, if it has moved.

        Heights (nx, ny) [m] at the start of the episode tell where soil has come to rest since.
        """
        self._update_terrain(soil)
        self._update_box(soil)
        self._update_loose(soil, start_heights_m)

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
        surface = smooth(resampled(boxed, self._box_grid.shape[:2])) - _THINNEST_BOX_SOIL_M
        vertices = surfaces.skin_vertices(self._box_grid, surface)
        surfaces.write_skin(self._model, surfaces.BOX_SOIL_SKIN, vertices)

    def _update_loose(self, soil: Soil, start_heights_m: NDArray[np.float64]) -> None:
        """Show the parcels: a skin for the load, grains for those that stand out of it, all others and where they rest.

        Where they rest it is one handful for every column.
        """
        # The soil steps first and the machine follows: a tick ahead, the parcels are where the bucket is now.
        positions_w = soil.parcel_positions_w + TICK_S * soil.parcel_velocities_w
        radii, is_load = soil.parcel_radii_m, soil.parcel_is_load
        tool = self._machine.tool()
        settled = settled_grains(soil, start_heights_m, self._machine.container)
        places = np.concatenate(
            [positions_w.ravel(), is_load, tool.position_w, tool.rotation_w.ravel(), settled.positions_w.ravel()]
        )
        if not self._is_new("loose", places):
            return
        places_t = (positions_w[is_load] - tool.position_w) @ tool.rotation_w
        is_seen = ~is_load
        is_seen[is_load] = self._load.show(places_t, radii[is_load])
        seen_radii = np.where(is_load, _LOAD_GRAIN, 1.0)[is_seen] * radii[is_seen]
        self._grains.show(
            np.concatenate([positions_w[is_seen], settled.positions_w]),
            np.concatenate([seen_radii, settled.radii_m]),
            np.concatenate([np.arange(len(seen_radii)), settled.columns]),
        )
