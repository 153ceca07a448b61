"""A real pile before a real camera that measures depth, as a view for mask sources."""

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
from lerobot_excav.envs.tasks.scoop.region_pixels import region_pixels


class PileView(PictureView):
    """A picture whose targets are dig regions; nobody commands one, so the planner of pile clearing does.

    Args:
        picture: (H, W, 3) uint8.
        key: By which files of masks name it.
        words: What people say of the target.
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
        depth_m: NDArray[np.float32],
        camera: PinholeCamera,
        zones: tuple[Zone, ...] = (),
    ) -> None:
        super().__init__(picture, key=key, words=words, depth_m=depth_m, camera=camera)
        self._zones = zones

    @override
    def place_w(self, command: Command) -> NDArray[np.float64]:
        """Return the middle of the region that the planner proposes, (3,) [m].

        Raises:
            MaskMissingError: No region is worth a cycle.
        """
        plan = self.planned(see_surface(self.depth_m(), self.camera))
        if not plan.proposals:
            raise MaskMissingError("the planner finds no region of the pile that is worth a cycle")
        return plan.proposals[0].target.center_w

    @override
    def patch(self, place_w: NDArray[np.float64], shot: Shot) -> Pixels:
        """Return the pixels of a shot that show the soil of the region around a place."""
        return region_pixels(place_w, shot)

    def planned(self, surface: SeenSurface) -> Plan:
        """Return what the planner of pile clearing proposes for a surface."""
        return plan_targets(surface, self._zones)

    def rated(self, places_w: NDArray[np.float64], surface: SeenSurface) -> Candidates:
        """Return how that planner rates places (n, 3) [m]."""
        return rate(places_w, surface, self._zones)
