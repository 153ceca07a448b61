"""A real pile before a real camera that measures depth, as a view for mask sources."""

from functools import cached_property
from typing import override

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.pinhole import PinholeCamera
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.picture_view import PictureView
from lerobot_excav.envs.masks.shot import Shot
from lerobot_excav.envs.masks.source import MaskMissingError, Pixels
from lerobot_excav.envs.tasks.planner.candidates import Candidates, rate
from lerobot_excav.envs.tasks.planner.plan import Plan, plan_targets
from lerobot_excav.envs.tasks.planner.surface import SeenSurface, see_surface
from lerobot_excav.envs.tasks.planner.zones import Zone
from lerobot_excav.envs.tasks.scoop.region_pixels import region_pixels, require_pointable
from lerobot_excav.envs.tasks.scoop.targets import Target
from lerobot_excav.errors import require

LEAST_SEEN = 0.5
"""Part of a region that has to be seen, or its mask shows something else than a region (kind: guess)."""


class PileView(PictureView):
    """A picture whose targets are dig regions; nobody commands one, so the planner of pile clearing does.

    Args:
        picture: (H, W, 3) uint8.
        key: By which files of masks name it.
        words: What people say of the target; nothing stands for the pile.
        number: Tells one situation from another.
        depth_m: (H, W) float32, registered with the picture [m]; NaN where nothing was measured.
        camera: Where the camera stands, in the world frame of the excavator.
        zones: Where nothing may be dug.
    """

    def __init__(
        self,
        picture: NDArray[np.uint8],
        *,
        key: str,
        words: str,
        number: int,
        depth_m: NDArray[np.float32],
        camera: PinholeCamera,
        zones: tuple[Zone, ...] = (),
    ) -> None:
        words = words or "the pile of sand"
        super().__init__(picture, key=key, words=words, number=number, depth_m=depth_m, camera=camera)
        self._zones = zones

    @cached_property
    def _surface(self) -> SeenSurface:
        return see_surface(self.depth_m(), self.camera)

    @override
    def place_w(self, command: Command) -> NDArray[np.float64]:
        """Return the middle of the region that the planner proposes, (3,) [m].

        Raises:
            MaskMissingError: No region that is seen is worth a cycle.
        """
        plan = self.planned(self._surface)
        for proposal in plan.proposals:
            if _seen_share(proposal.target, self._surface) >= LEAST_SEEN:
                return proposal.target.center_w
        why = plan.nothing_left or "too little was measured of those that are"
        raise MaskMissingError(f"no region of the pile is worth a cycle: {why}")

    @override
    def patch(self, place_w: NDArray[np.float64], shot: Shot) -> Pixels:
        """Return the pixels of a shot that show the soil of the region around a place.

        Raises:
            ConfigurationError: The bucket does not reach the place, or a keep-out zone bars it.
        """
        require_pointable(place_w)
        rated = self.rated(place_w[None], self._surface)
        where = ", ".join(f"{length:.1f}" for length in place_w[:2])
        require(not rated.is_barred[0], f"the place ({where}) m is barred by keep_out; command another one")
        return region_pixels(place_w, shot)

    def require_free(self, pixels: Pixels) -> None:
        """Check that no pixel (H, W) of a mask shows the ground of a keep-out zone.

        Raises:
            ConfigurationError: One does.
        """
        marked_w = self.shot().points_w()[pixels]
        for x_low, y_low, x_high, y_high in self._zones:
            inside = (marked_w[:, :2] > (x_low, y_low)) & (marked_w[:, :2] < (x_high, y_high))
            require(not inside.all(axis=1).any(), "the mask reaches into a zone of keep_out; command another place")

    def planned(self, surface: SeenSurface) -> Plan:
        """Return what the planner of pile clearing proposes for a surface."""
        return plan_targets(surface, self._zones)

    def rated(self, places_w: NDArray[np.float64], surface: SeenSurface) -> Candidates:
        """Return how that planner rates places (n, 3) [m]."""
        return rate(places_w, surface, self._zones)


def _seen_share(region: Target, surface: SeenSurface) -> float:
    """Return the part of a region's ground that is seen; the planner looks at the way of the cut only."""
    x_w, y_w = np.meshgrid(surface.x_w, surface.y_w, indexing="ij")
    is_in = region.contains(np.stack([x_w, y_w], axis=-1))
    return float(surface.is_seen[is_in].mean())
