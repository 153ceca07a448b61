import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.kinematics import inverse
from lerobot_excav.envs.machines.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.tasks.scoop.operator.shell import flattest_pitch_rad, hang_m

LEVEL_PLATE_RAD = -3.0 * np.pi / 4.0
"""Pitch at which the plate behind the edge lies level: it leans 45 degrees to the chord."""


def lowest_point_of_the_model_m(machine, *, radius_m, height_m, pitch_rad):
    """Return how high the lowest point of the bucket's collision shapes lies above the floor [m]."""
    machine.reset(inverse(radius_m, height_m, pitch_rad, 0.0))
    model, data, lowest = machine.model, machine.data, np.inf
    for geom in np.flatnonzero((model.geom_bodyid == model.body("bucket").id) & (model.geom_contype > 0)):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
            rotation = data.geom_xmat[geom].reshape(3, 3)
            lowest = min(lowest, data.geom_xpos[geom][2] - np.abs(rotation[2]) @ model.geom_size[geom])
    return lowest


@pytest.mark.parametrize("pitch_rad", [-1.6, -2.0, LEVEL_PLATE_RAD, -2.6, -2.85])
def test_shell_hangs_as_low_as_the_collision_shapes_of_the_machine(pitch_rad):
    lowest = lowest_point_of_the_model_m(ExcavatorMachine(), radius_m=4.2, height_m=0.6, pitch_rad=pitch_rad)
    assert 0.6 - hang_m(pitch_rad) == pytest.approx(lowest, abs=1e-9)


def test_only_the_plate_hangs_below_the_edge_until_it_lies_level_and_the_belly_beyond():
    steep = np.arange(-1.2, LEVEL_PLATE_RAD, -0.05)
    assert hang_m(steep).max() <= 0.02 + 1e-9
    assert hang_m(LEVEL_PLATE_RAD - 0.25) > 0.1


@pytest.mark.parametrize("height_m", [0.02, 0.05, 0.15, 0.3])
def test_flattest_pitch_brings_the_belly_down_to_the_floor_and_no_further(height_m):
    pitch = float(flattest_pitch_rad(height_m))
    assert 0.0 <= height_m - hang_m(pitch) <= 0.006
    assert pitch <= LEVEL_PLATE_RAD + 0.006


def test_edge_too_near_to_the_floor_for_any_pitch_gets_the_one_at_which_the_shell_hangs_least():
    pitch = flattest_pitch_rad(np.array([0.0, -0.1]))
    assert hang_m(pitch) == pytest.approx(hang_m(np.arange(-1.0, -3.1, -0.005)).min(), abs=1e-9)


def test_profile_that_the_pitches_here_are_made_for():
    along = np.subtract(const.BUCKET_PROFILE_T[1], const.BUCKET_PROFILE_T[0])
    assert np.arctan2(along[1], -along[0]) == pytest.approx(np.pi / 4.0)
