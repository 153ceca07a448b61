import numpy as np
import pytest

from lerobot_excav.envs.machines.fr5.workcell import Workcell


@pytest.fixture
def holding(scene):
    return np.append(scene.joint_pos, 1.0)


def test_blocks_rest_where_the_scene_puts_them(started, scene):
    assert started.block_pos_w == pytest.approx(scene.block_pos_w, abs=5e-4)
    assert started.block_speed.max() < 1e-2


def test_same_actions_give_bit_equal_traces(workcell, scene, holding):
    def trace(cell):
        cell.reset(scene)
        rng = np.random.default_rng(3)
        states = []
        for _ in range(30):
            cell.tick(holding + np.append(rng.normal(0, 0.2, 6), -rng.uniform()))
            states.append(cell.data.qpos.copy())
        return np.array(states)

    first = trace(workcell)
    assert np.array_equal(first, trace(workcell))
    assert np.array_equal(first, trace(Workcell()))


def test_targets_beyond_the_limits_are_clipped(started, scene):
    for _ in range(100):
        started.tick(np.array([*scene.joint_pos[:5], 100.0, 7.0]))
    assert started.joint_pos[5] <= np.radians(175) + 1e-2
    assert started.opening <= 1.0 + 1e-3
