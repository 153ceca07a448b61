"""Camera pictures of the work cell, and the pixels that each block covers."""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.fr5 import layout
from lerobot_excav.envs.fr5.geoms import ARM
from lerobot_excav.envs.fr5.workcell import Workcell
from lerobot_excav.envs.offscreen import create_context
from lerobot_excav.errors import RenderingError, require, require_choice

_MAX_GEOMS = 100


class WorkcellRenderer:
    """Draws a work cell into images; the graphics context is made with the first picture.

    Args:
        workcell: The cell; its current state is drawn.
        height: Image height H [px].
        width: Image width W [px].
    """

    def __init__(self, workcell: Workcell, *, height: int, width: int) -> None:
        require(height > 0 and width > 0, f"height={height}, width={width} must be positive")
        self._workcell = workcell
        self._size = (height, width)
        self._context: Any = None
        self._closed = False
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._all = mujoco.MjvOption()
        self._without_arm = mujoco.MjvOption()
        self._without_arm.geomgroup[ARM.group] = 0

    def render(self, camera: str) -> NDArray[np.uint8]:
        """Return a colour picture (H, W, 3), uint8.

        Args:
            camera: One of `layout.CAMERAS`.

        Raises:
            ConfigurationError: There is no such camera.
            RenderingError: No graphics context can be made, or the renderer was closed.
        """
        return self._draw(camera, self._all)

    def block_masks(self) -> NDArray[np.uint8]:
        """Return the pixels of `main` that show each block once the arm is gone, (4, H, W, 3) of {0, 255}, uint8.

        Raises:
            RenderingError: No graphics context can be made, or the renderer was closed.
        """
        self._open()
        flags = self._scene.flags
        flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = True
        try:
            picture = self._draw("main", self._without_arm).astype(np.int64)
        finally:
            flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = False
        # Colour n + 1 is the n-th drawn geom, 0 the background.
        number = picture @ np.array([1, 1 << 8, 1 << 16]) - 1
        shown = np.full(self._size, -1)
        for drawn in self._scene.geoms[: self._scene.ngeom]:
            if drawn.objtype == mujoco.mjtObj.mjOBJ_GEOM:
                shown[number == drawn.segid] = drawn.objid
        model = self._workcell.model
        ids = [model.geom(f"block{i}").id for i in range(layout.BLOCK_COUNT)]
        return np.stack([np.repeat((shown == i)[..., None], 3, axis=-1) for i in ids]).astype(np.uint8) * 255

    def close(self) -> None:
        """Free the graphics context; the renderer cannot be used afterwards."""
        self._closed = True
        if self._context is not None:
            self._context.make_current()
            self._mjr.free()
            self._context.free()
            self._context = None

    def _open(self) -> None:
        if self._closed:
            raise RenderingError("the renderer was closed; make a new one for more pictures")
        if self._context is not None:
            return
        height, width = self._size
        model = self._workcell.model
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._context = create_context(width, height)
        self._mjr = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._mjr)
        self._scene = mujoco.MjvScene(model, maxgeom=_MAX_GEOMS)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = False

    def _draw(self, camera: str, options: Any) -> NDArray[np.uint8]:
        require_choice("camera", camera, tuple(layout.CAMERAS))
        self._open()
        self._context.make_current()
        model, data = self._workcell.model, self._workcell.data
        self._camera.fixedcamid = model.camera(camera).id
        mujoco.mjv_updateScene(
            model, data, options, None, self._camera, mujoco.mjtCatBit.mjCAT_ALL, self._scene
        )
        height, width = self._size
        viewport = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(viewport, self._scene, self._mjr)
        image = np.empty((height, width, 3), np.uint8)
        mujoco.mjr_readPixels(image, None, viewport, self._mjr)
        return image[::-1].copy()
