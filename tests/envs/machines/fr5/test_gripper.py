import numpy as np
import pytest

from lerobot_excav.envs.machines.fr5 import constants as const
from lerobot_excav.envs.tasks.grasp.scene import draw_scene

SCENE = draw_scene("train", 0)


def run(workcell, opening, ticks):
    openings = []
    for _ in range(ticks):
        workcell.tick(np.append(SCENE.joint_pos, opening))
        openings.append(workcell.opening)
    return np.array(openings)


def test_gripper_starts_open(workcell):
    workcell.reset(SCENE)
    assert workcell.opening == pytest.approx(1.0, abs=1e-3)


def test_gripper_reaches_what_is_asked_for(workcell):
    workcell.reset(SCENE)
    for opening in (0.0, 0.5, 1.0, 0.62):
        assert run(workcell, opening, 60)[-1] == pytest.approx(opening, abs=0.01)


def test_fingers_are_mirrored(workcell):
    workcell.reset(SCENE)
    run(workcell, 0.3, 5)
    wide, narrow = (workcell.data.joint(name).qpos[0] for name in const.FINGER_NAMES)
    assert wide == pytest.approx(narrow, abs=5e-4)


def test_fingers_keep_their_speed_limit(workcell):
    workcell.reset(SCENE)
    speed = np.abs(np.diff(run(workcell, 0.0, 20))) * const.FINGER_STROKE_M / const.CONTROL_TICK_S
    assert 0.5 * const.FINGER_SPEED_M_S < speed.max() <= 1.05 * const.FINGER_SPEED_M_S


def test_fingers_press_with_their_largest_force_at_most(workcell):
    workcell.reset(SCENE)
    # A block held between the pads as they close: they stop 2 cm before their targets, which asks for twice that force.
    joint = workcell.data.joint("block2")
    place = [*workcell.grasp_pos_w, 1, 0, 0, 0]
    for _ in range(30):
        joint.qpos[:], joint.qvel[:] = place, 0
        run(workcell, 0.0, 1)
    assert workcell.fingers_touching()[:, 2].all()
    assert workcell.data.actuator("gripper").force[0] == pytest.approx(-2 * const.FINGER_FORCE_N, rel=1e-9)
