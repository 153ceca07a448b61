"""Off-screen OpenGL contexts, also on machines without a display."""

import os
import sys
from typing import Any

from lerobot_excav.errors import RenderingError

_BACKENDS = ("egl", "osmesa", "glfw")


def default_backend() -> str:
    """Return the OpenGL backend to use: `MUJOCO_GL` if it names one, else EGL on Linux without a display."""
    asked = os.environ.get("MUJOCO_GL", "").lower().strip()
    if asked in _BACKENDS:
        return asked
    has_display = bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return "egl" if sys.platform == "linux" and not has_display else "glfw"


def create_context(width: int, height: int) -> Any:
    """Create an OpenGL context for pictures of a size [px], make it current and return it, a MuJoCo `GLContext`.

    Raises:
        RenderingError: No context can be made here.
    """
    backend = default_backend()
    try:
        context = _context_class(backend)(width, height)
        context.make_current()
    except Exception as error:  # drivers fail in many ways, all of which mean the same to the user
        raise RenderingError(
            f"MUJOCO_GL={backend} cannot make an OpenGL context here: {error}. On Debian or Ubuntu install the "
            "software renderer with `apt-get install libegl1 libgl1 libglx-mesa0 libegl-mesa0`, or install "
            "libosmesa6 and set MUJOCO_GL=osmesa; then try again. Pictures are not needed for obs_type='agent_pos'."
        ) from error
    return context


def _context_class(backend: str) -> Any:
    # The choice is made here and not by `mujoco.GLContext`, which is fixed by whoever imports MuJoCo first.
    if backend == "egl":
        from mujoco.egl import GLContext
    elif backend == "osmesa":
        from mujoco.osmesa import GLContext
    else:
        from mujoco import GLContext
    return GLContext
