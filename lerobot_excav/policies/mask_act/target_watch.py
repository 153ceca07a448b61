"""The mask that each environment's plan was made for, and whether it still shows the same target."""

import torch
from torch import Tensor


class TargetWatch:
    """Notices in which environments the mask no longer shows the target of the plan in progress.

    A plan that is begun again at every frame never comes to its later actions, so a long plan needs a mask that stands
    still, or a watch that overlooks small motions.

    Args:
        replan_iou: Least intersection over union of a mask with the one of the plan at which the plan is kept. 1: every
            pixel counts.
    """

    def __init__(self, replan_iou: float) -> None:
        self._replan_iou = replan_iou
        self.clear()

    def clear(self) -> None:
        """Forget the masks; the next ones count as changed."""
        self._mask: Tensor | None = None

    def changed(self, mask: Tensor) -> Tensor:
        """Return which masks, (B, 1, H, W), show another target than the plan's, or have no plan, bool (B,)."""
        if self._mask is None:
            return torch.ones(len(mask), dtype=torch.bool, device=mask.device)
        seen, planned = mask.flatten(1) > 0, self._mask.flatten(1) > 0
        union = (seen | planned).sum(dim=1)
        return (seen & planned).sum(dim=1) < self._replan_iou * union  # two empty masks are equal

    def planned(self, stale: Tensor, mask: Tensor) -> None:
        """Remember the masks, (B, 1, H, W), of those environments that get a new plan for them, bool (B,)."""
        self._mask = mask if self._mask is None else torch.where(stale[:, None, None, None], mask, self._mask)
