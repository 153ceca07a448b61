"""The last mask of each environment that showed a target, for the frames at which its mask is missing."""

import logging

import torch
from torch import Tensor

from lerobot_excav.errors import require

LOG = logging.getLogger(__name__)


class HeldMask:
    """Shows the last mask again while the next ones are empty, as those of a segmenter that loses its object.

    An empty mask is no command. Before the first target, and after too many empty masks in a row, it is passed on as it
    is: a policy then acts without a target, which is said once.

    Args:
        most_frames: How many empty masks in a row are filled.
    """

    def __init__(self, most_frames: int) -> None:
        self._most_frames = most_frames
        self.clear()

    def clear(self) -> None:
        """Forget all masks."""
        self._mask: Tensor | None = None
        self._empty_frames = torch.zeros(0, dtype=torch.long)
        self._has_told = False

    def filled(self, mask: Tensor) -> Tensor:
        """Return masks, (B, 1, H, W), those that are empty replaced by the last ones of their environments.

        Raises:
            ConfigurationError: The batch has another size than at the last step.
        """
        if self._mask is None:
            self._mask = torch.zeros_like(mask)
            self._empty_frames = torch.zeros(len(mask), dtype=torch.long, device=mask.device)
        require(
            self._mask.shape == mask.shape,
            f"masks of shape {tuple(mask.shape)} follow masks of shape {tuple(self._mask.shape)}: the batch of "
            "environments changed during a rollout. Call policy.reset() between rollouts.",
        )
        is_shown = mask.flatten(1).any(dim=1)
        self._empty_frames = torch.where(is_shown, 0, self._empty_frames + 1)
        is_held = ~is_shown & (self._empty_frames <= self._most_frames)
        self._tell_of_lost_targets()
        self._mask = torch.where(_wide(is_shown), mask, self._mask)
        return torch.where(_wide(is_held), self._mask, mask)

    def _tell_of_lost_targets(self) -> None:
        """Say that a target is lost at the first frame at which it is, and not again in the same rollout."""
        is_lost = self._empty_frames == self._most_frames + 1
        if self._has_told or self._mask is None or not (is_lost & self._mask.flatten(1).any(dim=1)).any():
            return
        self._has_told = True
        LOG.warning(
            "The target mask has been empty for %d frames in a row: from here on the policy acts without a target, "
            "until a mask shows one again. Look at the source of the mask; --policy.hold_mask_frames says how long the "
            "last one is held.",
            self._most_frames + 1,
        )


def _wide(choice: Tensor) -> Tensor:
    """Return a choice of environments, (B,), as it applies to masks, (B, 1, 1, 1)."""
    return choice[:, None, None, None]
