"""The soil in the bucket as a rigid body: mass, centre of mass and inertia written into the model."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil.compiled import kernel

Array = NDArray[np.float64]

# Moments of inertia of a unit mass from its radii of gyration: Ixx = ky^2 + kz^2 and so on.
_UNIT_INERTIA_M2 = (np.ones((3, 3)) - np.eye(3)) @ np.array(const.PAYLOAD_GYRATION_M) ** 2


@kernel
def momentum_taken(
    jacobian: Array,
    rotation: Array,
    joint_vel: Array,
    com_t: Array,
    com_before_t: Array,
    mass_kg: float,
    kept_kg: float,
) -> Array:
    """Return the momentum that the joints give to soil that joins the bucket or shifts in it, (n,) [N m s].

    Args:
        jacobian: (6, n) of the tool origin: linear, then angular velocity in the world.
        rotation: (3, 3) of the tool.
        joint_vel: (n,) [rad/s].
        com_t: (3,) where the payload is now [m].
        com_before_t: (3,) where its old part was [m].
        mass_kg: The payload now.
        kept_kg: How much of it was in the bucket before, and moved with it.
    """
    joints = len(joint_vel)
    velocity, spin = np.zeros(3), np.zeros(3)
    for a in range(3):
        for j in range(joints):
            velocity[a] += jacobian[a, j] * joint_vel[j]
            spin[a] += jacobian[3 + a, j] * joint_vel[j]
    arm = np.sum(rotation * com_t, axis=1)
    now = velocity + np.cross(spin, arm)
    before = velocity + np.cross(spin, np.sum(rotation * com_before_t, axis=1))
    linear = mass_kg * now - kept_kg * before
    spin_t = np.sum(rotation.T * spin, axis=1)
    angular = np.sum(rotation * (_UNIT_INERTIA_M2 * spin_t), axis=1) * (mass_kg - kept_kg)
    angular += np.cross(arm, linear)
    taken = np.zeros(joints)
    for j in range(joints):
        for a in range(3):
            taken[j] += jacobian[a, j] * linear[a] + jacobian[3 + a, j] * angular[a]
    return taken


class Payload:
    """Writes the carried soil into the inertial values of the body `payload`, which is welded to the bucket.

    As part of the mass matrix the load takes part in every acceleration. An external force m (g - a) instead
    would lag by a step and go unstable once the load outweighs the bucket.

    Attributes:
        mass_kg: Mass carried now.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._body = model.body("payload").id
        self._jacobian = np.zeros((6, model.nv))
        self.reset()

    def reset(self) -> None:
        """Empty the bucket at once."""
        self.mass_kg = 0.0
        self._com_t = np.array(const.BUCKET_COM_T)
        self._before = (0.0, self._com_t.copy())
        self._write()

    def approach(self, mass_kg: float, com_t: Array, substeps: int) -> None:
        """Move mass and centre of mass (3,) [m] closer to the soil's; `substeps` are left to arrive, this included."""
        self._before = (self.mass_kg, self._com_t.copy())
        if mass_kg == self.mass_kg == 0.0:
            return
        # A jump of the mass would kick the joints; its rate is bounded, so a large change may take longer.
        limit = const.PAYLOAD_RATE_KG_S * const.SUBSTEP_S
        self.mass_kg += min(max((mass_kg - self.mass_kg) / substeps, -limit), limit)
        if mass_kg > 0.0:
            self._com_t += (np.asarray(com_t) - self._com_t) / substeps
        self._write()

    def apply_momentum(self, data: mujoco.MjData) -> None:
        """Add to `qfrc_applied` what the last `approach` costs; call it between `mj_step1` and `mj_step2`.

        Soil joins the bucket at rest and takes its momentum from it; soil that leaves keeps its own, so the bucket
        feels nothing. Soil that shifts inside arrives with the velocity of its old place. As in any inelastic
        impact, no kinetic energy is gained.
        """
        mass_before, com_before = self._before
        kept_kg = min(mass_before, self.mass_kg)
        if kept_kg == self.mass_kg and np.array_equal(com_before, self._com_t):
            return
        mujoco.mj_jacBody(self._model, data, self._jacobian[:3], self._jacobian[3:], self._body)
        rotation = data.xmat[self._body].reshape(3, 3)
        taken = momentum_taken(self._jacobian, rotation, data.qvel, self._com_t, com_before, self.mass_kg, kept_kg)
        data.qfrc_applied[:] -= taken / const.SUBSTEP_S

    def _write(self) -> None:
        self._model.body_mass[self._body] = self.mass_kg
        self._model.body_ipos[self._body] = self._com_t
        self._model.body_inertia[self._body] = self.mass_kg * _UNIT_INERTIA_M2
