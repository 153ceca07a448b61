"""Soil that falls into the bucket, on the joints."""

import numpy as np

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil.tool import Reaction


class SoilImpact:
    """Gives the impulse of a reaction to the joints, as a force that is even over one tick.

    The soil has seen the bucket over the tick before; the delay is that of all reactions.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._bucket = model.body("bucket").id
        self._jacobian = np.zeros((6, model.nv))
        self._halves = self._jacobian[:3], self._jacobian[3:]
        self._force = np.zeros(6)
        self._acts = False

    def set_reaction(self, reaction: Reaction) -> None:
        """Take the impulse for the coming tick."""
        self._force[:3] = reaction.impulse_w_ns
        self._force[3:] = reaction.angular_impulse_w_nms
        self._force /= const.TICK_S
        self._acts = bool(self._force.any())

    def apply(self, data: mujoco.MjData) -> None:
        """Add it to `qfrc_applied`; call it in every substep between `mj_step1` and `mj_step2`."""
        if self._acts:
            mujoco.mj_jacBody(self._model, data, *self._halves, self._bucket)
            data.qfrc_applied[:] += self._jacobian.T @ self._force
