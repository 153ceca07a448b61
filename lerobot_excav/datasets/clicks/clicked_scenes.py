"""Scenes as a person sees them who is about to click: a sharp picture, and the mask of every target."""

from collections.abc import Iterator, Sequence
from contextlib import closing
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.masks.click.network import PICTURE_SIZE
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.shot import Shot
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.registry import env_types

CLICK_SPREAD_PX = 3.0
"""How far beside what they mean people click, standard deviation along each axis, of a picture of `PICTURE_SIZE` [px]
(kind: guess: 0.75 px of a policy's picture)."""


class ClickTarget(NamedTuple):
    """What a click may mean.

    Attributes:
        mask: What it covers, (H, W) bool.
        middle: Row and column of the middle of a region of the ground, which is where people click; None for an object,
            on which they click anywhere.
    """

    mask: NDArray[np.bool_]
    middle: tuple[float, float] | None


class ClickedScene(NamedTuple):
    """A picture (H, W, 3) uint8 of `PICTURE_SIZE`, and its targets."""

    picture: NDArray[np.uint8]
    targets: tuple[ClickTarget, ...]


def clicked_scenes(env_type: str, scene_set: str, scene_ids: Sequence[int]) -> Iterator[ClickedScene]:
    """Show scenes of an environment as they are drawn; targets that are out of sight are left out.

    Args:
        env_type: As in `--env.type`.
        scene_set: Stream of scenes.
        scene_ids: Their numbers.
    """
    height, width = PICTURE_SIZE
    env = env_types()[env_type].make_env(
        obs_type="agent_pos",
        render_mode=None,
        scene_set=scene_set,
        observation_height=height,
        observation_width=width,
    )
    with closing(env):
        for scene_id in scene_ids:
            env.reset(options={"scene_id": scene_id})
            targets = (_target(env, command) for command in (env.command, *env.other_commands()))
            yield ClickedScene(env.picture(), tuple(target for target in targets if target.mask.any()))


def _target(env: MaskedTaskEnv[Any, Any], command: Command) -> ClickTarget:
    mask, place_w = env.true_mask(command), env.place_w(command)
    shot = Shot(picture=env.picture(), depth_m=env.depth_m(), camera=env.camera)
    if place_w is None or env.patch(place_w, shot) is None:
        return ClickTarget(mask, None)
    return ClickTarget(mask, env.camera.pixel(place_w))


def click_on(target: ClickTarget, rng: np.random.Generator) -> tuple[int, int]:
    """Draw where a person clicks who means a target, missed a little; row and column."""
    middle = target.middle
    if middle is None:
        rows, columns = np.nonzero(target.mask)
        hit = int(rng.integers(len(rows)))
        middle = float(rows[hit]), float(columns[hit])
    clicked = np.rint(middle + CLICK_SPREAD_PX * rng.standard_normal(2)).astype(int)
    row, column = np.clip(clicked, 0, np.array(target.mask.shape) - 1)
    return int(row), int(column)
