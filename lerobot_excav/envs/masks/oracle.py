"""The oracle: the simulator itself as a mask source."""

from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.source import MaskView, TargetMask, register_mask_source


class OracleSource:
    """Asks the simulator, which knows every target."""

    def mask(self, view: MaskView, command: Command) -> TargetMask | None:
        """Return the pixels that show the target once the machine is gone; None if it is out of sight."""
        pixels = view.true_mask(command)
        if not pixels.any():
            return None
        return TargetMask(pixels=pixels, target_id=command.target_id, source="oracle")


register_mask_source("oracle", OracleSource)
