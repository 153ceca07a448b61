import numpy as np
import pytest

from lerobot_excav.envs.machines.fr5 import layout
from lerobot_excav.envs.tasks.grasp.scene import draw_scene
from lerobot_excav.envs.tasks.settings import TARGETS_PER_SCENE
from lerobot_excav.errors import ConfigurationError

SCENES = [draw_scene("train", i) for i in range(50)]


def test_blocks_lie_in_their_area_and_apart():
    for scene in SCENES:
        x_w, y_w, z_w = scene.block_pos_w.T
        assert x_w.min() >= layout.BLOCK_AREA_X_W[0]
        assert x_w.max() <= layout.BLOCK_AREA_X_W[1]
        assert y_w.min() >= layout.BLOCK_AREA_Y_W[0]
        assert y_w.max() <= layout.BLOCK_AREA_Y_W[1]
        assert (z_w == layout.BLOCK_REST_M).all()
        distance = np.linalg.norm(scene.block_pos_w[:, None] - scene.block_pos_w[None], axis=-1)
        assert distance[~np.eye(4, dtype=bool)].min() >= layout.BLOCK_SPACING_M


def test_every_block_is_a_target():
    assert layout.BLOCK_COUNT == TARGETS_PER_SCENE


def test_the_same_number_gives_the_same_scene():
    draw_scene.cache_clear()
    again = draw_scene("train", 7)
    assert np.array_equal(again.block_pos_w, SCENES[7].block_pos_w)
    assert np.array_equal(again.block_rgb, SCENES[7].block_rgb)


@pytest.mark.parametrize("field", ["block_pos_w", "block_rgb", "joint_pos", "table_rgb"])
def test_scene_sets_share_no_scene(field):
    drawn = {getattr(draw_scene(s, i), field).tobytes() for s in ("train", "val", "test") for i in range(50)}
    assert len(drawn) >= 150 if field != "block_rgb" else len(drawn) > 50


def test_colours_of_a_scene_differ():
    for scene in SCENES:
        assert len({tuple(rgb) for rgb in scene.block_rgb}) == layout.BLOCK_COUNT


def test_colour_tells_nothing_of_the_place():
    """Over many scenes each colour is as often left of the middle as right of it."""
    left = {}
    for i in range(300):
        scene = draw_scene("train", i)
        for rgb, position_w in zip(scene.block_rgb, scene.block_pos_w, strict=True):
            left.setdefault(tuple(rgb), []).append(position_w[1] < 0.5)
    for sides in left.values():
        assert abs(np.mean(sides) - 0.5) < 4 * 0.5 / np.sqrt(len(sides))


def test_arrays_of_a_scene_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        SCENES[0].joint_pos[0] = 1.0


@pytest.mark.parametrize(("scene_set", "scene_id"), [("holdout", 0), ("train", -1)])
def test_an_impossible_scene_is_refused(scene_set, scene_id):
    with pytest.raises(ConfigurationError):
        draw_scene(scene_set, scene_id)
