"""Scenes: everything that is drawn before the first action, from a scene set and a number."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.appearance import draw_appearance
from lerobot_excav.envs.machines.excavator.kinematics import inverse
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M, SOIL_CELL_SIZE_M
from lerobot_excav.envs.machines.excavator.worksite import WorksiteStart
from lerobot_excav.envs.soil import PRESETS, SoilParameters
from lerobot_excav.envs.tasks.scoop.pile import PILES, draw_pile
from lerobot_excav.envs.tasks.scoop.targets import Target, TooFewTargetsError, find_targets
from lerobot_excav.envs.tasks.settings import SCENE_SETS
from lerobot_excav.errors import ExcavError, require, require_choice

# Names this family of random streams; changing it changes every scene, so it changes with the scene's definition only.
_STREAM = 0xE8CA8
_PILE_TRIES = 50


@dataclass(frozen=True, kw_only=True)
class Scene(WorksiteStart):
    """One starting situation of the worksite, with what can be commanded in it."""

    scene_set: str  # `train`, `val` or `test`; their random streams are disjoint
    scene_id: int  # number within the set
    soil: str | SoilParameters  # name of the soil preset, or parameters of one's own
    targets: tuple[Target, ...]  # the feasible dig regions, indexed by `target_id`


def cell_centres_w() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the soil's cell centres along x and y [m], shapes (nx,) and (ny,), world frame."""
    counts = [round(extent / SOIL_CELL_SIZE_M) for extent in DIG_AREA_EXTENT_M]
    x_w, y_w = (SOIL_CELL_SIZE_M * (np.arange(n, dtype=np.float64) + 0.5 - 0.5 * n) for n in counts)
    return np.asarray(x_w), np.asarray(y_w)


@lru_cache(maxsize=8)
def draw_scene(scene_set: str, scene_id: int, *, soil: str | SoilParameters = "sand", pile: str = "heaps") -> Scene:
    """Draw a scene; the same arguments give the same scene, byte for byte.

    Drawing takes most of a reset, and the targets of a scene are played one after the other: the last scenes are kept.
    Their arrays are read-only.

    Args:
        scene_set: One of `settings.SCENE_SETS`. No scene of one set can occur in another.
        scene_id: Any integer from 0.
        soil: Name of the soil preset, or parameters, which set the slope of the pile, and its volume by their density.
        pile: Shape of the pile, one of `PILES`.

    Raises:
        ConfigurationError: An argument is not one of the allowed values.
    """
    require_choice("scene_set", scene_set, SCENE_SETS)
    if isinstance(soil, str):
        require_choice("soil", soil, tuple(PRESETS))
    require_choice("pile", pile, tuple(PILES))
    require(scene_id >= 0, f"scene_id={scene_id} is negative; scenes are numbered from 0")
    # The set is part of the spawn key, so streams of two sets never coincide whatever the scene's number is.
    stream = np.random.SeedSequence(_STREAM, spawn_key=(SCENE_SETS.index(scene_set), scene_id))
    pile_rng, pose_rng, look_rng = (np.random.default_rng(s) for s in stream.spawn(3))
    heights_m, targets = _draw_pile_with_targets(pile_rng, soil, pile)
    joint_pos = _draw_joint_pos(pose_rng)
    for array in (heights_m, joint_pos, *(target.center_w for target in targets)):
        array.flags.writeable = False
    return Scene(
        scene_set=scene_set,
        scene_id=scene_id,
        soil=soil,
        heights_m=heights_m,
        joint_pos=joint_pos,
        appearance=draw_appearance(look_rng),
        targets=targets,
    )


def _draw_pile_with_targets(
    rng: np.random.Generator, soil: str | SoilParameters, pile: str
) -> tuple[NDArray[np.float64], tuple[Target, ...]]:
    """Draw piles until one offers all its targets."""
    x_w, y_w = cell_centres_w()
    parameters = PRESETS[soil] if isinstance(soil, str) else soil
    for _ in range(_PILE_TRIES):
        heights_m = draw_pile(
            rng, pile=pile, x_w=x_w, y_w=y_w, repose_tan=parameters.slope_tan, density_kg_m3=parameters.density_kg_m3
        )
        try:
            return heights_m, find_targets(heights_m, x_w, y_w, rng)
        except TooFewTargetsError:
            continue
    raise ExcavError(
        f"no pile={pile!r} of soil={soil!r} with enough dig regions in {_PILE_TRIES} draws; take a soil that "
        "rests steeper, or report this scene if it is a preset"
    )


def _draw_joint_pos(rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw a pose between pile and box, bucket raised: where the previous cycle would have left the machine."""
    while True:
        joint_pos = inverse(
            radius_m=rng.uniform(4.0, 5.0),
            height_m=rng.uniform(2.0, 2.6),
            pitch_rad=rng.uniform(-2.2, -1.4),
            swing_rad=rng.uniform(0.5, 1.2),
        )
        if joint_pos is not None:
            return joint_pos
