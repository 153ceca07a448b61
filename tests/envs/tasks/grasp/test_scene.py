import numpy as np
import pytest

from lerobot_excav.envs.machines.fr5 import layout
from lerobot_excav.envs.tasks.grasp.scene import draw_scene
from lerobot_excav.envs.tasks.settings import TARGETS_PER_SCENE
from lerobot_excav.errors import ConfigurationError

SCENES = [draw_scene("train", i) for i in range(50)]


def test_four_blocks_of_other_colours_lie_in_their_area_and_apart():
    assert layout.BLOCK_COUNT == TARGETS_PER_SCENE
    for scene in SCENES:
        x_w, y_w, z_w = scene.block_pos_w.T
        for along_w, (low, high) in ((x_w, layout.BLOCK_AREA_X_W), (y_w, layout.BLOCK_AREA_Y_W)):
            assert low <= along_w.min() <= along_w.max() <= high
        assert (z_w == layout.BLOCK_REST_M).all()
        distance = np.linalg.norm(scene.block_pos_w[:, None] - scene.block_pos_w[None], axis=-1)
        assert distance[~np.eye(4, dtype=bool)].min() >= layout.BLOCK_SPACING_M
        assert len({tuple(rgb) for rgb in scene.block_rgb}) == layout.BLOCK_COUNT


def test_the_same_number_gives_the_same_scene_which_cannot_be_changed():
    draw_scene.cache_clear()
    again = draw_scene("train", 7)
    for field in ("block_pos_w", "block_yaw", "block_rgb", "table_rgb", "light_dir_w", "joint_pos"):
        array = getattr(again, field)
        assert np.array_equal(array, getattr(SCENES[7], field))
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


@pytest.mark.parametrize("field", ["block_pos_w", "block_rgb", "joint_pos", "table_rgb"])
def test_scene_sets_share_no_scene(field):
    drawn = {getattr(draw_scene(s, i), field).tobytes() for s in ("train", "val", "test") for i in range(50)}
    assert len(drawn) >= 150 if field != "block_rgb" else len(drawn) > 50


def test_colour_tells_nothing_of_the_place():
    """Over many scenes each colour is as often left of the middle as right of it."""
    left = {}
    for i in range(300):
        scene = draw_scene("train", i)
        for rgb, position_w in zip(scene.block_rgb, scene.block_pos_w, strict=True):
            left.setdefault(tuple(rgb), []).append(position_w[1] < 0.5)
    for sides in left.values():
        assert abs(np.mean(sides) - 0.5) < 4 * 0.5 / np.sqrt(len(sides))


@pytest.mark.parametrize(("scene_set", "scene_id"), [("holdout", 0), ("train", -1)])
def test_an_impossible_scene_is_refused(scene_set, scene_id):
    with pytest.raises(ConfigurationError):
        draw_scene(scene_set, scene_id)
