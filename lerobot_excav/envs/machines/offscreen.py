"""Off-screen OpenGL, also on machines without a display."""

import atexit
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from lerobot_excav.envs.machines.opengl_backend import backends, make_context, unbind
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.errors import RenderingError

_opening = threading.Lock()
_inherited: list["OffscreenContext"] = []
_used_by: int | None = None
"""The process that opened a context first; OpenGL does not survive a fork, not even for contexts made after it."""


class OffscreenContext:
    """An OpenGL context with MuJoCo's resources for the pictures of a model.

    Any thread may use it, one at a time; a process that was forked after the first picture may not.

    Args:
        model: The model.
        width: Width of the pictures [px].
        height: Height of the pictures [px].

    Raises:
        RenderingError: No context can be made here.
    """

    def __init__(self, model: mujoco.MjModel, *, width: int, height: int) -> None:
        global _used_by
        _require_this_process()
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        with _opening:
            self._backend, self._context, self._mjr = _first_that_works(model, width, height)
            _used_by = os.getpid()
            self._mjr.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._mjr)
            unbind(self._backend)

    @contextmanager
    def bound(self) -> Iterator[Any]:
        """Bind the context to this thread for a while; give MuJoCo's `MjrContext`.

        Raises:
            RenderingError: Another thread is drawing, or this process is a fork of the one that opened the context.
        """
        _require_this_process()
        try:
            self._context.make_current()
        except Exception as error:
            raise RenderingError(
                "these pictures are being drawn by another thread; give each thread an environment of its own"
            ) from error
        try:
            yield self._mjr
        finally:
            unbind(self._backend)

    def free(self) -> None:
        """Free it; it cannot be used afterwards."""
        if _used_by != os.getpid():
            _inherited.append(self)  # to free it hangs, also by the garbage collector
            return
        with self.bound():
            self._mjr.free()
        self._context.free()


def _first_that_works(model: mujoco.MjModel, width: int, height: int) -> tuple[str, Any, Any]:
    """Return backend, context and MuJoCo's resources, of the first backend that draws."""
    failures: list[tuple[str, Exception]] = []
    for backend in backends():
        try:
            context = make_context(backend, width, height)
            # A context that draws nothing shows itself only here.
            return backend, context, mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
        except Exception as error:  # drivers fail in many ways, all of which mean the same to the user
            failures.append((backend, error))
    tried = "; ".join(f"MUJOCO_GL={backend} cannot make an OpenGL context here: {error}" for backend, error in failures)
    raise RenderingError(
        f"{tried}. On Debian or Ubuntu install the software renderer with `apt-get install libegl1 libgl1 "
        "libglx-mesa0 libegl-mesa0` and set MUJOCO_GL=egl, or install libosmesa6 and set MUJOCO_GL=osmesa; then try "
        "again. Pictures are not needed for obs_type='agent_pos'."
    ) from failures[-1][1]


def _require_this_process() -> None:
    if _used_by not in (None, os.getpid()):
        raise RenderingError(
            f"process {os.getpid()} was forked from {_used_by}, which had drawn pictures before, and OpenGL does not "
            "work in such a copy. Start the processes before the first picture is drawn, or not by a fork: "
            'gym.make_vec(..., vectorization_mode="async", vector_kwargs={"context": "forkserver"}), '
            'multiprocessing.get_context("spawn")'
        )


def _leave_display() -> None:
    """Keep a forked process from closing the display that it inherited, be it at its end: that hangs."""
    egl: Any = sys.modules.get("mujoco.egl")
    if egl is not None:
        atexit.unregister(egl.EGL.eglTerminate)  # as older versions of MuJoCo do it; newer ones look for the display
        egl.EGL_DISPLAY = None


if hasattr(os, "register_at_fork"):  # not on Windows
    os.register_at_fork(after_in_child=_leave_display)
