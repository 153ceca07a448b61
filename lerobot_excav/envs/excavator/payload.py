"""The soil in the bucket as a rigid body: mass, centre of mass and inertia written into the model."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.excavator import constants as const

# Moments of inertia of a unit mass from its radii of gyration: Ixx = ky^2 + kz^2 and so on.
_UNIT_INERTIA_M2 = (np.ones((3, 3)) - np.eye(3)) @ np.array(const.PAYLOAD_GYRATION_M) ** 2


class Payload:
    """Writes the carried soil into the inertial values of the body `payload`, which is welded to the bucket.

    As part of the mass matrix the load takes part in every acceleration. An external force m (g - a) instead
    would lag by a step and go unstable once the load outweighs the bucket.

    Args:
        model: The compiled machine; its payload body is written to.

    Attributes:
        mass_kg: Mass carried now.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._body = model.body("payload").id
        self.mass_kg = 0.0
        self._com_t = np.array(const.BUCKET_COM_T)
        self.reset()

    def reset(self) -> None:
        """Empty the bucket at once."""
        self.mass_kg = 0.0
        self._com_t = np.array(const.BUCKET_COM_T)
        self._write()

    def approach(self, mass_kg: float, com_t: NDArray[np.float64], substeps: int) -> None:
        """Move mass and centre of mass one substep closer to those of the soil.

        Args:
            mass_kg: Soil in the bucket [kg].
            com_t: Its centre of mass, tool frame, shape (3,) [m].
            substeps: How many substeps there are left to arrive, this one included.
        """
        if mass_kg == self.mass_kg == 0.0:
            return
        # A jump of the mass would kick the joints; its rate is bounded, so a large change may take longer.
        limit = const.PAYLOAD_RATE_KG_S * const.SUBSTEP_S
        self.mass_kg += min(max((mass_kg - self.mass_kg) / substeps, -limit), limit)
        if mass_kg > 0.0:
            self._com_t += (np.asarray(com_t) - self._com_t) / substeps
        self._write()

    def _write(self) -> None:
        self._model.body_mass[self._body] = self.mass_kg
        self._model.body_ipos[self._body] = self._com_t
        self._model.body_inertia[self._body] = self.mass_kg * _UNIT_INERTIA_M2
