"""The MuJoCo model of the work cell: table, tray, blocks, arm and gripper."""

from typing import Any

import numpy as np

from lerobot_excav.envs.machines.camera_pictures import add_camera
from lerobot_excav.envs.machines.fr5 import constants as const
from lerobot_excav.envs.machines.fr5 import layout
from lerobot_excav.envs.machines.fr5.arm import add_arm
from lerobot_excav.envs.machines.fr5.geoms import BLOCK, CELL, HARD_SOLREF
from lerobot_excav.envs.machines.fr5.gripper import add_gripper
from lerobot_excav.envs.machines.simulator import mujoco

_TRAY_RGBA = (0.35, 0.37, 0.40, 1.0)
_RIM_PIECES = 16
_HARD_CELL: dict[str, Any] = {"solref": HARD_SOLREF, **CELL.arguments}


def build_model() -> mujoco.MjModel:
    """Compile the model of `build_spec`."""
    return build_spec().compile()


def build_spec() -> mujoco.MjSpec:
    """Assemble the model.

    Returns:
        A spec with the joints and servos `j1` to `j6`, the servo `gripper`, the sites `flange` and `grasp`, the bodies
        `block0` to `block3` with free joints, the geoms `table`, `tray` and `block0` to `block3`, and the cameras of
        `layout.CAMERAS`.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "fr5_grasp"
    _set_options(spec)
    _add_table(spec)
    _add_tray(spec)
    for i in range(layout.BLOCK_COUNT):
        _add_block(spec, i)
    add_gripper(spec, add_arm(spec, layout.BASE_POS_W))
    for name, pose in layout.CAMERAS.items():
        add_camera(spec.worldbody, name, pose)
    return spec


def _set_options(spec: mujoco.MjSpec) -> None:
    spec.compiler.degree = False
    spec.option.timestep = const.SUBSTEP_S
    spec.option.gravity = [0.0, 0.0, -const.GRAVITY_M_S2]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # Elliptic cones and stiff friction keep a gripped block from creeping.
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    # A diverged state must be seen, not silently replaced by the initial one.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    spec.visual.quality.offsamples = 0
    spec.visual.quality.shadowsize = 0
    # The facets of capsules and cylinders are most of what is drawn; in pictures of 96 x 128 half as many look alike,
    # and a picture takes 0.6 in place of 1.5 ms (measured).
    spec.visual.quality.numslices, spec.visual.quality.numstacks, spec.visual.quality.numquads = 16, 8, 1
    spec.visual.map.znear, spec.visual.map.zfar = 0.02, 20.0
    spec.stat.extent = 1.0


def _add_table(spec: mujoco.MjSpec) -> None:
    # No highlights: on a bare table they are brighter than any block, and wander with the camera.
    lamp = spec.worldbody.add_light(name="lamp", type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    lamp.pos, lamp.dir, lamp.specular, lamp.ambient = [0, 0, 3], [0, 0, -1], [0, 0, 0], [0.25, 0.25, 0.25]
    spec.visual.headlight.active = 0
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    spec.worldbody.add_geom(name="table", type=plane, size=[3.0, 3.0, 0.1], rgba=[0.6, 0.6, 0.6, 1.0], **_HARD_CELL)


def _add_tray(spec: mujoco.MjSpec) -> None:
    x, y = layout.TRAY_POS_W
    radius, half = layout.TRAY_RADIUS_M, 0.5 * layout.TRAY_HEIGHT_M
    look = {"rgba": _TRAY_RGBA, **_HARD_CELL}
    tray = spec.worldbody.add_body(name="tray", pos=[x, y, 0.0])
    tray.add_geom(name="tray", type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[0, 0, half], size=[radius, half, 0], **look)
    half_rim = half + 0.5 * layout.TRAY_RIM_M
    for angle in 2 * np.pi * np.arange(_RIM_PIECES) / _RIM_PIECES:
        piece = tray.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, **look)
        piece.pos = [radius * np.cos(angle), radius * np.sin(angle), half_rim]
        piece.size = [0.003, radius * np.tan(np.pi / _RIM_PIECES), half_rim]
        piece.quat = [np.cos(0.5 * angle), 0, 0, np.sin(0.5 * angle)]


def _add_block(spec: mujoco.MjSpec, i: int) -> None:
    half = 0.5 * layout.BLOCK_SIZE_M
    # Where no scene puts it yet: side by side, so that the model's own initial state is one without contact forces.
    block = spec.worldbody.add_body(name=f"block{i}", pos=[0.1, 0.3 + 0.1 * i, half])
    block.add_freejoint(name=f"block{i}")
    cube = block.add_geom(name=f"block{i}", type=mujoco.mjtGeom.mjGEOM_BOX, size=[half] * 3, **BLOCK.arguments)
    cube.mass, cube.friction, cube.condim, cube.solref = layout.BLOCK_MASS_KG, layout.BLOCK_FRICTION, 4, HARD_SOLREF
