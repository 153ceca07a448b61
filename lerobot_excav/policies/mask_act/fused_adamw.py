"""AdamW in one pass over the parameters."""

from dataclasses import dataclass

from lerobot.optim import AdamWConfig, OptimizerConfig


@OptimizerConfig.register_subclass("excav_fused_adamw")
@dataclass
class FusedAdamWConfig(AdamWConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Configure AdamW with PyTorch's fused update.

    Same formula as LeRobot's `adamw`, in one pass over each parameter where that makes about ten. On two CPU cores the
    update of ACT's 52 million parameters takes 36 ms of a step of 2.2 s.
    """

    fused: bool = True
