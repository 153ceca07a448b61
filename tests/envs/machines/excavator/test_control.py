import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.control import RateControl, checked_action
from lerobot_excav.errors import ConfigurationError

HOME = [0.2, 0.5, -1.8, -0.6]
DT = const.SUBSTEP_S


def follow(control, command, steps):
    """Step with joints that follow their reference perfectly; return the reference positions."""
    trace = []
    for _ in range(steps):
        set_points_after(control, command, control.reference_pos.copy())
        trace.append(control.reference_pos.copy())
    return np.array(trace)


def set_points_after(control, command, joint_pos):
    set_points = np.zeros(4)
    control.step(np.array(command), np.array(joint_pos), DT, set_points)
    return set_points


@pytest.fixture
def control():
    control = RateControl()
    control.reset(HOME)
    return control


def test_zero_command_does_not_move_the_reference(control):
    np.testing.assert_array_equal(follow(control, [0.0] * 4, 1000), np.tile(HOME, (1000, 1)))


@pytest.mark.parametrize("joint", range(4))
def test_full_stick_ramps_at_the_rated_acceleration_to_the_rated_speed(control, joint):
    speeds = np.diff(follow(control, 0.5 * np.eye(4)[joint], 600)[:, joint]) / DT
    assert np.diff(speeds).max() / DT <= const.JOINT_ACCEL_RAD_S2[joint] * (1 + 1e-6)
    assert speeds.max() == pytest.approx(0.5 * const.JOINT_SPEED_RAD_S[joint])


def test_velocity_lead_cancels_the_damping_of_the_servo(control):
    set_points = set_points_after(control, [1.0, 0.0, 0.0, 0.0], HOME)
    lead = set_points[0] - control.reference_pos[0]
    force = const.SERVO_STIFFNESS_NM_RAD[0] * lead - const.SERVO_DAMPING_NMS_RAD[0] * control.reference_vel[0]
    assert force == pytest.approx(0.0, abs=1e-6)
    assert lead > 0


def test_stalled_joint_does_not_wind_up(control):
    for _ in range(2000):
        set_points_after(control, [0.0, 1.0, 0.0, 0.0], HOME)
    assert control.reference_pos[1] - HOME[1] == pytest.approx(const.SERVO_DEFLECTION_RAD)


def test_joint_pushed_away_takes_the_reference_along(control):
    pushed = [HOME[0], HOME[1] - 0.1, *HOME[2:]]
    set_points_after(control, [0.0] * 4, pushed)
    assert control.reference_pos[1] == pytest.approx(pushed[1] + const.SERVO_DEFLECTION_RAD)


@pytest.mark.parametrize("joint", range(4))
@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_reference_stops_at_the_joint_limit_without_a_jolt(control, joint, direction):
    trace = follow(control, direction * np.eye(4)[joint], 4000)[:, joint]
    lower, upper = const.JOINT_RANGE_RAD[joint]
    assert lower <= trace.min() <= trace.max() <= upper
    assert trace[-1] == pytest.approx(upper if direction > 0 else lower, abs=1e-3)
    assert np.abs(np.diff(trace, 2)).max() / DT**2 <= 2.0 * const.JOINT_ACCEL_RAD_S2[joint]


@pytest.mark.parametrize("action", [[0.0] * 3, [[0.0] * 4], 0.0, [0.0, np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0, 0.0]])
def test_action_of_wrong_shape_or_not_finite_is_refused(action):
    with pytest.raises(ConfigurationError, match="action"):
        checked_action(action)
