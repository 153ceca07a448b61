"""Camera pictures of the worksite: colour, depth and the terrain point behind every pixel."""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.excavator.bodywork import LOOSE_SOIL_GROUP, MACHINE_GROUP, SURROUNDINGS_GROUP
from lerobot_excav.envs.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.excavator.soil_picture import SoilPicture
from lerobot_excav.envs.offscreen import create_context
from lerobot_excav.envs.soil import Soil
from lerobot_excav.errors import RenderingError, require, require_choice

CAMERAS = ("main", "cab", "overview", "side")
_MAX_GEOMS = 300


class WorksiteRenderer:
    """Draws a machine and its soil into images.

    The graphics context is made with the first picture, in the process that asks for it.

    Args:
        machine: The machine; its current state is drawn.
        height: Image height H [px].
        width: Image width W [px].
    """

    def __init__(self, machine: ExcavatorMachine, *, height: int, width: int) -> None:
        require(height > 0 and width > 0, f"height={height}, width={width} must be positive")
        self._machine = machine
        self._height, self._width = height, width
        self._soil_picture = SoilPicture(machine)
        self._context: Any = None
        self._mjr: Any = None
        self._scene: Any = None
        self._closed = False
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._all = _visible_groups(SURROUNDINGS_GROUP, MACHINE_GROUP, LOOSE_SOIL_GROUP)
        self._without_machine = _visible_groups(SURROUNDINGS_GROUP)

    def render(self, camera: str, soil: Soil) -> NDArray[np.uint8]:
        """Return a colour picture (H, W, 3), uint8.

        Args:
            camera: `main`, `cab`, `overview` or `side`.
            soil: The soil to draw.

        Raises:
            ConfigurationError: There is no such camera.
            RenderingError: No graphics context can be made, or the renderer was closed.
        """
        self._draw(camera, soil, self._all)
        image = np.empty((self._height, self._width, 3), np.uint8)
        mujoco.mjr_readPixels(image, None, self._viewport, self._mjr)
        return image[::-1].copy()

    def depth(self, camera: str, soil: Soil) -> NDArray[np.float32]:
        """Return the distance along the optical axis (H, W) [m], float32; the far plane where nothing is.

        Arguments and errors are those of `render`.
        """
        self._draw(camera, soil, self._all)
        return self._read_depth().astype(np.float32)

    def terrain_points_w(self, soil: Soil) -> NDArray[np.float64]:
        """Return the point of the soil surface that every pixel of `main` sees once the machine is gone.

        Args:
            soil: The soil to look at.

        Returns:
            World points (H, W, 3) [m]; NaN where the pixel shows no soil of the dig area.

        Raises:
            RenderingError: No graphics context can be made, or the renderer was closed.
        """
        self._draw("main", soil, self._without_machine)
        points_w = self._unproject("main", self._read_depth())
        half_x, half_y = 0.5 * np.asarray(self._machine.terrain_shape_m)
        inside = (np.abs(points_w[..., 0]) <= half_x) & (np.abs(points_w[..., 1]) <= half_y)
        points_w[~inside] = np.nan
        return points_w

    def close(self) -> None:
        """Free the graphics context; the renderer cannot be used afterwards."""
        self._closed = True
        if self._context is not None:
            self._context.make_current()
            self._mjr.free()
            self._context.free()
            self._context = self._mjr = self._scene = None

    @property
    def _viewport(self) -> Any:
        return mujoco.MjrRect(0, 0, self._width, self._height)

    def _open(self) -> None:
        if self._closed:
            raise RenderingError("the renderer was closed; make a new one for more pictures")
        model = self._machine.model
        model.vis.global_.offwidth, model.vis.global_.offheight = self._width, self._height
        self._context = create_context(self._width, self._height)
        self._mjr = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
        self._mjr.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._mjr)
        self._scene = mujoco.MjvScene(model, maxgeom=_MAX_GEOMS)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = False

    def _draw(self, camera: str, soil: Soil, options: Any) -> None:
        require_choice("camera", camera, CAMERAS)
        if self._context is None:
            self._open()
        self._context.make_current()
        model, data = self._machine.model, self._machine.data
        self._soil_picture.update(soil)
        self._camera.fixedcamid = model.camera(camera).id
        mujoco.mjv_updateScene(
            model, data, options, None, self._camera, mujoco.mjtCatBit.mjCAT_ALL, self._scene
        )
        mujoco.mjr_render(self._viewport, self._scene, self._mjr)

    def _read_depth(self) -> NDArray[np.float64]:
        """Return the distance of the drawn scene along the optical axis (H, W) [m]."""
        buffer = np.empty((self._height, self._width), np.float32)
        mujoco.mjr_readPixels(None, buffer, self._viewport, self._mjr)
        visual = self._machine.model.vis.map
        near, far = (d * self._machine.model.stat.extent for d in (visual.znear, visual.zfar))
        # The buffer holds 1 at the near plane and 0 at the far one, hyperbolic in between.
        return np.asarray(near * far / (near + buffer[::-1].astype(np.float64) * (far - near)))

    def _unproject(self, camera: str, depth: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the world points (H, W, 3) at given distances along the optical axis."""
        model, data = self._machine.model, self._machine.data
        index = model.camera(camera).id
        focal_px = 0.5 * self._height / np.tan(0.5 * np.radians(model.cam_fovy[index]))
        row, column = np.indices(depth.shape)
        right = (column + 0.5 - 0.5 * self._width) / focal_px
        up = (0.5 * self._height - row - 0.5) / focal_px
        rays = np.stack([right, up, -np.ones_like(right)], axis=-1)
        axes = data.cam_xmat[index].reshape(3, 3)
        return np.asarray(data.cam_xpos[index] + (depth[..., None] * rays) @ axes.T)


def _visible_groups(*groups: int) -> Any:
    """Return drawing options that show some groups of geoms, skins and tendons and nothing else."""
    options = mujoco.MjvOption()
    for shown in (options.geomgroup, options.tendongroup, options.skingroup):
        shown[:] = 0
        shown[list(groups)] = 1
    options.sitegroup[:] = 0
    return options
