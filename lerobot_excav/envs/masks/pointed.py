"""A mask that a person or a program has drawn."""

from dataclasses import dataclass

from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.source import MaskView, Pixels, TargetMask


@dataclass(frozen=True)
class PointedSource:
    """Shows one mask, whatever is commanded.

    Attributes:
        pixels: The mask, (H, W) bool.
    """

    pixels: Pixels

    def mask(self, view: MaskView, command: Command) -> TargetMask:
        """Return the mask; it shows the command's target, which was chosen by it."""
        return TargetMask(pixels=self.pixels.copy(), target_id=command.target_id, source="pointed")
