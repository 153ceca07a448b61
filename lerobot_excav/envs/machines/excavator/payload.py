"""The soil in the bucket as a rigid body: mass, centre of mass and inertia written into the model."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil.compiled import kernel

Array = NDArray[np.float64]

# Moments of inertia of a unit mass from its radii of gyration: Ixx = ky^2 + kz^2 and so on.
_UNIT_INERTIA_M2 = (np.ones((3, 3)) - np.eye(3)) @ np.array(const.PAYLOAD_GYRATION_M) ** 2

_LARGEST_CHANGE_KG = const.PAYLOAD_RATE_KG_S * const.SUBSTEP_S


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
        rotation: (9,) of the tool, row by row.
        joint_vel: (n,) [rad/s].
        com_t: (3,) where the payload is now [m].
        com_before_t: (3,) where its old part was [m].
        mass_kg: The payload now.
        kept_kg: How much of it was in the bucket before, and moved with it.
    """
    velocity, spin, spin_t = np.zeros(3), np.zeros(3), np.zeros(3)
    arm, arm_before = np.zeros(3), np.zeros(3)
    for a in range(3):
        for j in range(len(joint_vel)):
            velocity[a] += jacobian[a, j] * joint_vel[j]
            spin[a] += jacobian[3 + a, j] * joint_vel[j]
        for b in range(3):
            arm[a] += rotation[3 * a + b] * com_t[b]
            arm_before[a] += rotation[3 * a + b] * com_before_t[b]
    for a in range(3):
        for b in range(3):
            spin_t[a] += rotation[3 * b + a] * spin[b]
    linear, angular = np.zeros(3), np.zeros(3)
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        now = velocity[a] + (spin[b] * arm[c] - spin[c] * arm[b])
        before = velocity[a] + (spin[b] * arm_before[c] - spin[c] * arm_before[b])
        linear[a] = mass_kg * now - kept_kg * before
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        for k in range(3):
            angular[a] += rotation[3 * a + k] * (_UNIT_INERTIA_M2[k] * spin_t[k])
        angular[a] = angular[a] * (mass_kg - kept_kg) + (arm[b] * linear[c] - arm[c] * linear[b])
    taken = np.zeros(len(joint_vel))
    for j in range(len(joint_vel)):
        for a in range(3):
            taken[j] += jacobian[a, j] * linear[a] + jacobian[3 + a, j] * angular[a]
    return taken


@kernel
def approached(com_t: Array, com_before_t: Array, target_t: Array, substeps: int, *, shifts: bool) -> bool:
    """Move a centre of mass (3,) [m] closer to its target, in place, and keep where it was; tell whether it moved."""
    moved = False
    for a in range(3):
        com_before_t[a] = com_t[a]
        if shifts:
            com_t[a] += (target_t[a] - com_t[a]) / substeps
        moved = moved or com_t[a] != com_before_t[a]
    return moved


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
        self._halves = self._jacobian[:3], self._jacobian[3:]
        self._com_t, self._com_before_t = np.zeros(3), np.zeros(3)
        self.reset()

    def reset(self) -> None:
        """Empty the bucket at once."""
        self.mass_kg = self._mass_before_kg = 0.0
        self._com_t[:] = self._com_before_t[:] = const.BUCKET_COM_T
        self._has_shifted = False
        self._write()

    def approach(self, mass_kg: float, com_t: Array, substeps: int) -> None:
        """Move mass and centre of mass (3,) [m] closer to the soil's; `substeps` are left to arrive, this included."""
        self._mass_before_kg = self.mass_kg
        if mass_kg == self.mass_kg == 0.0:
            self._has_shifted = False
            return
        # A jump of the mass would kick the joints; its rate is bounded, so a large change may take longer.
        self.mass_kg += min(max((mass_kg - self.mass_kg) / substeps, -_LARGEST_CHANGE_KG), _LARGEST_CHANGE_KG)
        self._has_shifted = approached(self._com_t, self._com_before_t, com_t, substeps, shifts=mass_kg > 0.0)
        if self._has_shifted or self.mass_kg != self._mass_before_kg:
            self._write()

    def apply_momentum(self, data: mujoco.MjData) -> None:
        """Add to `qfrc_applied` what the last `approach` costs; call it between `mj_step1` and `mj_step2`.

        Soil joins the bucket at rest and takes its momentum from it; soil that leaves keeps its own, so the bucket
        feels nothing. Soil that shifts inside arrives with the velocity of its old place. As in any inelastic
        impact, no kinetic energy is gained.
        """
        kept_kg = min(self._mass_before_kg, self.mass_kg)
        if kept_kg == self.mass_kg and not self._has_shifted:
            return
        mujoco.mj_jacBody(self._model, data, *self._halves, self._body)
        places, rotation = (self._com_t, self._com_before_t), data.xmat[self._body]
        taken = momentum_taken(self._jacobian, rotation, data.qvel, *places, self.mass_kg, kept_kg)
        data.qfrc_applied[:] -= taken / const.SUBSTEP_S

    def _write(self) -> None:
        self._model.body_mass[self._body] = self.mass_kg
        self._model.body_ipos[self._body] = self._com_t
        self._model.body_inertia[self._body] = self.mass_kg * _UNIT_INERTIA_M2
