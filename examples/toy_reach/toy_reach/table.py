"""The machine and its surroundings: a disc on a table with four coloured spots, and its pictures."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.machines.pinhole import CameraPose, PinholeCamera
from lerobot_excav.envs.tasks.settings import SCENE_SETS, TaskSettings

SPOT_RADIUS_M = 0.12
RING_RADIUS_M = 0.16
SPEED_M_S = 1.0
SPOT_RGB = np.array([(210, 40, 40), (40, 160, 60), (50, 70, 210), (220, 190, 40)], np.uint8)
WHITE_RGB, BLUE_RGB = np.array([(255, 255, 255), (40, 110, 235)], np.uint8)
TABLE_RGB = {"wood": (150, 115, 80), "ice": (190, 215, 235)}
SLIP = {"wood": 0.0, "ice": 0.9}
"""Share of its velocity that the disc keeps from tick to tick."""


def draw_spots(scene_set: str, scene_id: int) -> NDArray[np.float64]:
    """Draw the middles of four spots, one in each quarter of the table, (4, 2) [m]."""
    rng = np.random.default_rng((0x70, SCENE_SETS.index(scene_set), scene_id))
    quarters = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
    return rng.permutation(quarters) + rng.uniform(-0.25, 0.25, (4, 2))


def nearest_target(settings: TaskSettings, scene_id: int, stage: int) -> int:
    """Return the spot nearest to the middle, where the disc starts; this task has no stages."""
    return int(np.argmin(np.linalg.norm(draw_spots(settings.scene_set, scene_id), axis=1)))


class Table:
    """A disc on a table of 2 m x 2 m.

    Args:
        surface: `wood` or `ice`.
    """

    def __init__(self, surface: str) -> None:
        self.surface = surface
        self.reset(np.zeros((4, 2)))

    def reset(self, spots_w: NDArray[np.float64]) -> None:
        """Put the disc into the middle of a table with spots, (4, 2) [m]."""
        self.spots_w = spots_w
        self.pos_w = np.zeros(2)
        self.vel_w = np.zeros(2)

    def tick(self, action: NDArray[np.float64]) -> None:
        """Advance by one tick under velocity commands (2,) in [-1, 1]."""
        slip = SLIP[self.surface]
        self.vel_w = slip * self.vel_w + (1.0 - slip) * SPEED_M_S * np.clip(action, -1.0, 1.0)
        self.pos_w = np.clip(self.pos_w + TICK_S * self.vel_w, -1.0, 1.0)


class TableRenderer:
    """Draws the table from above, by hand.

    Args:
        table: The table.
        height: Image height [px].
        width: Image width [px].
    """

    def __init__(self, table: Table, *, height: int, width: int) -> None:
        self._table = table
        pose = CameraPose((0.0, -0.01, 2.5), (0.0, 0.0, 0.0), 50.0)
        self._camera = PinholeCamera(
            position_w=np.array(pose.position),
            axes_w=pose.axes,
            fovy_rad=np.radians(pose.fovy_deg),
            height=height,
            width=width,
        )
        # The plane z = 0 of the table along every ray.
        rays_w = self._camera.points_w(np.ones((height, width))) - self._camera.position_w
        self._depth = -pose.position[2] / rays_w[..., 2]
        self._marked: dict[int, NDArray[np.uint8]] = {}
        self.ground_w = (self._camera.position_w + self._depth[..., None] * rays_w)[..., :2]

    def spot_pixels(self, spot: int) -> NDArray[np.bool_]:
        """Return the pixels that show a spot without the disc, (H, W) bool."""
        distance = np.linalg.norm(self.ground_w - self._table.spots_w[spot], axis=-1)
        return np.asarray(distance <= SPOT_RADIUS_M)

    def mark(self, commanded: int, *, shown: int | None = None) -> None:
        """Draw a white ring around the commanded spot, and a blue one around what a policy was shown in its place."""
        self._marked = {commanded: WHITE_RGB} | ({} if shown is None else {shown: BLUE_RGB})

    def render(self, camera: str) -> NDArray[np.uint8]:
        """Return a colour picture (H, W, 3); all but `main` are brighter, which is all that tells them apart."""
        picture = np.tile(np.array(TABLE_RGB[self._table.surface], np.uint8), (*self._depth.shape, 1))
        for spot, rgb in enumerate(SPOT_RGB):
            picture[self.spot_pixels(spot)] = rgb
        for spot, ring_rgb in self._marked.items():
            distance = np.linalg.norm(self.ground_w - self._table.spots_w[spot], axis=-1)
            picture[np.abs(distance - RING_RADIUS_M) < 0.02] = ring_rgb
        picture[np.linalg.norm(self.ground_w - self._table.pos_w, axis=-1) < 0.06] = 20
        return picture if camera == "main" else np.clip(picture, 0, 215).astype(np.uint8) + np.uint8(40)

    def depth_m(self, camera: str) -> NDArray[np.float32]:
        """Return the distance along the optical axis (H, W) [m]."""
        return self._depth.astype(np.float32)

    def camera(self, camera: str) -> PinholeCamera:
        """Return the camera."""
        return self._camera

    def close(self) -> None:
        """Do nothing: there is no graphics context."""
