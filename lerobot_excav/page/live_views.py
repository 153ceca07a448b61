"""What the page shows of the scene: encoded pictures, drawn for each moment."""

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lerobot_excav.envs.masks.overlay import tinted
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv

JPEG_QUALITY = 82
"""(kind: tuned by eye; 45 KB at 480 x 640.)"""

PLAN_EVERY = 3
"""How many moments a map from above is shown (kind: guess: it changes slowly)."""

Picture = NDArray[np.uint8]


class LiveViews:
    """Draws an environment for people, at a size of its own and with little effort.

    The pictures are those of the policy's cameras, larger, and without the shadows of a film: on a machine without a
    graphics card those take a quarter of a second each.

    Args:
        env: What is shown; it needs pictures.
        height: Height of the pictures [px].
        width: Their width [px].
    """

    def __init__(self, env: MaskedTaskEnv[Any, Any], *, height: int, width: int) -> None:
        self._env = env
        self._renderer = env.open_renderer(height, width)
        self._size = (height, width)
        self._cameras = [camera for camera in env.task_spec.cameras if camera not in ("main", "target_mask")]
        self._plan: bytes | None = None
        self._count = 0

    def pictures(self, observation: dict[str, Any]) -> dict[str, bytes]:
        """Return `main` with the mask tinted, the other cameras, `policy` (what a policy sees) and perhaps `plan`."""
        pixels, mask = observation["pixels"], self._env.mask
        main = self._renderer.render("main")
        if mask is not None and mask.pixels.any():
            main = tinted(main, enlarged(mask.pixels, self._size))
        views = {"main": jpeg(main)}
        views |= {f"view_{i}": jpeg(self._renderer.render(camera)) for i, camera in enumerate(self._cameras)}
        views["policy"] = png(np.hstack([pixels["main"], pixels["target_mask"]]))
        if self._count % PLAN_EVERY == 0:
            plan = self._env.plan_view()
            self._plan = None if plan is None else jpeg(plan)
        self._count += 1
        return views if self._plan is None else views | {"plan": self._plan}

    def redraw_plan(self) -> None:
        """Draw the map from above in the next moment: the scene has changed."""
        self._count = 0

    def close(self) -> None:
        """Free the graphics context."""
        self._renderer.close()


def enlarged(pixels: NDArray[np.bool_], size: tuple[int, int]) -> NDArray[np.bool_]:
    """Return a mask (h, w) at another size (H, W), by the nearest pixel."""
    rows, columns = (
        np.minimum((np.arange(n) + 0.5) * small / n, small - 1).astype(int)
        for n, small in zip(size, pixels.shape, strict=True)
    )
    return np.asarray(pixels[rows[:, None], columns])


def jpeg(picture: Picture) -> bytes:
    """Encode a picture (H, W, 3) for people."""
    return _encoded(picture, format="jpeg", quality=JPEG_QUALITY)


def png(picture: Picture) -> bytes:
    """Encode a picture (H, W, 3) without loss."""
    return _encoded(picture, format="png", compress_level=1)


def _encoded(picture: Picture, **options: Any) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, **options)
    return buffer.getvalue()
