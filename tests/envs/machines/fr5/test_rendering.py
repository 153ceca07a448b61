import mujoco
import numpy as np
import pytest

from lerobot_excav.envs.machines.fr5.rendering import WorkcellRenderer
from lerobot_excav.envs.tasks.grasp.scene import draw_scene
from lerobot_excav.errors import ConfigurationError, RenderingError

SCENE = draw_scene("train", 3)


@pytest.fixture
def renderer(workcell):
    workcell.reset(SCENE)
    renderer = WorkcellRenderer(workcell, height=96, width=128)
    yield renderer
    renderer.close()


def test_pictures_show_colours_of_every_block(renderer):
    for camera in ("main", "top"):
        picture = renderer.render(camera)
        assert picture.shape == (96, 128, 3)
        assert picture.dtype == np.uint8
        assert np.unique(picture.reshape(-1, 3), axis=0).shape[0] > 20


def test_masks_cover_blocks_of_their_colour(renderer):
    picture = renderer.render("main").astype(float)
    for rgb, mask in zip(SCENE.block_rgb, renderer.block_pixels(), strict=True):
        seen = picture[mask].mean(axis=0)
        # Light scales a colour; its direction stays.
        cosine = seen @ rgb / np.linalg.norm(seen) / np.linalg.norm(rgb)
        assert cosine > 0.98


def test_masks_of_a_scene_are_apart_and_of_a_size_to_be_seen(renderer):
    masks = renderer.block_pixels()
    assert masks.sum(axis=0).max() == 1
    assert masks.sum(axis=(1, 2)).min() >= 20


def test_masks_ignore_the_arm(renderer, workcell):
    before = renderer.block_pixels()
    # Reach over the blocks: the picture changes, the masks do not.
    for name, value in zip(("j1", "j2", "j3"), (-0.3, -1.3, 2.0), strict=True):
        workcell.data.joint(name).qpos = value
    mujoco.mj_forward(workcell.model, workcell.data)
    assert np.array_equal(renderer.block_pixels(), before)


def test_drawing_masks_leaves_pictures_as_they_were(renderer):
    before = renderer.render("main")
    renderer.block_pixels()
    assert np.array_equal(renderer.render("main"), before)


def test_depth_is_the_distance_of_the_blocks_along_the_optical_axis(renderer, workcell):
    depth_m = renderer.depth_m("main")
    assert (depth_m.shape, depth_m.dtype) == ((96, 128), np.float32)
    camera = workcell.data.camera("main")
    axis_w = -camera.xmat.reshape(3, 3)[:, 2]
    for pos_w, mask in zip(workcell.block_pos_w, renderer.block_pixels(), strict=True):
        on_block = depth_m[mask]
        assert np.abs(on_block - (pos_w - camera.xpos) @ axis_w).max() < 0.035  # half a diagonal


def test_an_unknown_camera_is_refused(renderer):
    with pytest.raises(ConfigurationError, match="camera"):
        renderer.render("cab")


def test_a_closed_renderer_says_so(renderer):
    renderer.close()
    with pytest.raises(RenderingError, match="closed"):
        renderer.render("main")
