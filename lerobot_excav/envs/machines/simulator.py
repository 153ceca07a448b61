"""MuJoCo. It is imported here alone: with some values of `MUJOCO_GL` its import fails, each time with another error."""

import os

from lerobot_excav.errors import RenderingError

try:
    import mujoco
except Exception as error:  # RuntimeError, AttributeError of a missing library and others
    asked = os.environ.get("MUJOCO_GL")
    if not asked:
        raise
    raise RenderingError(
        f"MuJoCo cannot be imported with MUJOCO_GL={asked}: {error}. Unset MUJOCO_GL, and what works here is taken; or "
        "install what it needs, on Debian or Ubuntu `apt-get install libegl1 libgl1 libegl-mesa0` for egl and "
        "`apt-get install libosmesa6` for osmesa"
    ) from error

__all__ = ["mujoco"]
