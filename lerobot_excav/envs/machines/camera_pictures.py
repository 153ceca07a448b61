"""Pictures that the fixed cameras of a MuJoCo model take off screen: colour, distance, and what each pixel shows."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.offscreen import OffscreenContext
from lerobot_excav.envs.machines.pinhole import CameraPose, PinholeCamera
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.errors import RenderingError, require, require_choice

_EFFECTS = (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_FOG, mujoco.mjtRndFlag.mjRND_REFLECTION)


class CameraPictures:
    """Draws a model.

    All pictures share one graphics context, made with the first of them, in the process that asks for it. Threads may
    draw one after the other.

    Every method that draws takes the name of a `camera` and drawing `options` (an `MjvOption`), and raises
    `ConfigurationError` if there is no such camera, and `RenderingError` if no graphics context can be made or used, or
    the pictures were closed.

    Args:
        model: The model.
        data: Its state, drawn as it is when a picture is asked for.
        cameras: Names of the cameras that may be asked for.
        height: Image height H [px].
        width: Image width W [px].
        max_geoms: Most geoms that are drawn.
        effects: What is drawn besides shapes, colours and the sky: shadows, fog, reflections. Policies see none.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        *,
        cameras: Sequence[str],
        height: int,
        width: int,
        max_geoms: int,
        effects: Collection[Any] = (),
    ) -> None:
        require(height > 0 and width > 0, f"height={height}, width={width} must be positive")
        self._model, self._data = model, data
        self._cameras = tuple(cameras)
        self._height, self._width = height, width
        self._max_geoms = max_geoms
        self._effects = frozenset(effects)
        self._context: OffscreenContext | None = None
        self._scene: Any = None
        self._closed = False
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED

    def colour(self, camera: str, options: Any, *, size: tuple[int, int] | None = None) -> NDArray[np.uint8]:
        """Return a colour picture (H, W, 3), uint8; or one of a smaller `size` (h, w), which costs less.

        Raises:
            ConfigurationError: `size` is larger than the pictures of this renderer, or not positive.
        """
        height, width = size or (self._height, self._width)
        require(
            0 < height <= self._height and 0 < width <= self._width,
            f"size={size} is not possible; give a height from 1 to {self._height} and a width from 1 to {self._width}",
        )
        viewport = mujoco.MjrRect(0, 0, width, height)
        with self._drawn(camera, options, viewport=viewport) as mjr:
            return self._read_colour(mjr, viewport)

    def distance_m(self, camera: str, options: Any) -> NDArray[np.float64]:
        """Return the distance along the optical axis (H, W) [m]; the far plane where nothing is."""
        buffer = np.empty((self._height, self._width), np.float32)
        with self._drawn(camera, options) as mjr:
            mujoco.mjr_readPixels(None, buffer, self._viewport, mjr)
        visual = self._model.vis.map
        near, far = (d * self._model.stat.extent for d in (visual.znear, visual.zfar))
        # The buffer holds 1 at the near plane and 0 at the far one, hyperbolic in between.
        return np.asarray(near * far / (near + buffer[::-1].astype(np.float64) * (far - near)))

    def points_w(self, camera: str, options: Any) -> NDArray[np.float64]:
        """Return the point behind every pixel (H, W, 3) [m], world frame."""
        return self.pinhole(camera).points_w(self.distance_m(camera, options))

    def pinhole(self, camera: str) -> PinholeCamera:
        """Return where a camera stands now, and how it projects."""
        require_choice("camera", camera, self._cameras)
        index = self._model.camera(camera).id
        return PinholeCamera(
            position_w=np.array(self._data.cam_xpos[index]),
            axes_w=np.array(self._data.cam_xmat[index].reshape(3, 3)),
            fovy_rad=float(np.radians(self._model.cam_fovy[index])),
            height=self._height,
            width=self._width,
        )

    def geoms(self, camera: str, options: Any) -> NDArray[np.int64]:
        """Return the index in the model of the geom that every pixel shows (H, W); -1 where none is."""
        with self._drawn(camera, options, numbers=True) as mjr:
            picture = self._read_colour(mjr, self._viewport)
        # Colour n + 1 is the n-th drawn object, 0 the background.
        number = picture @ np.array([1, 1 << 8, 1 << 16]) - 1
        shown = np.full((self._height, self._width), -1)
        for drawn in self._scene.geoms[: self._scene.ngeom]:
            if drawn.objtype == mujoco.mjtObj.mjOBJ_GEOM:
                shown[number == drawn.segid] = drawn.objid
        return shown

    def send_texture(self, name: str) -> None:
        """Let the next pictures show a texture of the model as it is now, not as it was at the first of them.

        Raises:
            RenderingError: No graphics context can be made or used, or the pictures were closed.
        """
        with self._opened().bound() as mjr:
            mujoco.mjr_uploadTexture(self._model, mjr, self._model.texture(name).id)

    def close(self) -> None:
        """Free the graphics context; no picture can be taken afterwards."""
        self._closed = True
        if self._context is not None:
            self._context.free()
            self._context = self._scene = None

    @property
    def _viewport(self) -> Any:
        return mujoco.MjrRect(0, 0, self._width, self._height)

    def _opened(self) -> OffscreenContext:
        if self._closed:
            raise RenderingError("the renderer was closed; make a new one for more pictures")
        if self._context is None:
            self._context = OffscreenContext(self._model, width=self._width, height=self._height)
            self._scene = mujoco.MjvScene(self._model, maxgeom=self._max_geoms)
            for flag in _EFFECTS:
                self._scene.flags[flag] = flag in self._effects
        return self._context

    @contextmanager
    def _drawn(self, camera: str, options: Any, *, numbers: bool = False, viewport: Any = None) -> Iterator[Any]:
        """Draw things in their colours or as their numbers; give the `MjrContext` that holds the picture."""
        require_choice("camera", camera, self._cameras)
        with self._opened().bound() as mjr:
            self._camera.fixedcamid = self._model.camera(camera).id
            for flag in (mujoco.mjtRndFlag.mjRND_SEGMENT, mujoco.mjtRndFlag.mjRND_IDCOLOR):
                self._scene.flags[flag] = numbers
            mujoco.mjv_updateScene(
                self._model, self._data, options, None, self._camera, mujoco.mjtCatBit.mjCAT_ALL, self._scene
            )
            mujoco.mjr_render(viewport or self._viewport, self._scene, mjr)
            yield mjr

    @staticmethod
    def _read_colour(mjr: Any, viewport: Any) -> NDArray[np.uint8]:
        image = np.empty((viewport.height, viewport.width, 3), np.uint8)
        mujoco.mjr_readPixels(image, None, viewport, mjr)
        return image[::-1].copy()


def visible_groups(*groups: int) -> Any:
    """Return drawing options that show some groups of geoms, skins and tendons and nothing else."""
    options = mujoco.MjvOption()
    for shown in (options.geomgroup, options.tendongroup, options.skingroup):
        shown[:] = 0
        shown[list(groups)] = 1
    options.sitegroup[:] = 0
    return options


def add_camera(body: mujoco.MjsBody, name: str, pose: CameraPose) -> None:
    """Add a camera to a body of a model."""
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, pose.axes.ravel())
    body.add_camera(name=name, pos=list(pose.position), quat=quat.tolist(), fovy=pose.fovy_deg)
