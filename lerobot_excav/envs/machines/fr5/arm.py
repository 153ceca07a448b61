"""The arm, built of primitive geoms."""

import numpy as np

from lerobot_excav.envs.machines.fr5 import constants as const
from lerobot_excav.envs.machines.fr5.geoms import ARM, DECORATION
from lerobot_excav.envs.machines.simulator import mujoco

_SHELL_RGBA = (0.92, 0.93, 0.94, 1.0)
_JOINT_RGBA = (0.30, 0.33, 0.38, 1.0)

# Centre lines of the links in their joints' frames, radius [m], colour, and whether they touch the cell. The two links
# nearest the foot stand on the table and touch nothing (kind: derived from the inertial data and the joint frames).
_LINK_SHAPES = (
    (((0.0, 0.0, 0.0), (0.0, 0.0, 0.152), 0.060, _JOINT_RGBA, DECORATION),),
    (
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.135), 0.058, _JOINT_RGBA, DECORATION),
        ((0.0, 0.0, 0.135), (-0.425, 0.0, 0.135), 0.050, _SHELL_RGBA, DECORATION),
        ((-0.425, 0.0, 0.010), (-0.425, 0.0, 0.135), 0.050, _JOINT_RGBA, ARM),
    ),
    (((0.0, 0.0, 0.007), (-0.395, 0.0, 0.007), 0.042, _SHELL_RGBA, ARM),),
    (((0.0, 0.0, 0.0), (0.0, 0.0, 0.1021), 0.038, _JOINT_RGBA, ARM),),
    (((0.0, 0.0, 0.0), (0.0, 0.0, 0.102), 0.038, _JOINT_RGBA, ARM),),
    (((0.0, 0.0, 0.03), (0.0, 0.0, 0.08), 0.035, _SHELL_RGBA, ARM),),
)


def add_arm(spec: mujoco.MjSpec, base_pos_w: tuple[float, float, float]) -> mujoco.MjsBody:
    """Add the arm with its joints and position servos on its foot [m]; return the last link, with the site `flange`."""
    body = spec.worldbody.add_body(name="base", pos=base_pos_w)
    for i, name in enumerate(const.JOINT_NAMES):
        body = _add_link(body, i, name)
        _add_servo(spec, i, name)
    body.add_site(name="flange", pos=[0.0, 0.0, const.FLANGE_OFFSET_M], group=5)
    return body


def _add_link(parent: mujoco.MjsBody, i: int, name: str) -> mujoco.MjsBody:
    placement, inertia = const.JOINT_PLACEMENTS[i], const.LINK_INERTIAS[i]
    half = 0.5 * placement.roll
    link = parent.add_body(
        name=f"link{i + 1}", pos=placement.xyz, quat=[np.cos(half), np.sin(half), 0.0, 0.0], gravcomp=1.0
    )
    link.explicitinertial = True
    link.mass = const.MASS_SCALE * inertia.mass_kg
    link.ipos, link.inertia = inertia.com, const.MASS_SCALE * np.array(inertia.moments)
    torque = const.JOINT_TORQUE_N_M[i]
    link.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=[0, 0, 1],
        range=const.JOINT_LIMITS_RAD[i],
        armature=const.JOINT_ARMATURE[i],
        frictionloss=const.JOINT_FRICTION_N_M[i],
        # The servo carries the weight, so that its limit bounds weight and motion together.
        actgravcomp=True,
        actfrclimited=True,
        actfrcrange=[-torque, torque],
    )
    for start, end, radius, rgba, kind in _LINK_SHAPES[i]:
        link.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[*start, *end], size=[radius, 0, 0], rgba=rgba, mass=0,
            **kind.arguments,
        )  # fmt: skip
    return link


def _add_servo(spec: mujoco.MjSpec, i: int, name: str) -> None:
    servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    servo.set_to_position(kp=const.JOINT_STIFFNESS[i], kv=const.JOINT_DAMPING[i])
    servo.ctrllimited, servo.ctrlrange = True, const.JOINT_LIMITS_RAD[i]
