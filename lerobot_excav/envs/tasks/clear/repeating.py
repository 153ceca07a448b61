"""The scripted operator of single cycles, begun anew with every command."""

from typing import Any, override

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.scoop.operator import DigOperator


class RepeatingOperator(DigOperator):
    """Digs one commanded region after the other; each cycle has a style of its own."""

    @override
    def reset(self, env: Any) -> None:
        self._since_frame = env.command.since_frame
        super().reset(env)

    @override
    def act(self, env: Any) -> NDArray[np.float32]:
        if env.command.since_frame != self._since_frame:
            self.reset(env)
        return super().act(env)
