import mujoco
import numpy as np
import pytest

from lerobot_excav.envs.excavator import constants as const
from lerobot_excav.envs.excavator.layout import TARGET_BOX
from lerobot_excav.envs.excavator.mjcf import build_spec
from lerobot_excav.envs.excavator.payload import Payload

COM_T = np.array([0.65, 0.1, 0.15])


@pytest.fixture
def model():
    return build_spec(TARGET_BOX, (6.0, 6.0)).compile()


@pytest.fixture
def payload(model):
    return Payload(model)


def fill(payload, mass_kg, com_t=COM_T, ticks=10):
    for _ in range(ticks):
        for remaining in range(10, 0, -1):
            payload.approach(mass_kg, com_t, remaining)


def test_new_bucket_is_empty(model, payload):
    assert payload.mass_kg == 0.0
    assert model.body("payload").mass[0] == 0.0
    assert not model.body("payload").inertia.any()


def test_payload_arrives_within_the_tick_when_the_change_is_small(model, payload):
    fill(payload, 100.0, ticks=1)
    assert model.body("payload").mass[0] == pytest.approx(100.0)
    np.testing.assert_allclose(model.body("payload").ipos, COM_T)


def test_mass_never_changes_faster_than_its_rate(model, payload):
    limit = const.PAYLOAD_RATE_KG_S * const.SUBSTEP_S
    masses = [0.0]
    for target in (485.0, 0.0):
        for _ in range(3):
            for remaining in range(10, 0, -1):
                payload.approach(target, COM_T, remaining)
                masses.append(payload.mass_kg)
    assert np.abs(np.diff(masses)).max() <= limit + 1e-9
    assert max(masses) == pytest.approx(485.0)
    assert masses[-1] == pytest.approx(0.0, abs=1e-9)


def test_load_adds_its_weight_about_every_pin(model, payload):
    data = mujoco.MjData(model)
    data.qpos[:] = [0.3, 0.5, -1.6, -0.4]

    def bias():
        mujoco.mj_forward(model, data)
        return data.qfrc_bias.copy()

    empty = bias()
    fill(payload, 485.0)
    loaded = bias()
    com_w = data.body("payload").xipos
    jacobian = np.zeros((3, 4))
    mujoco.mj_jac(model, data, jacobian, None, com_w, model.body("payload").id)
    np.testing.assert_allclose(
        loaded - empty, -jacobian.T @ [0, 0, -485.0 * const.GRAVITY_M_S2], rtol=1e-9, atol=1e-6
    )


def test_load_adds_to_the_inertia_of_the_swing(model, payload):
    data = mujoco.MjData(model)
    data.qpos[:] = [0.0, 0.3, -0.8, -0.3]
    inertia = []
    for mass in (0.0, 485.0):
        fill(payload, mass)
        mujoco.mj_forward(model, data)
        column = np.zeros(4)
        mujoco.mj_mulM(model, data, column, np.array([1.0, 0.0, 0.0, 0.0]))
        inertia.append(column[0])
    radius = np.hypot(*(data.body("payload").xipos - const.MACHINE_POS_W)[:2])
    assert inertia[1] - inertia[0] == pytest.approx(485.0 * radius**2, rel=0.01)


def test_reset_empties_the_bucket_at_once(model, payload):
    fill(payload, 300.0)
    payload.reset()
    assert model.body("payload").mass[0] == 0.0
