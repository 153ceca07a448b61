import mujoco
import numpy as np
import pytest

from lerobot_excav.envs.machines.fr5.rendering import WorkcellRenderer


@pytest.fixture
def renderer(started):
    renderer = WorkcellRenderer(started, height=96, width=128)
    yield renderer
    renderer.close()


def test_masks_are_apart_and_cover_blocks_of_their_colour(renderer, scene):
    picture, masks = renderer.render("main"), renderer.block_pixels()
    assert masks.sum(axis=0).max() == 1
    assert masks.sum(axis=(1, 2)).min() >= 20
    for rgb, mask in zip(scene.block_rgb, masks, strict=True):
        shown = picture[mask].mean(axis=0)
        # Light scales a colour; its direction stays.
        cosine = shown @ rgb / np.linalg.norm(shown) / np.linalg.norm(rgb)
        assert cosine > 0.98
    assert np.array_equal(renderer.render("main"), picture)


def test_masks_ignore_the_arm(renderer, started):
    before = renderer.block_pixels()
    # Reach over the blocks: the picture changes, the masks do not.
    for name, value in zip(("j1", "j2", "j3"), (-0.3, -1.3, 2.0), strict=True):
        started.data.joint(name).qpos = value
    mujoco.mj_forward(started.model, started.data)
    assert np.array_equal(renderer.block_pixels(), before)


def test_depth_is_the_distance_of_the_blocks_along_the_optical_axis(renderer, started):
    depth_m = renderer.depth_m("main")
    assert (depth_m.shape, depth_m.dtype) == ((96, 128), np.float32)
    camera = started.data.camera("main")
    axis_w = -camera.xmat.reshape(3, 3)[:, 2]
    for pos_w, mask in zip(started.block_pos_w, renderer.block_pixels(), strict=True):
        assert np.abs(depth_m[mask] - (pos_w - camera.xpos) @ axis_w).max() < 0.035  # half a diagonal
