import inspect
import re

import mujoco
import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import constants as const

LINKS = ("house", "boom", "arm", "bucket")


def test_every_constant_says_where_it_comes_from():
    _, *constants = re.split(r"\n(?=[A-Z_\d]+ = )", inspect.getsource(const))
    silent = [text for text in constants if not re.search(r"\(kind: (datasheet|paper|derived|tuned|guess)\)", text)]
    assert [text.split()[0] for text in silent] == ["JOINT_NAMES"]


@pytest.mark.parametrize(("body", "com"), zip(LINKS, ("COM_S", "COM_M", "COM_M", "COM_T"), strict=True))
def test_compiled_links_have_the_masses_and_inertias_of_the_constants(compiled, body, com):
    link, name = compiled.body(body), body.upper()
    assert link.mass[0] == getattr(const, f"{name}_MASS_KG")
    np.testing.assert_array_equal(link.ipos, getattr(const, f"{name}_{com}"))
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, link.iquat)
    axes = rotation.reshape(3, 3)
    inertia = np.diag(getattr(const, f"{name}_INERTIA_KGM2"))
    np.testing.assert_allclose(axes @ np.diag(link.inertia) @ axes.T, inertia, atol=1e-6)
    assert 7.5e3 < compiled.body_mass.sum() < 8.7e3  # the 8-t class


def test_compiled_joints_have_the_order_ranges_torques_and_gains_of_the_constants(compiled):
    assert (
        [compiled.joint(i).name for i in range(compiled.njnt)]
        == list(const.JOINT_NAMES)
        == [compiled.actuator(i).name for i in range(compiled.nu)]
    )
    torque = np.array(const.JOINT_TORQUE_NM)
    for found, expected in (
        (compiled.jnt_range, const.JOINT_RANGE_RAD),
        (compiled.actuator_forcerange, np.stack([-torque, torque], axis=1)),
        (compiled.jnt_actfrcrange, np.stack([-torque, torque], axis=1)),
        (compiled.actuator_gainprm[:, 0], const.SERVO_STIFFNESS_NM_RAD),
        (-compiled.actuator_biasprm[:, 2], const.SERVO_DAMPING_NMS_RAD),
    ):
        np.testing.assert_array_equal(found, expected)


def test_servo_saturates_at_the_deflection_of_the_relief_valve():
    stiffness, torque = np.array(const.SERVO_STIFFNESS_NM_RAD), np.array(const.JOINT_TORQUE_NM)
    np.testing.assert_allclose(torque / stiffness, const.SERVO_DEFLECTION_RAD)


def test_working_ranges_are_those_of_the_datasheet():
    grids = [np.linspace(*limits, 61) for limits in const.JOINT_RANGE_RAD[1:]]
    angles = np.cumsum(np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, 3), axis=1)
    lengths = np.array([const.BOOM_LENGTH_M, const.ARM_LENGTH_M, const.BUCKET_LENGTH_M])
    radius = const.BOOM_PIN_S[0] + np.cos(angles) @ lengths
    height = const.SWING_HEIGHT_M + const.BOOM_PIN_S[2] + np.sin(angles) @ lengths
    assert radius[np.abs(height) < 0.05].max() == pytest.approx(const.REACH_AT_GROUND_M, abs=0.1)
    assert -height.min() == pytest.approx(const.DIG_DEPTH_M, abs=0.1)
    is_hanging = angles[:, 2] <= -np.pi / 2
    assert height[is_hanging].max() == pytest.approx(const.DUMP_HEIGHT_M, abs=0.1)
