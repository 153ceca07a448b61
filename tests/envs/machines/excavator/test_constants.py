from typing import get_args

import mujoco
import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.constants import CATALOGUE, Kind
from lerobot_excav.envs.machines.excavator.kinematics import forward
from lerobot_excav.envs.machines.excavator.layout import MACHINE_POS_W, TARGET_BOX
from lerobot_excav.envs.machines.excavator.mjcf import build_spec


@pytest.fixture(scope="module")
def model():
    return build_spec(TARGET_BOX, (6.0, 6.0)).compile()


def test_every_public_value_is_in_the_catalogue_with_its_origin():
    values = {name for name in vars(const) if name.isupper() and not name.startswith("_")}
    assert values - {"CATALOGUE", "JOINT_NAMES"} == set(CATALOGUE)


@pytest.mark.parametrize("name", CATALOGUE)
def test_catalogue_entry_is_complete_and_is_the_value_in_use(name):
    entry = CATALOGUE[name]
    assert entry.value == getattr(const, name)
    assert entry.unit
    assert entry.kind in get_args(Kind)
    assert len(entry.source) > 10


@pytest.mark.parametrize(
    ("body", "mass", "com", "inertia"),
    [
        ("house", const.HOUSE_MASS_KG, const.HOUSE_COM_S, const.HOUSE_INERTIA_KGM2),
        ("boom", const.BOOM_MASS_KG, const.BOOM_COM_M, const.BOOM_INERTIA_KGM2),
        ("arm", const.ARM_MASS_KG, const.ARM_COM_M, const.ARM_INERTIA_KGM2),
        ("bucket", const.BUCKET_MASS_KG, const.BUCKET_COM_T, const.BUCKET_INERTIA_KGM2),
    ],
)
def test_compiled_links_have_the_masses_and_inertias_of_the_constants(model, body, mass, com, inertia):
    link = model.body(body)
    assert link.mass[0] == mass
    np.testing.assert_array_equal(link.ipos, com)
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, link.iquat)
    axes = rotation.reshape(3, 3)
    np.testing.assert_allclose(axes @ np.diag(link.inertia) @ axes.T, np.diag(inertia), atol=1e-6)


def test_compiled_machine_weighs_as_much_as_its_class(model):
    total = model.body_mass.sum() - model.body("payload").mass[0]
    assert total == const.UNDERCARRIAGE_MASS_KG + 4300 + 520 + 270 + 210
    assert 7.5e3 < total < 8.7e3


def test_compiled_joints_have_the_order_ranges_and_torques_of_the_constants(model):
    names = [model.joint(i).name for i in range(model.njnt)]
    assert names == list(const.JOINT_NAMES) == [model.actuator(i).name for i in range(model.nu)]
    np.testing.assert_array_equal(model.jnt_range, const.JOINT_RANGE_RAD)
    torque = np.array(const.JOINT_TORQUE_NM)
    np.testing.assert_array_equal(model.actuator_forcerange, np.stack([-torque, torque], axis=1))
    np.testing.assert_array_equal(model.jnt_actfrcrange, np.stack([-torque, torque], axis=1))


def test_compiled_servos_have_the_gains_of_the_constants(model):
    np.testing.assert_array_equal(model.actuator_gainprm[:, 0], const.SERVO_STIFFNESS_NM_RAD)
    np.testing.assert_array_equal(-model.actuator_biasprm[:, 2], const.SERVO_DAMPING_NMS_RAD)


def test_servo_saturates_at_the_deflection_of_the_relief_valve():
    stiffness, torque = np.array(const.SERVO_STIFFNESS_NM_RAD), np.array(const.JOINT_TORQUE_NM)
    np.testing.assert_allclose(torque / stiffness, const.SERVO_DEFLECTION_RAD)


def test_compiled_pins_stand_where_the_constants_say(model):
    np.testing.assert_array_equal(MACHINE_POS_W, const.MACHINE_POS_W)
    np.testing.assert_array_equal(model.body("undercarriage").pos, const.MACHINE_POS_W)
    np.testing.assert_array_equal(model.body("house").pos, [0, 0, const.SWING_HEIGHT_M])
    np.testing.assert_array_equal(model.body("boom").pos, const.BOOM_PIN_S)
    np.testing.assert_array_equal(model.body("arm").pos, [const.BOOM_LENGTH_M, 0, 0])
    np.testing.assert_array_equal(model.body("bucket").pos, [const.ARM_LENGTH_M, 0, 0])
    np.testing.assert_array_equal(model.site("cutting_edge").pos, [const.BUCKET_LENGTH_M, 0, 0])


@pytest.fixture(scope="module")
def workspace():
    """Radius from the swing axis, height and pitch of the edge over a raster of boom, arm and bucket angles."""
    grids = [np.linspace(*limits, 61) for limits in const.JOINT_RANGE_RAD[1:]]
    angles = np.cumsum(np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, 3), axis=1)
    lengths = np.array([const.BOOM_LENGTH_M, const.ARM_LENGTH_M, const.BUCKET_LENGTH_M])
    radius = const.BOOM_PIN_S[0] + np.cos(angles) @ lengths
    height = const.SWING_HEIGHT_M + const.BOOM_PIN_S[2] + np.sin(angles) @ lengths
    return radius, height, angles[:, 2]


def test_reach_at_ground_is_that_of_the_datasheet(workspace):
    radius, height, _ = workspace
    assert radius[np.abs(height) < 0.05].max() == pytest.approx(6.94, abs=0.1)
    assert radius[np.abs(height) < 0.05].max() == pytest.approx(const.REACH_AT_GROUND_M, abs=0.1)


def test_dig_depth_is_that_of_the_datasheet(workspace):
    assert -workspace[1].min() == pytest.approx(const.DIG_DEPTH_M, abs=0.1)


def test_dump_height_under_the_hanging_bucket_is_as_published(workspace):
    _, height, pitch = workspace
    assert height[pitch <= -np.pi / 2].max() == pytest.approx(const.DUMP_HEIGHT_M, abs=0.1)


def test_workspace_raster_agrees_with_forward_kinematics():
    edge, pitch = forward([0.0, 1.222, -0.524, 0.576])
    assert pitch == pytest.approx(1.274)
    assert edge[2] > 6.0
