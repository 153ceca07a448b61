"""A change of mind: in some episodes another target is commanded while the operator is on its way to the first."""

from typing import Any, Self

import numpy as np

from lerobot_excav.envs.masks.source import MaskMissingError
from lerobot_excav.envs.tasks.commanded import Seen
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.task import Operator, TaskSpec
from lerobot_excav.errors import require

_STREAM = 0x7E3B  # names these random streams, so that the operator draws the same with and without changes of mind


class ChangeOfMind:
    """Commands another target of the start, once, at a moment drawn from the operator's way to the first.

    Args:
        rng: Draws moment and target.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._frame = 0

    @classmethod
    def drawn(cls, share: float, seed: tuple[int, ...]) -> Self | None:
        """Return the change of mind of an episode, or None: it has one with probability `share`.

        Args:
            share: 0 to 1.
            seed: Entropy of the episode.
        """
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_STREAM,)))
        return cls(rng) if rng.random() < share else None

    def begin(self, env: MaskedTaskEnv[Any, Any], operator: Operator) -> None:
        """Draw the moment, once the operator knows its way: after one action at least, before it touches the target."""
        self._frame = int(self._rng.integers(1, max(2, round(operator.approach_s * env.fps))))

    def pass_frame(self, env: MaskedTaskEnv[Any, Any]) -> Seen | None:
        """Give the new command if it is time; return what is seen under it.

        None stands for no change: it is not time, the start has a single target, or its mask cannot be found.
        """
        others = env.other_commands() if env.frame == self._frame else []
        if not others:
            return None
        target_id = others[int(self._rng.integers(len(others)))].target_id
        try:
            return env.recommand(target_id)
        except MaskMissingError:
            return None


def require_approach(spec: TaskSpec) -> None:
    """Check that the operator of a task tells how long it is on its way.

    Raises:
        ConfigurationError: It does not.
    """
    operator = type(spec.make_operator(np.random.default_rng(0)))
    require(
        hasattr(operator, "approach_s"),
        f"--retarget needs to know how long the operator of {spec.id} is on its way, and {operator.__name__} has no "
        "approach_s; add the property (docs/how-to/add-a-task.md), or leave --retarget out",
    )
