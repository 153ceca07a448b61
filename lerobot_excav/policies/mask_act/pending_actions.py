"""What each environment of a batch has left of its plan."""

from collections import deque
from functools import partial

import torch
from lerobot.policies.act.modeling_act import ACTTemporalEnsembler
from torch import Tensor

from lerobot_excav.errors import require


class ActionQueue:
    """Planned actions of a batch of environments, each at its own place in its plan of `n_action_steps`."""

    def __init__(self, n_action_steps: int) -> None:
        self._n_action_steps = n_action_steps
        self.clear()

    def clear(self) -> None:
        """Drop every plan."""
        self._plans: list[deque[Tensor]] = []

    def __len__(self) -> int:
        """Return the number of actions that every environment has left."""
        return min(map(len, self._plans), default=0)

    def stale(self, changed: Tensor) -> Tensor:
        """Return which environments need a new plan, bool (B,): their target has `changed`, or nothing is left."""
        if not self._plans:
            return torch.ones_like(changed)
        return changed | torch.tensor([not plan for plan in self._plans], device=changed.device)

    def put(self, stale: Tensor, chunk: Tensor) -> None:
        """Replace the plans of the stale environments, bool (B,), by a chunk, (their number, chunk_size, A)."""
        self._plans = self._plans or [deque() for _ in stale]
        for number, plan in zip(stale.nonzero().flatten().tolist(), chunk, strict=True):
            self._plans[number] = deque(plan[: self._n_action_steps])

    def pop(self) -> Tensor:
        """Return the next action of every environment, shape (B, A)."""
        require(bool(self._plans), "the action queue is empty; put a plan for every environment first.")
        return torch.stack([plan.popleft() for plan in self._plans])


class TemporalEnsembles:
    """Average of all plans for the same moment (arXiv:2304.13705, algorithm 2): LeRobot's, one for each environment.

    The i-th plan for a moment, the oldest being i = 0, has weight exp(-coefficient i): a positive coefficient favours
    older plans. A change of target starts a new average for its environment.
    """

    def __init__(self, coefficient: float, chunk_size: int) -> None:
        self._new_one = partial(ACTTemporalEnsembler, coefficient, chunk_size)
        self.clear()

    def clear(self) -> None:
        """Drop every average."""
        self._averages: list[ACTTemporalEnsembler] = []

    def __len__(self) -> int:
        """Return the number of actions that need no new plan: none."""
        return 0

    def update(self, chunk: Tensor, changed: Tensor) -> Tensor:
        """Add a plan per environment, (B, chunk_size, A), and return the averaged action of this step, (B, A).

        Where the target has `changed`, bool (B,), the past plans are void.
        """
        self._averages = self._averages or [self._new_one() for _ in chunk]
        # They change their memory in place: always in this mode, so that callers may enter and leave it.
        with torch.inference_mode():
            for average, is_new in zip(self._averages, changed.tolist(), strict=True):
                if is_new:
                    average.reset()
            plans = zip(self._averages, chunk.unsqueeze(1), strict=True)
            actions = [average.update(plan) for average, plan in plans]
        return torch.cat(actions)
