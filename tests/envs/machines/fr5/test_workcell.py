import numpy as np
import pytest


def test_blocks_rest_where_the_scene_puts_them(started, scene):
    assert started.block_pos_w == pytest.approx(scene.block_pos_w, abs=5e-4)
    assert started.block_speed.max() < 1e-2


def test_targets_beyond_the_limits_are_clipped(started, scene):
    for _ in range(100):
        started.tick(np.array([*scene.joint_pos[:5], 100.0, 7.0]))
    assert started.joint_pos[5] <= np.radians(175) + 1e-2
    assert started.opening <= 1.0 + 1e-3
