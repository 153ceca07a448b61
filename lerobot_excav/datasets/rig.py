"""Where demonstrations come from: an environment and an operator for given settings."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from lerobot_excav.datasets.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.episode import Environment, Operator


class Rig(Protocol):
    """Makes environments and operators; picklable if workers use it."""

    def __hash__(self) -> int: ...

    def environment(self, settings: DemonstrationSettings) -> Environment:
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

    def environment(self, settings: DemonstrationSettings) -> Environment:
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
            soil=settings.soil,
            fidelity=settings.fidelity,
            render_mode="rgb_array" if self.with_images else None,
        )

    def operator(self, rng: np.random.Generator) -> Operator:
        """Make the scripted operator."""
        from lerobot_excav.envs.excavator.operator import ScriptedOperator

        return ScriptedOperator(rng=rng)
