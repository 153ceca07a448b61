import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.constants import JOINT_ACCEL_RAD_S2, JOINT_SPEED_RAD_S
from lerobot_excav.envs.tasks.scoop.operator.motion import CarefulMotion, JointMotion

BENT = np.array([[0.0, 0.1, -1.0, 0.0], [0.9, 0.5, -1.4, -0.8], [1.4, 0.2, -1.8, -1.0]])
MOTIONS = pytest.mark.parametrize("motion_type", [JointMotion, CarefulMotion])


def arc(samples):
    """Return a smooth path on which boom and arm turn round."""
    s = np.linspace(0.0, 1.0, samples)
    return np.stack([0.5 * s, 0.3 * np.sin(3.0 * s), -1.5 - 0.4 * np.cos(4.0 * s), -0.5 * s], axis=-1)


@MOTIONS
def test_motion_keeps_to_speeds_and_begins_and_ends_where_the_path_does(motion_type):
    motion = motion_type(BENT, speed=0.9)
    velocity = np.array([motion.at(t)[1] for t in np.arange(0.0, motion.duration_s, 0.01)])
    assert np.all(np.abs(velocity) <= 0.9 * np.array(JOINT_SPEED_RAD_S) + 1e-6)
    assert np.allclose(motion.at(motion.duration_s)[0], BENT[-1], atol=1e-9)
    assert np.allclose(motion.at(0.0)[0], BENT[0], atol=1e-9)


@MOTIONS
@pytest.mark.parametrize("distance_rad", [0.02, 0.5, 3.0])
def test_motion_starts_within_the_machines_acceleration(motion_type, distance_rad):
    motion = motion_type([np.zeros(4), np.array([distance_rad, 0.0, 0.0, 0.0])], speed=1.0)
    velocity = np.array([motion.at(t)[1] for t in np.arange(0.0, motion.duration_s, 0.02)])[:, 0]
    assert np.abs(np.diff(velocity)).max() / 0.02 <= JOINT_ACCEL_RAD_S2[0]


def test_careful_motion_bends_within_the_machines_acceleration_and_the_brisk_one_does_not():
    def hardest(motion):
        velocity = np.array([motion.at(t)[1] for t in np.arange(0.0, motion.duration_s, 0.02)])
        return (np.abs(np.diff(velocity, axis=0)).max(axis=0) / 0.02 / JOINT_ACCEL_RAD_S2).max()

    assert hardest(CarefulMotion(arc(60), speed=1.0)) <= 1.0
    assert hardest(JointMotion(arc(60), speed=1.0)) > 1.0


def test_velocities_of_the_careful_motion_are_the_derivatives_of_its_positions():
    motion = CarefulMotion(arc(40), speed=0.9)
    for t in np.linspace(0.1, motion.duration_s - 0.1, 17):
        slope = (motion.at(t + 1e-5)[0] - motion.at(t - 1e-5)[0]) / 2e-5
        assert np.allclose(slope, motion.at(t)[1], atol=0.03)


def test_careful_motion_stays_on_its_path():
    path = arc(80)
    motion = CarefulMotion(path, speed=1.0)
    dense = arc(4000)
    for t in np.linspace(0.0, motion.duration_s, 50):
        assert np.linalg.norm(dense - motion.at(t)[0], axis=1).min() < 2e-3
