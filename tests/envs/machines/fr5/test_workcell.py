import numpy as np
import pytest

from lerobot_excav.envs.machines.fr5.workcell import Workcell
from lerobot_excav.envs.tasks.grasp.scene import draw_scene
from lerobot_excav.errors import ConfigurationError

SCENE = draw_scene("train", 1)
HOLD = np.append(SCENE.joint_pos, 1.0)


def test_blocks_rest_where_the_scene_puts_them(workcell):
    workcell.reset(SCENE)
    assert workcell.block_pos_w == pytest.approx(SCENE.block_pos_w, abs=5e-4)
    assert workcell.block_speed.max() < 1e-2


def test_same_actions_give_bit_equal_traces(workcell):
    def trace(cell):
        cell.reset(SCENE)
        rng = np.random.default_rng(3)
        states = []
        for _ in range(30):
            cell.tick(HOLD + np.append(rng.normal(0, 0.2, 6), -rng.uniform()))
            states.append(cell.data.qpos.copy())
        return np.array(states)

    first = trace(workcell)
    assert np.array_equal(first, trace(workcell))
    assert np.array_equal(first, trace(Workcell()))


def test_a_tick_lasts_a_fiftieth_of_a_second(workcell):
    workcell.reset(SCENE)
    workcell.tick(HOLD)
    assert workcell.data.time == pytest.approx(0.02, abs=1e-12)


def test_targets_beyond_the_limits_are_clipped(workcell):
    workcell.reset(SCENE)
    for _ in range(100):
        workcell.tick(np.array([*SCENE.joint_pos[:5], 100.0, 7.0]))
    assert workcell.joint_pos[5] <= np.radians(175) + 1e-2
    assert workcell.opening <= 1.0 + 1e-3


@pytest.mark.parametrize("action", [np.zeros(6), np.full(7, np.nan), np.zeros((1, 7))])
def test_an_unusable_action_is_refused(workcell, action):
    workcell.reset(SCENE)
    with pytest.raises(ConfigurationError, match="action"):
        workcell.tick(action)


def test_a_block_between_closed_fingers_is_touched_by_both(workcell):
    workcell.reset(SCENE)
    assert not workcell.fingers_touching().any()
    # Put block 2 between the pads and close.
    joint = workcell.data.joint("block2")
    joint.qpos[:3] = workcell.grasp_pos_w
    joint.qpos[3:] = [1, 0, 0, 0]
    joint.qvel[:] = 0
    gravity = workcell.model.opt.gravity.copy()
    workcell.model.opt.gravity[:] = 0
    try:
        for _ in range(40):
            workcell.tick(np.append(SCENE.joint_pos, 0.0))
    finally:
        workcell.model.opt.gravity[:] = gravity
    assert workcell.fingers_touching()[:, 2].all()
    assert not np.delete(workcell.fingers_touching(), 2, axis=1).any()
    assert workcell.opening == pytest.approx(0.04 / 0.12, abs=0.02)
