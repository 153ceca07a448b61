"""Pictures of the worksite for people: a model of their own, with shadows, a horizon and a plumb line at the bucket.

Policies see nothing of it: the machine's own model stays as it is, and nothing is built before the first picture.
"""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.camera_pictures import CameraPictures, visible_groups
from lerobot_excav.envs.machines.excavator.bodywork import LOOSE_SOIL_GROUP, MACHINE_GROUP, SURROUNDINGS_GROUP
from lerobot_excav.envs.machines.excavator.features import OVERVIEW_WITH_SIDE, VIEW_CAMERAS
from lerobot_excav.envs.machines.excavator.inset import inset_size, with_inset
from lerobot_excav.envs.machines.excavator.scenery import (
    CLEAR_WALL,
    PLUMB_LINE,
    SOIL_TEXTURE,
    TERRAIN_SPACING_M,
    build_scenery,
)
from lerobot_excav.envs.machines.excavator.soil_paint import COMMANDED_RGB, SHOWN_RGB, TEXELS, Patch, SoilPaint
from lerobot_excav.envs.machines.excavator.soil_picture import SoilPicture
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.machines.simulator import mujoco

_MAX_GEOMS = 300
_DUST, _DUST_SHADE = 0.6, 0.95  # the ground around is dusted with soil, and a little darker (kind: tuned by eye)
_SUN_DISTANCE_M = 20.0  # farther than anything that casts a shadow
_LEAST_PLUMB_M = 0.05
"""Height of the bucket over the soil below which there is no line to draw [m]."""


class WorksiteView:
    """Draws a worksite for people, as it is when a picture is asked for.

    `render` raises `ConfigurationError` if there is no such camera, and `RenderingError` if no graphics context can be
    made, or the view was closed.

    Args:
        worksite: Machine, soil and target box.
        height: Picture height H [px].
        width: Picture width W [px].
    """

    def __init__(self, worksite: Worksite, *, height: int, width: int) -> None:
        self._worksite, self._inset_size = worksite, inset_size(height, width)
        self._model = build_scenery(worksite.machine.container)
        self._data = mujoco.MjData(self._model)
        self._soil_picture = SoilPicture(self._model, worksite.machine, terrain_spacing_m=TERRAIN_SPACING_M)
        self._paint = SoilPaint()
        self._painted: tuple[bytes, ...] = ()
        self._marked: tuple[Patch, ...] = ()
        self._pictures = CameraPictures(
            self._model, self._data, cameras=VIEW_CAMERAS, height=height, width=width, max_geoms=_MAX_GEOMS,
            effects=(mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_FOG),
        )  # fmt: skip
        self._all = visible_groups(SURROUNDINGS_GROUP, MACHINE_GROUP, LOOSE_SOIL_GROUP)

    def mark(self, commanded: NDArray[np.float64], *, shown: NDArray[np.float64] | None = None) -> None:
        """Tint the patch of soil that is commanded, and the one that a policy was shown in its place.

        Corners (n, 2) [m] are those of a convex patch, counter-clockwise from above.
        """
        patches = [Patch(commanded, COMMANDED_RGB)]
        self._marked = tuple(patches if shown is None else [*patches, Patch(shown, SHOWN_RGB)])

    def render(self, camera: str) -> NDArray[np.uint8]:
        """Return the colour picture (H, W, 3), uint8, of one of `features.VIEWS`."""
        self._copy_colours()
        self._paint_soil()
        self._data.qpos[:] = self._worksite.machine.data.qpos
        self._hang_plumb_line()
        mujoco.mj_fwdPosition(self._model, self._data)
        self._soil_picture.update(self._worksite.soil, self._worksite.start_heights_m)
        if camera == OVERVIEW_WITH_SIDE:
            side = self._pictures.colour("side", self._all, size=self._inset_size)
            return with_inset(self._pictures.colour("overview", self._all), side)
        return self._pictures.colour(camera, self._all)

    def close(self) -> None:
        """Free the graphics context; the view cannot be used afterwards."""
        self._pictures.close()

    def _copy_colours(self) -> None:
        """Take over the look of the scene, which the machine's model has."""
        theirs, ours = self._worksite.machine.model, self._model
        for material in range(theirs.nmat):
            name = theirs.material(material).name
            ours.mat_rgba[ours.material(name).id] = theirs.mat_rgba[material]
        ours.material(CLEAR_WALL).rgba[:3] = ours.material("box").rgba[:3]
        ground, soil = (ours.material(name).id for name in ("ground", "soil"))
        ours.mat_rgba[ground, :3] += _DUST * (_DUST_SHADE * ours.mat_rgba[soil, :3] - ours.mat_rgba[ground, :3])
        sun, own_sun = theirs.light("sun").id, ours.light("sun").id
        for values in ("light_dir", "light_diffuse", "light_specular"):
            getattr(ours, values)[own_sun] = getattr(theirs, values)[sun]
        # Only what is before a light casts shadows, whatever kind of light it is.
        ours.light_pos[own_sun] = ours.stat.center - _SUN_DISTANCE_M * ours.light_dir[own_sun]

    def _paint_soil(self) -> None:
        """Paint the texture of the dig area if soil, colours or patch are not those that it shows."""
        soil, worksite = self._worksite.soil, self._worksite
        colours = {f"{name}_rgb": self._model.material(name).rgba[:3].copy() for name in ("soil", "ground")}
        shown = tuple(
            values.tobytes()
            for values in (soil.heights_m, *colours.values(), *(patch.corners_w for patch in self._marked))
        )
        if shown == self._painted:
            return
        picture = self._paint.paint(soil.heights_m, worksite.start_heights_m, **colours, patches=self._marked)
        first = self._model.texture(SOIL_TEXTURE).adr[0]
        texels = (255.0 * picture + 0.5).astype(np.uint8)
        self._model.tex_data[first : first + 3 * TEXELS**2] = texels.ravel()
        self._pictures.send_texture(SOIL_TEXTURE)
        self._painted = shown

    def _hang_plumb_line(self) -> None:
        """Draw a line from the cutting edge down to what is below it."""
        edge_w, height_m = self._worksite.machine.cutting_edge_pos_w, max(self._worksite.bucket_height_m, 0.0)
        line, foot = (self._model.geom(name) for name in PLUMB_LINE)
        line.pos, foot.pos = edge_w - [0.0, 0.0, 0.5 * height_m], edge_w - [0.0, 0.0, height_m]
        line.size[1] = 0.5 * height_m
        for part in (line, foot):
            part.rgba[3] = float(height_m > _LEAST_PLUMB_M)
