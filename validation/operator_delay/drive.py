"""One scoop whose commands come at some frame rate and reach the machine late."""

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from lerobot_excav.envs.constants import TICKS_PER_SECOND
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.tasks.scoop.cycle import DigCycle
from lerobot_excav.envs.tasks.scoop.operator.sight import CycleSight
from lerobot_excav.envs.tasks.scoop.scene import draw_scene
from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from lerobot_excav.errors import require


@dataclass(frozen=True, kw_only=True)
class Condition:
    """How commands reach the machine."""

    rate_hz: int  # how often the operator looks and commands; a command holds until the next
    delay_ms: int  # from the look to the machine, in whole ticks of 20 ms

    def __post_init__(self) -> None:
        require(
            self.rate_hz > 0 and TICKS_PER_SECOND % self.rate_hz == 0,
            f"rate_hz={self.rate_hz}; allowed: divisors of {TICKS_PER_SECOND}",
        )
        tick_ms = 1000 // TICKS_PER_SECOND
        require(
            self.delay_ms >= 0 and self.delay_ms % tick_ms == 0,
            f"delay_ms={self.delay_ms}; allowed: multiples of {tick_ms}",
        )

    @property
    def delay_ticks(self) -> int:
        """The delay in ticks."""
        return self.delay_ms * TICKS_PER_SECOND // 1000


def drive(condition: Condition, *, scene_set: str, scene_id: int, target_id: int, seed: int) -> dict[str, Any]:
    """Let the scripted operator dig one scoop under a condition; return its outcome as data.

    The operator knows nothing of the delay, like a person at a slow radio link; before the first command arrives the
    machine is held still.
    """
    worksite, scene = Worksite(), draw_scene(scene_set, scene_id)
    worksite.reset(scene)
    cycle = DigCycle(worksite, scene, target_id)
    sight = CycleSight(worksite=worksite, cycle=cycle, fps=condition.rate_hz)
    operator = SCOOP.make_operator(np.random.default_rng((seed, scene_id, target_id)))
    operator.reset(sight)
    ticks_per_command = TICKS_PER_SECOND // condition.rate_hz
    on_the_way = deque([np.zeros(4, np.float32)] * condition.delay_ticks)
    command = np.zeros(4, np.float32)
    for tick in range(round(SCOOP.duration_s * TICKS_PER_SECOND)):
        if tick % ticks_per_command == 0:
            command = operator.act(sight)
        on_the_way.append(command)
        worksite.tick(on_the_way.popleft())
        cycle.update()
        if cycle.is_complete:
            break
    return {
        **{"rate_hz": condition.rate_hz, "delay_ms": condition.delay_ms},
        **{"scene_set": scene_set, "scene_id": scene_id, "target_id": target_id, "operator_seed": seed},
        **{"simulation_version": SCOOP.simulation_version, "is_success": cycle.is_success},
        **cycle.metrics(),
    }
