"""What the scripted operator looks at."""

from dataclasses import dataclass
from typing import Protocol

from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.tasks.scoop.cycle import DigCycle


class Sight(Protocol):
    """A worksite, what is commanded there, and how often commands are asked for; an `ExcavatorEnv` is one."""

    @property
    def worksite(self) -> Worksite:
        """Machine, soil and box."""

    @property
    def cycle(self) -> DigCycle:
        """The running cycle, with the commanded region."""

    @property
    def fps(self) -> int:
        """Commands per second."""


@dataclass(frozen=True, kw_only=True)
class CycleSight:
    """The sight of one cycle without an environment."""

    worksite: Worksite
    cycle: DigCycle
    fps: int
