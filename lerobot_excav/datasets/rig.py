"""Where demonstrations come from: an environment and an operator for given settings."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from lerobot_excav.datasets.episode import Environment, Operator

if TYPE_CHECKING:  # settings know the environments, which know their rigs
    from lerobot_excav.datasets.demonstration_settings import DemonstrationSettings


class Rig(Protocol):
    """Makes environments and operators; picklable if workers use it."""

    def __hash__(self) -> int: ...

    def environment(self, settings: "DemonstrationSettings") -> Environment:
        """Make an environment."""

    def operator(self, rng: np.random.Generator) -> Operator:
        """Make an operator."""


@dataclass(frozen=True, kw_only=True)
class ExcavatorRig:
    """The excavator and its scripted operator.

    Attributes:
        with_images: Whether the environment draws pictures; without them it is several times faster.
    """

    with_images: bool = True

    def environment(self, settings: "DemonstrationSettings") -> Environment:
        """Make the excavator environment."""
        # Imported here: only who plays an episode needs the graphics libraries.
        from lerobot_excav.envs.excavator.env import ExcavatorEnv

        return ExcavatorEnv(
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

    def operator(self, rng: np.random.Generator) -> Operator:
        """Make the scripted operator."""
        from lerobot_excav.envs.excavator.operator import ScriptedOperator

        return ScriptedOperator(rng=rng)


@dataclass(frozen=True, kw_only=True)
class FR5GraspRig:
    """The arm over a table with blocks, and its scripted operator.

    Attributes:
        with_images: Whether the environment draws pictures; without them it is several times faster.
    """

    with_images: bool = True

    def environment(self, settings: "DemonstrationSettings") -> Environment:
        """Make the grasping environment."""
        from lerobot_excav.envs.fr5.env import FR5GraspEnv

        return FR5GraspEnv(
            task=settings.task,
            obs_type="pixels_agent_pos" if self.with_images else "agent_pos",
            observation_height=settings.height,
            observation_width=settings.width,
            scene_set=settings.scene_set,
            fps=settings.fps,
            episode_length=settings.episode_length,
            render_mode="rgb_array" if self.with_images else None,
        )

    def operator(self, rng: np.random.Generator) -> Operator:
        """Make the scripted operator."""
        from lerobot_excav.envs.fr5.operator import ScriptedOperator

        return ScriptedOperator(rng=rng)
