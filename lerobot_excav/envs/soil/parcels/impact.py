"""What loose soil gives to the bucket beyond a load that is welded to it.

A machine carries the load as one rigid body: its weight and its inertia are in the machine's own equations. The true
load moves a little against the bucket. What the machine must still get, J, follows from the momentum P of the load
against that rigid body, P = sum m (v - v_rigid) over its parcels:

    J = impulse of everything else on load and plates - change of P + momentum taken for soil that joined at rest

The sum of J over time is P at the end less P at the start and the momentum that fell in: nothing drifts. The weight of
a parcel that falls freely inside the bucket, which the rigid body carries too early, is taken back by its change of P.
The ground's force on the load is left out: the forces on edge and plates stand for it.
"""

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Vector, vector_product
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.parcels.contact import cross
from lerobot_excav.envs.soil.parcels.store import State

NOTHING: Array = np.zeros(6)
"""No impulse [N s] and no angular impulse [N m s]."""
NOTHING.flags.writeable = False


@kernel
def add_impulse(total: Array, point: Vector, impulse: Vector, factor: float) -> None:
    """Add an impulse [N s] at a world point, times a factor, to a sum (6,): linear, angular about the world origin."""
    angular = cross(point, impulse)
    for a in range(3):
        total[a] += factor * impulse[a]
        total[3 + a] += factor * angular[a]


@kernel
def relative_momentum(state: State, position: Array, linear: Array, angular: Array) -> tuple[Array, Array, float]:
    """Return momentum and first moment of the load.

    Returns (6,) momentum of the load against a rigid body that moves with the tool, whose origin is at `position` [m]
    with velocities `linear` [m/s] and `angular` [rad/s]: linear [N s], and angular about the world origin [N m s], the
    spins of parcels left out; the load's (3,) mass times position [kg m]; its mass [kg].
    """
    total, moment, mass = np.zeros(6), np.zeros(3), 0.0
    spin = (angular[0], angular[1], angular[2])
    for i in range(len(state.masses)):
        if not state.load[i]:
            continue
        p = (state.positions[i, 0], state.positions[i, 1], state.positions[i, 2])
        turning = cross(spin, (p[0] - position[0], p[1] - position[1], p[2] - position[2]))
        m = state.masses[i]
        v = (
            m * (state.velocities[i, 0] - linear[0] - turning[0]),
            m * (state.velocities[i, 1] - linear[1] - turning[1]),
            m * (state.velocities[i, 2] - linear[2] - turning[2]),
        )
        add_impulse(total, p, v, 1.0)
        mass += m
        for a in range(3):
            moment[a] += m * p[a]
    return total, moment, mass


class Impact:
    """Keeps the momentum of one bucket's load from step to step.

    Attributes:
        impulse: (6,) what the last step gave to the bucket: linear [N s], and angular about the tool origin [N m s].
    """

    def __init__(self) -> None:
        """Start with no load."""
        self.clear()

    def clear(self) -> None:
        """Forget the load: the next step gives nothing for how it moved before."""
        self.impulse: Array = NOTHING
        self._momentum: Array = NOTHING
        self._mass_kg = 0.0

    def moved(self, state: State, position: Array, linear: Array, angular: Array, pushes: Array) -> None:
        """Take note of a step that the load of the step before has gone through, with the `pushes` (6,) on it [N s].

        Call it before the load is found again, and `found` after that.
        """
        momentum, _, _ = relative_momentum(state, position, linear, angular)
        self._given = pushes + self._momentum - momentum

    def found(self, state: State, position: Array, linear: Array, angular: Array) -> None:
        """Take note of the new load, which is carried from now on."""
        self._momentum, moment, mass_kg = relative_momentum(state, position, linear, angular)
        given = self._given
        joined_kg = mass_kg - self._mass_kg
        if joined_kg > 0.0:
            centre = moment / mass_kg
            taken = joined_kg * (linear + vector_product(angular, centre - position))
            given = given + np.concatenate([taken, vector_product(centre, taken)])
        self._mass_kg = mass_kg
        self.impulse = np.concatenate([given[:3], given[3:] - vector_product(position, given[:3])])
