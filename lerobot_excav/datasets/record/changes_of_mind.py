"""Changes of mind: in some episodes another target is commanded while the operator is on its way to one."""

from typing import Any, Self

import numpy as np

from lerobot_excav.datasets.record.change_odds import LATE_S, ChangeOdds
from lerobot_excav.envs.masks.source import MaskMissingError
from lerobot_excav.envs.tasks.commanded import Seen
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.task import Operator, TaskSpec
from lerobot_excav.errors import require

_STREAM = 0x7E3B  # names these random streams, so that the operator draws the same with and without changes of mind


class ChangesOfMind:
    """Commands another target of the start, at a moment drawn from the operator's way to the one before; then again.

    Args:
        rng: Draws moments and targets.
        count: How many changes there are.
        late: Share of them that come in the last `LATE_S` of the way.
    """

    def __init__(self, rng: np.random.Generator, count: int = 1, late: float = 0.0) -> None:
        self._rng = rng
        self._late = late
        self._left = count
        self._frame: int | None = None  # of the next change; None: not drawn, the operator has yet to find its way

    @classmethod
    def drawn(cls, odds: ChangeOdds, seed: tuple[int, ...]) -> Self | None:
        """Return the changes of mind of an episode, or None: it has some with probability `odds.share`.

        Args:
            odds: What they are drawn from.
            seed: Entropy of the episode.
        """
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_STREAM,)))
        if rng.random() >= odds.share:
            return None
        return cls(rng, 1 if odds.times == 1 else int(rng.integers(1, odds.times, endpoint=True)), odds.late)

    def pass_frame(self, env: MaskedTaskEnv[Any, Any], operator: Operator) -> Seen | None:
        """Give the next command if it is time; return what is seen under it.

        None stands for no change: it is not time, the start has a single target, or its mask cannot be found.
        """
        if not self._left:
            return None
        if self._frame is None:
            self._frame = env.frame + self._frames_on_the_way(env, operator)
        if env.frame < self._frame:
            return None
        self._left -= 1
        self._frame = None
        seen = self._changed(env)
        if seen is None:
            self._left = 0  # the operator stays on its way, of which less is left than it says
        return seen

    def _frames_on_the_way(self, env: MaskedTaskEnv[Any, Any], operator: Operator) -> int:
        """Draw how long the newest command holds: for an action at least, until the operator touches at most."""
        passed = env.frame - env.command.since_frame  # the operator finds its way with its first action
        touch = max(2, round(operator.approach_s * env.fps))
        is_late = self._late > 0.0 and self._rng.random() < self._late  # without, draws stay as they were
        first = max(1, touch - round(LATE_S * env.fps)) if is_late else 1
        return int(self._rng.integers(first, touch)) - passed

    def _changed(self, env: MaskedTaskEnv[Any, Any]) -> Seen | None:
        """Command a target other than the present one."""
        others = env.other_commands()
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
