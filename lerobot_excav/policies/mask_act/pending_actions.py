"""What each environment of a batch has left of its plan."""

import torch
from torch import Tensor

from lerobot_excav.errors import ConfigurationError, require


class TargetWatch:
    """Notice in which environments the target mask has changed since the last step."""

    def __init__(self) -> None:
        self._mask: Tensor | None = None

    def reset(self) -> None:
        """Forget the masks; the next ones count as changed."""
        self._mask = None

    def changed(self, mask: Tensor) -> Tensor:
        """Return which masks, (B, 1, H, W), differ from the last ones or had none before, bool (B,), and remember them.

        Raises:
            ConfigurationError: The batch has another size than at the last step.
        """
        last, self._mask = self._mask, mask
        if last is None:
            return torch.ones(mask.shape[0], dtype=torch.bool, device=mask.device)
        require(
            last.shape == mask.shape,
            f"masks of shape {tuple(mask.shape)} follow masks of shape {tuple(last.shape)}: the batch of "
            "environments changed during a rollout. Call policy.reset() between rollouts.",
        )
        return (last != mask).flatten(1).any(dim=1)


class ActionQueue:
    """Planned actions of a batch of environments, each at its own place in its plan of `n_action_steps`."""

    def __init__(self, n_action_steps: int) -> None:
        self._n_action_steps = n_action_steps
        self.reset()

    def reset(self) -> None:
        """Drop every plan."""
        self._plans: Tensor | None = None  # (B, n_action_steps, A)
        self._next = torch.empty(0, dtype=torch.long)  # (B,) index of the next action to execute

    def stale(self, changed: Tensor) -> Tensor:
        """Return which environments need a new plan, bool (B,): their target has `changed`, or nothing is left."""
        return changed if self._plans is None else changed | (self._next >= self._n_action_steps)

    def put(self, stale: Tensor, chunk: Tensor) -> None:
        """Replace the plans of the stale environments, bool (B,), by a chunk, (their number, chunk_size, A)."""
        chunk = chunk[:, : self._n_action_steps]
        start = torch.zeros_like(stale, dtype=torch.long)
        if self._plans is None:
            self._plans, self._next = chunk.new_zeros(stale.shape[0], *chunk.shape[1:]), start
        # Not in place: a plan made under torch.inference_mode may be continued outside it.
        self._plans = self._plans.index_put((stale,), chunk)
        self._next = torch.where(stale, start, self._next)

    def pop(self) -> Tensor:
        """Return the next action of every environment, shape (B, A)."""
        if self._plans is None:
            raise ConfigurationError("the action queue is empty; put a plan for every environment first.")
        actions = self._plans[torch.arange(len(self._next), device=self._next.device), self._next]
        self._next = self._next + 1
        return actions


class TemporalEnsemble:
    """Average of all plans for the same moment (arXiv:2304.13705, algorithm 2), with one memory per environment.

    The i-th plan for a moment, the oldest being i = 0, has weight exp(-coefficient i). With no change of target this
    is LeRobot's `ACTTemporalEnsembler`; a change starts a new average for that environment.

    Args:
        coefficient: Decay of the weights; positive favours older plans, negative newer ones.
        chunk_size: Length of a plan.
    """

    def __init__(self, coefficient: float, chunk_size: int) -> None:
        self._weights = torch.exp(-coefficient * torch.arange(chunk_size))
        # total[k] is the sum of the first k weights.
        self._totals = torch.cat([torch.zeros(1), torch.cumsum(self._weights, dim=0)])
        self.reset()

    def reset(self) -> None:
        """Drop every average."""
        # (B, chunk_size, A) averages for this step and those that follow; (B, chunk_size, 1) plans in each.
        self._memory: tuple[Tensor, Tensor] | None = None

    def update(self, chunk: Tensor, changed: Tensor) -> Tensor:
        """Add a plan per environment, (B, chunk_size, A), and return the averaged action of this step, (B, A).

        Where the target has `changed`, bool (B,), the past plans are void.
        """
        weights, totals = self._weights.to(chunk), self._totals.to(chunk)
        if self._memory is None:
            self._memory = torch.zeros_like(chunk), torch.zeros_like(chunk[..., :1], dtype=torch.long)
        old_mean, old_count = self._memory
        count = torch.where(changed[:, None, None], torch.zeros_like(old_count), old_count)
        mean = (old_mean * totals[count] + chunk * weights[count]) / totals[count + 1]
        self._memory = (
            torch.cat([mean[:, 1:], torch.zeros_like(mean[:, :1])], dim=1),
            torch.cat([count[:, 1:] + 1, torch.zeros_like(count[:, :1])], dim=1),
        )
        return mean[:, 0]
