"""Where demonstrations come from: an environment and an operator for given settings."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from lerobot_excav.datasets.record.episode import Environment, Operator

if TYPE_CHECKING:  # settings know the environments, which know their rigs
    from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings


class Rig(Protocol):
    """Makes environments and operators; picklable if workers use it."""

    def __hash__(self) -> int: ...

    def environment(self, settings: "DemonstrationSettings") -> Environment:
        """Make an environment."""

    def operator(self, rng: np.random.Generator) -> Operator:
        """Make an operator."""


@dataclass(frozen=True, kw_only=True)
class SimulationRig(ABC):
    """An environment of this package and its scripted operator.

    Attributes:
        with_images: Whether the environment draws pictures; without them it is several times faster.
    """

    with_images: bool = True

    def environment(self, settings: "DemonstrationSettings") -> Environment:
        """Make the environment."""
        make, _ = self._classes()
        env: Environment = make(
            task=settings.task,
            obs_type="pixels_agent_pos" if self.with_images else "agent_pos",
            observation_height=settings.height,
            observation_width=settings.width,
            scene_set=settings.scene_set,
            fps=settings.fps,
            episode_length=settings.episode_length,
            render_mode="rgb_array" if self.with_images else None,
            **settings.extra,
        )
        return env

    def operator(self, rng: np.random.Generator) -> Operator:
        """Make the scripted operator."""
        _, make = self._classes()
        operator: Operator = make(rng=rng)
        return operator

    @abstractmethod
    def _classes(self) -> tuple[Callable[..., Any], Callable[..., Any]]:
        """Return the classes of environment and operator; imported late, as they need the graphics libraries."""


class ExcavatorRig(SimulationRig):
    """The excavator and its scripted operator."""

    def _classes(self) -> tuple[Callable[..., Any], Callable[..., Any]]:
        from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
        from lerobot_excav.envs.tasks.scoop.operator import ScriptedOperator

        return ExcavatorEnv, ScriptedOperator


class FR5GraspRig(SimulationRig):
    """The arm over a table with blocks, and its scripted operator."""

    def _classes(self) -> tuple[Callable[..., Any], Callable[..., Any]]:
        from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
        from lerobot_excav.envs.tasks.grasp.operator import ScriptedOperator

        return FR5GraspEnv, ScriptedOperator
