"""The OpenGL backends of MuJoCo: which of them may work here, and how each is made and let go of."""

import os
import sys
from typing import Any

from lerobot_excav.errors import RenderingError

# What MuJoCo lets `MUJOCO_GL` say. Windows and macOS have one backend each, under several names.
_NAMED = {"egl": "egl", "osmesa": "osmesa", **dict.fromkeys(("glfw", "glx", "wgl", "cgl"), "glfw")}
_OFF = ("disable", "disabled", "off", "false", "0")


def backends() -> tuple[str, ...]:
    """Return the backends to try, in order: what `MUJOCO_GL` names, else a display if there is one, EGL, OSMesa.

    Raises:
        RenderingError: `MUJOCO_GL` switches pictures off.
    """
    asked = os.environ.get("MUJOCO_GL", "").lower().strip()
    if asked in _OFF:
        raise RenderingError(
            f"MUJOCO_GL={asked} switches pictures off; unset it. Pictures are not needed for obs_type='agent_pos'."
        )
    if asked in _NAMED:
        return (_NAMED[asked],)
    if sys.platform != "linux":
        return ("glfw",)
    has_display = bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return ("glfw", "egl", "osmesa") if has_display else ("egl", "osmesa")


def make_context(backend: str, width: int, height: int) -> Any:
    """Make a MuJoCo `GLContext` of a size [px] and bind it to this thread; raises whatever its driver raises."""
    # The choice is made here and not by `mujoco.GLContext`, which is fixed by whoever imports MuJoCo first.
    context = {"egl": _egl, "osmesa": _osmesa, "glfw": _glfw}[backend](width, height)
    context.make_current()
    return context


def unbind(backend: str) -> None:
    """Let go of the context that is bound to this thread, so that another thread may use it."""
    if backend == "egl":
        from mujoco import egl

        none = egl.EGL.EGL_NO_SURFACE
        egl.EGL.eglMakeCurrent(egl.EGL_DISPLAY, none, none, egl.EGL.EGL_NO_CONTEXT)
    elif backend == "osmesa":
        from mujoco import osmesa

        osmesa.osmesa.OSMesaMakeCurrent(None, None, osmesa.GL.GL_FLOAT, 0, 0)
    elif sys.platform != "darwin":  # there MuJoCo's context is not GLFW's
        from mujoco import glfw

        glfw.glfw.make_context_current(None)


def _egl(width: int, height: int) -> Any:
    with_opengl = "OpenGL" in sys.modules
    try:
        from mujoco.egl import GLContext

        return GLContext(width, height)
    except Exception:
        if not with_opengl:
            _forget_pyopengl()
        raise


def _forget_pyopengl() -> None:
    """Let PyOpenGL be imported for another backend: the first one fixes it, by a variable and by its modules."""
    os.environ.pop("PYOPENGL_PLATFORM", None)
    for name in list(sys.modules):
        if name.partition(".")[0] == "OpenGL" or name.startswith("mujoco.egl"):
            del sys.modules[name]


def _osmesa(width: int, height: int) -> Any:
    from mujoco.osmesa import GLContext

    return GLContext(width, height)


def _glfw(width: int, height: int) -> Any:
    if sys.platform == "darwin":
        from mujoco import GLContext

        return GLContext(width, height)
    import glfw
    from mujoco.glfw import GLContext

    reporting, glfw.ERROR_REPORTING = glfw.ERROR_REPORTING, "raise"  # by itself it only warns
    try:
        glfw.init()
        glfw.ERROR_REPORTING = "ignore"  # without a window there is no context; the first call of OpenGL says so
        return GLContext(width, height)
    finally:
        glfw.ERROR_REPORTING = reporting
