"""Picture of the soil in the bucket: a skin over the opening that lies on the carried parcels.

Hundreds of drawn parcels would look like a load of balls. The skin turns them into soil; only parcels that stand out of
it are drawn besides.
"""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator import surfaces
from lerobot_excav.envs.machines.excavator.bodywork import HIDDEN_GROUP, LOOSE_SOIL_GROUP
from lerobot_excav.envs.machines.excavator.interpolation import smooth
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil.plates import PLATE_THICKNESS_M

LOAD_SKIN = "load"

_SPACING_M = 0.06
# In radii of a parcel (kind: tuned by eye).
_REACH = 1.5
_SINK = 0.3


def add_load(spec: mujoco.MjSpec) -> None:
    """Add the skin, which moves with the bucket; it is not seen before `LoadPicture.show`."""
    surfaces.add_sheet(spec, LOAD_SKIN, "bucket", load_grid(), HIDDEN_GROUP)


def load_grid() -> NDArray[np.float64]:
    """Return the vertices over the opening, (nx, ny, 2) [m] in the tool frame: from lip to edge, from left to right."""
    lip, edge = const.BUCKET_PROFILE_T[-1][0], const.BUCKET_PROFILE_T[0][0]
    width = const.BUCKET_INNER_WIDTH_M
    x = np.linspace(lip, edge, round((edge - lip) / _SPACING_M) + 1)
    # Tool z points into the bucket: seen from outside, counter-clockwise is from left to right.
    y = np.linspace(0.5 * width, -0.5 * width, round(width / _SPACING_M) + 1)
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)


class LoadPicture:
    """Lays the skin that `add_load` has added to a model over the parcels in the bucket."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._skin = model.skin(LOAD_SKIN).id
        self._grid = load_grid()
        self._shell = _shell_depth(self._grid[..., 0])

    def show(self, places_t: NDArray[np.float64], radii_m: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Show parcels with centres (n, 3) [m], tool frame, and radii (n,) [m]; return which stand out of the skin."""
        self._model.skin_group[self._skin] = LOOSE_SOIL_GROUP if len(places_t) else HIDDEN_GROUP
        if len(places_t) == 0:
            return np.zeros(0, dtype=bool)
        surface = np.minimum(smooth(self._tops(places_t, radii_m)) + _SINK * radii_m.mean(), self._shell)
        vertices = surfaces.skin_vertices(self._grid, surface, foot_m=self._shell)
        surfaces.write_skin(self._model, LOAD_SKIN, vertices)
        i, j = self._nearest(places_t)
        return np.asarray(places_t[:, 2] - radii_m < surface[i, j])

    def _nearest(self, places_t: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the indices of the grid's vertices that are nearest to points."""
        first, last = self._grid[0, 0], self._grid[-1, -1]
        steps = np.array(self._grid.shape[:2]) - 1
        share = (places_t[:, :2] - first) / (last - first)
        i, j = np.clip(np.rint(share * steps), 0, steps).astype(np.intp).T
        return i, j

    def _tops(self, places_t: NDArray[np.float64], radii_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the z_t (nx, ny) [m] of the uppermost parcel at every vertex; the shell where there is none."""
        tops = self._shell.copy()
        first_i, first_j = self._nearest(places_t)
        reach = _REACH * radii_m
        for step in np.ndindex(3, 3):
            i, j = first_i + step[0] - 1, first_j + step[1] - 1
            on_grid = (i >= 0) & (i < tops.shape[0]) & (j >= 0) & (j < tops.shape[1])
            i, j = i * on_grid, j * on_grid
            aside = 1.0 - ((places_t[:, :2] - self._grid[i, j]) ** 2).sum(axis=1) / reach**2
            near = on_grid & (aside > 0.0)
            np.minimum.at(tops, (i[near], j[near]), places_t[near, 2] - radii_m[near] * np.sqrt(aside[near]))
        return tops


def _shell_depth(x_t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the z_t [m] of the middle of the bottom plates, where a skin is out of sight."""
    profile = np.array(const.BUCKET_PROFILE_T)
    bottom = profile[: int(np.argmin(profile[:, 0]))]
    depth = np.interp(x_t, bottom[::-1, 0], bottom[::-1, 1])
    return np.asarray(depth + 0.5 * PLATE_THICKNESS_M)
