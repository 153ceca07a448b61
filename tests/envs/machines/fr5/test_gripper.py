import numpy as np
import pytest

from lerobot_excav.envs.machines.fr5 import constants as const


@pytest.fixture
def run(started, scene):
    """Give the gripper a target for some ticks; returns its openings."""

    def run_started(target, ticks):
        openings = []
        for _ in range(ticks):
            started.tick(np.append(scene.joint_pos, target))
            openings.append(started.opening)
        return np.array(openings)

    return run_started


def test_gripper_starts_open_and_reaches_what_is_asked_for_with_mirrored_fingers(started, run):
    assert started.opening == pytest.approx(1.0, abs=1e-3)
    for opening in (0.0, 0.5, 1.0, 0.62):
        assert run(opening, 60)[-1] == pytest.approx(opening, abs=0.01)
    run(0.3, 5)  # on the way
    wide, narrow = (started.data.joint(name).qpos[0] for name in const.FINGER_NAMES)
    assert wide == pytest.approx(narrow, abs=5e-4)


def test_fingers_keep_their_speed_limit(run):
    speed = np.abs(np.diff(run(0.0, 20))) * const.FINGER_STROKE_M / const.TICK_S
    assert 0.5 * const.FINGER_SPEED_M_S < speed.max() <= 1.05 * const.FINGER_SPEED_M_S


def test_fingers_touch_the_block_between_them_and_press_with_their_largest_force_at_most(started, run):
    assert not started.fingers_touching().any()
    # A block held between the pads as they close: they stop 2 cm before their targets, which asks for twice that force.
    joint, place = started.data.joint("block2"), [*started.grasp_pos_w, 1, 0, 0, 0]
    for _ in range(30):
        joint.qpos[:], joint.qvel[:] = place, 0
        run(0.0, 1)
    assert np.array_equal(started.fingers_touching(), [np.arange(4) == 2] * 2)
    assert started.opening == pytest.approx(0.04 / 0.12, abs=0.02)
    assert started.data.actuator("gripper").force[0] == pytest.approx(-2 * const.FINGER_FORCE_N, rel=1e-9)
