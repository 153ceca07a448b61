"""Digging resistance on the joints: the patches of the soil, solved again in every substep."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.braking import braking_impulse, patch_rows, solved
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.patches import PatchKind
from lerobot_excav.envs.soil.tool import Reaction

Array = NDArray[np.float64]

_SUBSTEP_S = const.SUBSTEP_S


@kernel
def free_velocity(
    inertia: Array,
    servo_forces: Array,
    servo_limits: Array,
    servo_inertia: Array,
    joint_vel: Array,
    passive: Array,
    actuator: Array,
    applied: Array,
    bias: Array,
    constraint: Array,
) -> Array:
    """Return the joint velocities at the end of a substep without soil, (n,) [rad/s].

    The inertia (n, n) [kg m2] becomes the effective one, in place: a servo below its limit adds `servo_inertia`.
    The other arguments are forces on the joints (n,) [N m], named as in `mujoco.MjData`.
    """
    forces = np.zeros(len(bias))
    for j in range(len(forces)):
        forces[j] = passive[j] + actuator[j] + applied[j] - bias[j] + constraint[j]
        if abs(servo_forces[j]) < servo_limits[j]:
            inertia[j, j] += servo_inertia[j]
    velocity = solved(inertia, forces)
    for j in range(len(forces)):
        velocity[j] = joint_vel[j] + _SUBSTEP_S * velocity[j]
    return velocity


@kernel
def resisting_force(
    jacobian: Array,
    rotation: Array,
    points_t: Array,
    axes_t: Array,
    limits: Array,
    frictions: Array,
    inertia: Array,
    free_vel: Array,
) -> tuple[Array, Array]:
    """Return the force of the patches on the joints (n,) [N m] and on the bucket (3,) [N], in the world.

    The rotation of the bucket is (9,), row by row; the other arguments are as in `patch_rows` and `braking_impulse`.
    """
    turn = rotation.reshape((3, 3))
    rows = patch_rows(jacobian, turn, points_t, axes_t)
    total, impulses = braking_impulse(rows, limits, frictions, inertia, free_vel)
    push_t = np.zeros(3)
    for k in range(len(impulses)):
        for a in range(3):
            for b in range(3):
                push_t[b] += impulses[k, a] * axes_t[k, a, b]
    force_w = np.zeros(3)
    for a in range(3):
        for b in range(3):
            force_w[a] += turn[a, b] * push_t[b]
        force_w[a] /= _SUBSTEP_S
    for j in range(len(total)):
        total[j] /= _SUBSTEP_S
    return total, force_w


class JointResistance:
    """Applies the soil's patches to the bucket so that they only ever brake.

    The soil says once per tick what each patch can hold. How much of that acts is decided here in every substep
    (`braking`), from the motion that motors, gravity and inertia would give the joints without soil. The patches
    move with the bucket during the tick.

    Attributes:
        force_w_n: (3,) force of the soil on the bucket in the last substep [N].
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._bucket = model.body("bucket").id
        self._added_inertia = const.SUBSTEP_S * np.array(const.SERVO_DAMPING_NMS_RAD)
        self._torque_limit = np.array(const.JOINT_TORQUE_NM)
        self._jacobian = np.zeros((6, model.nv))
        self._halves = self._jacobian[:3], self._jacobian[3:]
        self._inertia = np.zeros((model.nv, model.nv))
        self._columns = list(zip(self._inertia, np.eye(model.nv), strict=True))
        self._no_force = np.zeros(model.nv)
        self.reset()

    def reset(self) -> None:
        """Forget the reactions of the past."""
        self._limits: Array = np.zeros(0)
        self._joint_force: Array = np.zeros(self._model.nv)
        self.force_w_n: Array = np.zeros(3)

    def set_reaction(self, reaction: Reaction, data: mujoco.MjData) -> None:
        """Take the patches that hold for the coming tick; the bucket is where the soil saw it.

        The ground cannot push plates and edge harder than the machine weighs.
        """
        patches = reaction.patches.bounded(const.MACHINE_WEIGHT_N, PatchKind.PRESSURE, PatchKind.PENETRATION)
        self._limits = const.SUBSTEP_S * patches.limits_n
        if len(patches) == 0:
            return
        rotation = data.xmat[self._bucket].reshape(3, 3)
        self._points_t = (patches.points_w - data.xpos[self._bucket]) @ rotation
        self._axes_t = patch_axes(patches.normals_w) @ rotation
        self._frictions = patches.frictions

    def apply(self, data: mujoco.MjData) -> None:
        """Add the resistance of this substep to `qfrc_applied`; call it between `mj_step1` and `mj_step2`."""
        if len(self._limits) == 0:
            self._joint_force = self._no_force
            self.force_w_n = np.zeros(3)
            return
        mujoco.mj_jacBody(self._model, data, *self._halves, self._bucket)
        inertia, free_vel = self._free_motion(data)
        patches = self._points_t, self._axes_t, self._limits, self._frictions
        rotation = data.xmat[self._bucket]
        self._joint_force, self.force_w_n = resisting_force(self._jacobian, rotation, *patches, inertia, free_vel)
        data.qfrc_applied[:] += self._joint_force

    def _free_motion(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """Return the effective inertia of the joints and their velocities at the end of the substep without soil.

        The inertia is M + dt D: integrated implicitly, a servo's damping acts like inertia, unless it is saturated.
        """
        mujoco.mj_fwdActuation(self._model, data)
        applied = data.qfrc_applied.copy()
        constraint = self._constraint_force(data) if data.nefc else self._no_force
        for column, unit in self._columns:
            mujoco.mj_mulM(self._model, data, column, unit)
        servos = data.actuator_force, self._torque_limit, self._added_inertia
        forces = data.qfrc_passive, data.qfrc_actuator, applied, data.qfrc_bias
        return self._inertia, free_velocity(self._inertia, *servos, data.qvel, *forces, constraint)

    def _constraint_force(self, data: mujoco.MjData) -> Array:
        """Return the force of contacts and joint limits on the joints while the soil resists as it did before.

        Soil and contacts share the load: each is solved in turn with the last force of the other.
        """
        data.qfrc_applied[:] += self._joint_force
        mujoco.mj_fwdAcceleration(self._model, data)
        mujoco.mj_fwdConstraint(self._model, data)
        data.qfrc_applied[:] -= self._joint_force
        return np.array(data.qfrc_constraint)


@kernel
def patch_axes(normals: Array) -> Array:
    """Return (k, 3, 3): the normals (k, 3) and two tangents of each patch as rows."""
    axes = np.zeros((len(normals), 3, 3))
    for k in range(len(normals)):
        normal, first, second = normals[k], axes[k, 1], axes[k, 2]
        least = 0  # the world axis that leans least to the normal gives the first tangent
        for a in range(1, 3):
            if abs(normal[a]) < abs(normal[least]):
                least = a
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            axes[k, 0, a] = normal[a]
            first[a] = normal[b] * (1.0 if c == least else 0.0) - normal[c] * (1.0 if b == least else 0.0)
        length = np.sqrt(first[0] ** 2 + first[1] ** 2 + first[2] ** 2)
        for a in range(3):
            first[a] /= length
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            second[a] = normal[b] * first[c] - normal[c] * first[b]
    return axes
