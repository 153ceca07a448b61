"""Digging resistance on the joints: the patches of the soil, solved again in every substep."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.braking import braking_impulse, patch_rows, solved
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil.patches import Patches, PatchKind
from lerobot_excav.envs.soil.tool import Reaction

Array = NDArray[np.float64]


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
        self._units = np.eye(model.nv)
        self._jacobian = np.zeros((6, model.nv))
        self._inertia = np.zeros((model.nv, model.nv))
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
        rotation = data.xmat[self._bucket].reshape(3, 3)
        self._points_t = (patches.points_w - data.xpos[self._bucket]) @ rotation
        self._axes_t = _axes(patches) @ rotation
        self._limits = const.SUBSTEP_S * patches.limits_n
        self._frictions = patches.frictions

    def apply(self, data: mujoco.MjData) -> None:
        """Add the resistance of this substep to `qfrc_applied`; call it between `mj_step1` and `mj_step2`."""
        if len(self._limits) == 0:
            self._joint_force[:] = 0.0
            self.force_w_n = np.zeros(3)
            return
        mujoco.mj_jacBody(self._model, data, self._jacobian[:3], self._jacobian[3:], self._bucket)
        rotation = data.xmat[self._bucket].reshape(3, 3)
        rows = patch_rows(self._jacobian, rotation, self._points_t, self._axes_t)
        inertia, free_vel = self._free_motion(data)
        total, impulses = braking_impulse(rows, self._limits, self._frictions, inertia, free_vel)
        self._joint_force = total / const.SUBSTEP_S
        data.qfrc_applied[:] += self._joint_force
        self.force_w_n = rotation @ np.einsum("ka,kab->b", impulses, self._axes_t) / const.SUBSTEP_S

    def _free_motion(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """Return the effective inertia of the joints and their velocities at the end of the substep without soil.

        The inertia is M + dt D: integrated implicitly, a servo's damping acts like inertia, unless it is saturated.
        """
        mujoco.mj_fwdActuation(self._model, data)
        forces = data.qfrc_passive + data.qfrc_actuator + data.qfrc_applied - data.qfrc_bias
        if data.nefc:
            forces += self._constraint_force(data)
        for row, unit in zip(self._inertia, self._units, strict=True):
            mujoco.mj_mulM(self._model, data, row, unit)
        is_free = np.abs(data.actuator_force) < self._torque_limit
        self._inertia.flat[:: self._model.nv + 1] += is_free * self._added_inertia
        return self._inertia, data.qvel + const.SUBSTEP_S * solved(self._inertia, forces)

    def _constraint_force(self, data: mujoco.MjData) -> Array:
        """Return the force of contacts and joint limits on the joints while the soil resists as it did before.

        Soil and contacts share the load: each is solved in turn with the last force of the other.
        """
        data.qfrc_applied[:] += self._joint_force
        mujoco.mj_fwdAcceleration(self._model, data)
        mujoco.mj_fwdConstraint(self._model, data)
        data.qfrc_applied[:] -= self._joint_force
        return np.array(data.qfrc_constraint)


def _axes(patches: Patches) -> Array:
    """Return (k, 3, 3): the normal and two tangents of each patch as rows, in the world."""
    normals = patches.normals_w
    # The world axis that leans least to the normal gives the first tangent.
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([normals, first, np.cross(normals, first)], axis=1)
