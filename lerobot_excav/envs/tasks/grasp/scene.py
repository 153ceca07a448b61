"""Scenes of the work cell: everything that is drawn before the first action, from a scene set and a number."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.fr5 import layout
from lerobot_excav.envs.machines.fr5.constants import HOME_JOINT_POS
from lerobot_excav.envs.machines.fr5.workcell import WorkcellStart
from lerobot_excav.envs.tasks.settings import SCENE_SETS
from lerobot_excav.errors import ExcavError, require, require_choice

# Names this family of random streams; changing it changes every scene, so it changes with the scene's definition only.
_STREAM = 0xF125
_PLACING_TRIES = 1000

HOME_SPREAD_RAD = 0.03
"""Standard deviation of the starting joint positions around the home pose [rad] (kind: guess)."""

# Colours that stand out from table, tray and gripper (kind: guess).
BLOCK_COLOUR_NAMES = {
    "red": (0.85, 0.12, 0.12),
    "blue": (0.12, 0.30, 0.85),
    "green": (0.10, 0.62, 0.22),
    "yellow": (0.95, 0.80, 0.10),
    "orange": (0.95, 0.50, 0.08),
    "purple": (0.55, 0.20, 0.70),
}
BLOCK_COLOURS = tuple(BLOCK_COLOUR_NAMES.values())


@dataclass(frozen=True, kw_only=True)
class GraspScene(WorkcellStart):
    """One starting situation of the work cell; the block with index i is target i."""

    scene_set: str  # `train`, `val` or `test`; their random streams are disjoint
    scene_id: int  # number within the set

    def colour_name(self, block: int) -> str:
        """Return what people call the colour of a block."""
        away = {name: float(np.abs(self.block_rgb[block] - rgb).max()) for name, rgb in BLOCK_COLOUR_NAMES.items()}
        return min(away, key=lambda name: away[name])


@lru_cache(maxsize=8)
def draw_scene(scene_set: str, scene_id: int) -> GraspScene:
    """Draw a scene; the same arguments give the same scene, byte for byte.

    Args:
        scene_set: One of `settings.SCENE_SETS`. No scene of one set can occur in another.
        scene_id: Any integer from 0.

    Raises:
        ConfigurationError: An argument is not one of the allowed values.
    """
    require_choice("scene_set", scene_set, SCENE_SETS)
    require(scene_id >= 0, f"scene_id={scene_id} is negative; scenes are numbered from 0")
    # The set is part of the spawn key, so streams of two sets never coincide whatever the scene's number is.
    stream = np.random.SeedSequence(_STREAM, spawn_key=(SCENE_SETS.index(scene_set), scene_id))
    place_rng, look_rng, pose_rng = (np.random.default_rng(s) for s in stream.spawn(3))
    tilt = look_rng.uniform(-0.4, 0.4, size=2)
    arrays = {
        "block_pos_w": _draw_block_pos_w(place_rng),
        "block_yaw": place_rng.uniform(-layout.BLOCK_YAW_RAD, layout.BLOCK_YAW_RAD, size=layout.BLOCK_COUNT),
        # The colours are drawn apart from the places: only the mask names a block.
        "block_rgb": look_rng.permutation(BLOCK_COLOURS)[: layout.BLOCK_COUNT],
        "table_rgb": np.full(3, look_rng.uniform(0.55, 0.8)) + look_rng.uniform(-0.04, 0.04, size=3),
        "light_dir_w": np.append(tilt, -1.0) / np.linalg.norm(np.append(tilt, -1.0)),
        "joint_pos": HOME_JOINT_POS + pose_rng.normal(0.0, HOME_SPREAD_RAD, size=HOME_JOINT_POS.shape),
    }
    for array in arrays.values():
        array.flags.writeable = False
    return GraspScene(scene_set=scene_set, scene_id=scene_id, light=float(look_rng.uniform(0.5, 0.8)), **arrays)


def _draw_block_pos_w(rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw places until no two blocks are closer than the least spacing."""
    low, high = np.transpose([layout.BLOCK_AREA_X_W, layout.BLOCK_AREA_Y_W])
    for _ in range(_PLACING_TRIES):
        xy_w = rng.uniform(low, high, size=(layout.BLOCK_COUNT, 2))
        distance = np.linalg.norm(xy_w[:, None] - xy_w[None], axis=-1)
        if distance[np.triu_indices(layout.BLOCK_COUNT, 1)].min() >= layout.BLOCK_SPACING_M:
            height = np.full((layout.BLOCK_COUNT, 1), layout.BLOCK_REST_M)
            return np.concatenate([xy_w, height], axis=1)
    raise ExcavError(f"no free places for {layout.BLOCK_COUNT} blocks in {_PLACING_TRIES} draws; report this scene")
