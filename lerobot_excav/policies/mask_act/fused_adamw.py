"""AdamW in one pass over the parameters."""

from dataclasses import dataclass

import torch
from lerobot.optim import AdamWConfig, OptimizerConfig
from lerobot.optim.optimizers import OptimizerParams


@OptimizerConfig.register_subclass("excav_fused_adamw")
@dataclass
class FusedAdamWConfig(AdamWConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Configure AdamW with PyTorch's fused update.

    Same formula as LeRobot's `adamw`, in one pass over each parameter where that makes about ten. On two CPU cores the
    update of ACT's 52 million parameters takes 36 ms of a step of 2.2 s.
    """

    def build(self, params: OptimizerParams) -> torch.optim.Optimizer:
        """Return the optimizer over parameters or parameter groups, as LeRobot passes them."""
        return torch.optim.AdamW(
            params, lr=self.lr, betas=self.betas, eps=self.eps, weight_decay=self.weight_decay, fused=True
        )
