"""Pictures of the work cell for people: a model of their own, in which the arm has a body and the table an edge.

Policies see nothing of it: the cell's own model stays as it is, and nothing is built before the first picture.
"""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.camera_pictures import CameraPictures, visible_groups
from lerobot_excav.envs.machines.fr5 import layout
from lerobot_excav.envs.machines.fr5.dressing import PEOPLE_GROUP
from lerobot_excav.envs.machines.fr5.features import VIEWS
from lerobot_excav.envs.machines.fr5.geoms import BLOCK, CELL
from lerobot_excav.envs.machines.fr5.room import HIDDEN_GROUP, TABLE_TOP, build_room, halo
from lerobot_excav.envs.machines.fr5.workcell import Workcell
from lerobot_excav.envs.machines.simulator import mujoco

COMMANDED_RGB = (0.10, 0.90, 0.90)
SHOWN_RGB = (0.16, 0.43, 0.92)
"""Colours of the frames of the block that is commanded, and of the one that a policy was told to take."""

_MAX_GEOMS = 200
_LAMP_DISTANCE_M = 3.0  # farther than anything that casts a shadow


class WorkcellView:
    """Draws a work cell for people, as it is when a picture is asked for.

    `render` raises `ConfigurationError` if there is no such camera, and `RenderingError` if no graphics context can be
    made, or the view was closed.

    Args:
        workcell: The cell.
        height: Picture height H [px].
        width: Picture width W [px].
    """

    def __init__(self, workcell: Workcell, *, height: int, width: int) -> None:
        self._workcell = workcell
        self._model = build_room()
        self._data = mujoco.MjData(self._model)
        self._pictures = CameraPictures(
            self._model, self._data, cameras=VIEWS, height=height, width=width, max_geoms=_MAX_GEOMS,
            effects=(mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_FOG),
        )  # fmt: skip
        self._groups = visible_groups(CELL.group, BLOCK.group, PEOPLE_GROUP)

    def mark(self, commanded: int, *, shown: int | None = None) -> None:
        """Frame the block that is commanded, and the one that a policy was shown in its place."""
        colours = {commanded: COMMANDED_RGB} | ({} if shown is None else {shown: SHOWN_RGB})
        for i in range(layout.BLOCK_COUNT):
            rods = [self._model.geom(name).id for name in halo(i)]
            self._model.geom_group[rods] = PEOPLE_GROUP if i in colours else HIDDEN_GROUP
            self._model.geom_rgba[rods, :3] = colours.get(i, COMMANDED_RGB)

    def render(self, camera: str) -> NDArray[np.uint8]:
        """Return the colour picture (H, W, 3), uint8, of one of `features.VIEWS`."""
        self._copy_colours()
        self._data.qpos[:] = self._workcell.data.qpos
        mujoco.mj_fwdPosition(self._model, self._data)
        return self._pictures.colour(camera, self._groups)

    def close(self) -> None:
        """Free the graphics context; the view cannot be used afterwards."""
        self._pictures.close()

    def _copy_colours(self) -> None:
        """Take over the look of the scene, which the cell's model has."""
        theirs, ours = self._workcell.model, self._model
        for i in range(layout.BLOCK_COUNT):
            ours.geom_rgba[ours.geom(f"block{i}").id] = theirs.geom_rgba[theirs.geom(f"block{i}").id]
        ours.geom_rgba[ours.geom(TABLE_TOP).id] = theirs.geom_rgba[theirs.geom("table").id]
        lamp, own_lamp = theirs.light("lamp").id, ours.light("lamp").id
        direction = theirs.light_dir[lamp] / np.linalg.norm(theirs.light_dir[lamp])
        ours.light_dir[own_lamp], ours.light_diffuse[own_lamp] = direction, theirs.light_diffuse[lamp]
        # Only what is before a light casts shadows, whatever kind of light it is.
        ours.light_pos[own_lamp] = ours.stat.center - _LAMP_DISTANCE_M * direction
