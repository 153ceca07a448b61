"""Scenes of the work cell: everything that is drawn before the first action, from a scene set and a number."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.fr5 import layout
from lerobot_excav.envs.machines.fr5.constants import HOME_JOINT_POS
from lerobot_excav.envs.machines.fr5.look import WorkcellLook
from lerobot_excav.envs.tasks.settings import SCENE_SETS
from lerobot_excav.errors import ExcavError, require, require_choice

# Names this family of random streams; changing it changes every scene, so it changes with the scene's definition only.
_STREAM = 0xF125
_PLACING_TRIES = 1000

HOME_SPREAD_RAD = 0.03
"""Standard deviation of the starting joint positions around the home pose [rad] (kind: guess)."""

# Colours that stand out from table, tray and gripper (kind: guess).
BLOCK_COLOURS = (
    (0.85, 0.12, 0.12),
    (0.12, 0.30, 0.85),
    (0.10, 0.62, 0.22),
    (0.95, 0.80, 0.10),
    (0.95, 0.50, 0.08),
    (0.55, 0.20, 0.70),
)


@dataclass(frozen=True, kw_only=True)
class GraspScene:
    """One starting situation of the work cell. Its arrays are read-only.

    Attributes:
        scene_set: `train`, `val` or `test`; their random streams are disjoint.
        scene_id: Number within the set.
        block_pos_w: Centres of the blocks [m], (4, 3), world frame; the block with index i is target i.
        block_yaw: Turn of the blocks about z [rad], (4,).
        look: Colours and light; the colours of the blocks are drawn apart from their places.
        joint_pos: Joint positions of the arm [rad], (6,).
    """

    scene_set: str
    scene_id: int
    block_pos_w: NDArray[np.float64]
    block_yaw: NDArray[np.float64]
    look: WorkcellLook
    joint_pos: NDArray[np.float64]


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
    block_pos_w = _draw_block_pos_w(place_rng)
    block_yaw = place_rng.uniform(-layout.BLOCK_YAW_RAD, layout.BLOCK_YAW_RAD, size=layout.BLOCK_COUNT)
    joint_pos = HOME_JOINT_POS + pose_rng.normal(0.0, HOME_SPREAD_RAD, size=HOME_JOINT_POS.shape)
    look = _draw_look(look_rng)
    for array in (block_pos_w, block_yaw, joint_pos, look.block_rgb, look.table_rgb, look.light_dir_w):
        array.flags.writeable = False
    return GraspScene(
        scene_set=scene_set,
        scene_id=scene_id,
        block_pos_w=block_pos_w,
        block_yaw=block_yaw,
        look=look,
        joint_pos=joint_pos,
    )


def _draw_look(rng: np.random.Generator) -> WorkcellLook:
    tilt = rng.uniform(-0.4, 0.4, size=2)
    return WorkcellLook(
        block_rgb=rng.permutation(BLOCK_COLOURS)[: layout.BLOCK_COUNT],
        table_rgb=np.full(3, rng.uniform(0.55, 0.8)) + rng.uniform(-0.04, 0.04, size=3),
        light_dir_w=np.append(tilt, -1.0) / np.linalg.norm(np.append(tilt, -1.0)),
        light=float(rng.uniform(0.5, 0.8)),
    )


def _draw_block_pos_w(rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw places until no two blocks are closer than the least spacing."""
    low = [layout.BLOCK_AREA_X_W[0], layout.BLOCK_AREA_Y_W[0]]
    high = [layout.BLOCK_AREA_X_W[1], layout.BLOCK_AREA_Y_W[1]]
    for _ in range(_PLACING_TRIES):
        xy_w = rng.uniform(low, high, size=(layout.BLOCK_COUNT, 2))
        distance = np.linalg.norm(xy_w[:, None] - xy_w[None], axis=-1)
        if distance[np.triu_indices(layout.BLOCK_COUNT, 1)].min() >= layout.BLOCK_SPACING_M:
            height = np.full((layout.BLOCK_COUNT, 1), layout.block_rest_height_m())
            return np.concatenate([xy_w, height], axis=1)
    raise ExcavError(
        f"no free places for {layout.BLOCK_COUNT} blocks in {_PLACING_TRIES} draws; report this scene"
    )
