"""Mask source `geometry`: what depth tells, without any weights and without the simulator's knowledge.

A region of the ground is what the depth picture shows of the commanded patch; an object is what stands out of the
surface at the commanded place.
"""

from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.object_pixels import object_by_depth
from lerobot_excav.envs.masks.shot import reduced
from lerobot_excav.envs.masks.source import MaskView, TargetMask, register_mask_source
from lerobot_excav.errors import ConfigurationError


class GeometrySource:
    """Looks for the commanded place in the depth picture."""

    def mask(self, view: MaskView, command: Command) -> TargetMask | None:
        """Return the mask of a command; None if the machine hides all of its target.

        Raises:
            ConfigurationError: Nobody says where the target is, or there is no depth.
        """
        place_w = view.place_w(command)
        if place_w is None:
            raise ConfigurationError(
                "mask_source='geometry' needs the place of the target, and this task does not say it"
            )
        shot = view.shot()
        patch = view.patch(place_w, shot)
        fine = object_by_depth(shot, place_w) if patch is None else patch
        pixels = reduced(fine, (view.camera.height, view.camera.width))
        if not pixels.any():
            return None
        return TargetMask(pixels=pixels, target_id=command.target_id, source="geometry")


register_mask_source("geometry", GeometrySource)
