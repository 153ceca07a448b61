import copy

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.payload import Payload

COM_T = np.array([0.65, 0.1, 0.15])


@pytest.fixture
def payload(model):
    return Payload(model)


def fill(payload, mass_kg, com_t=COM_T, ticks=10):
    for _ in range(ticks):
        for remaining in range(10, 0, -1):
            payload.approach(mass_kg, com_t, remaining)


def test_a_small_change_arrives_within_the_tick_and_a_reset_empties_the_bucket_at_once(model, payload):
    body = model.body("payload")
    for _ in range(2):
        assert payload.mass_kg == body.mass[0] == 0.0
        assert not body.inertia.any()
        fill(payload, 100.0, ticks=1)
        assert body.mass[0] == pytest.approx(100.0)
        np.testing.assert_allclose(body.ipos, COM_T)
        payload.reset()


def test_mass_never_changes_faster_than_its_rate(payload):
    masses = [0.0]
    for target in (485.0, 0.0):
        for _ in range(3):
            for remaining in range(10, 0, -1):
                payload.approach(target, COM_T, remaining)
                masses.append(payload.mass_kg)
    assert np.abs(np.diff(masses)).max() <= const.PAYLOAD_RATE_KG_S * const.SUBSTEP_S + 1e-9
    assert max(masses) == pytest.approx(485.0)
    assert masses[-1] == pytest.approx(0.0, abs=1e-9)


def test_load_adds_its_weight_about_every_pin_and_its_inertia_to_the_swing(model, payload):
    data, bias, inertia = mujoco.MjData(model), [], []
    data.qpos[:] = [0.3, 0.5, -1.6, -0.4]
    for mass_kg in (0.0, 485.0):
        fill(payload, mass_kg)
        mujoco.mj_forward(model, data)
        bias.append(data.qfrc_bias.copy())
        column = np.zeros(4)
        mujoco.mj_mulM(model, data, column, np.array([1.0, 0.0, 0.0, 0.0]))
        inertia.append(column[0])
    com_w = data.body("payload").xipos
    jacobian = np.zeros((3, 4))
    mujoco.mj_jac(model, data, jacobian, None, com_w, model.body("payload").id)
    weight_n = np.array([0, 0, -485.0 * const.GRAVITY_M_S2])
    np.testing.assert_allclose(bias[1] - bias[0], -jacobian.T @ weight_n, rtol=1e-9, atol=1e-6)
    radius = np.hypot(*(com_w - const.MACHINE_POS_W)[:2])
    assert inertia[1] - inertia[0] == pytest.approx(485.0 * radius**2, rel=0.02)


def coast(model, data, payload, mass_kg, com_t, ticks):
    """Coast while the payload changes; return energies [J] and momenta of the swing [N m s] after each substep."""
    energies, momenta, mass = [], [], np.zeros((4, 4))
    for _ in range(ticks):
        for remaining in range(10, 0, -1):
            payload.approach(mass_kg, com_t, remaining)
            mujoco.mj_step1(model, data)
            data.qfrc_applied[:] = 0.0
            payload.apply_momentum(data)
            mujoco.mj_step2(model, data)
            mujoco.mj_forward(model, data)
            for row, unit in zip(mass, np.eye(4), strict=True):
                mujoco.mj_mulM(model, data, row, unit)
            energies.append(0.5 * data.qvel @ mass @ data.qvel)
            momenta.append((mass @ data.qvel)[0])
    return np.array(energies), np.array(momenta)


def swinging(model, joint_vel=(0.8, 0.0, 0.0, 0.0)):
    """Take motors, gravity and joint limits away: what is left is a moving mechanism that keeps its momentum."""
    model.actuator_gainprm[:] = 0.0
    model.actuator_biasprm[:] = 0.0
    model.opt.gravity[:] = 0.0
    model.jnt_limited[:] = 0
    data = mujoco.MjData(model)
    data.qpos[:] = [0.0, 0.3, -0.8, -0.3]
    data.qvel[:] = joint_vel
    mujoco.mj_forward(model, data)
    return data


def test_soil_that_joins_at_rest_shares_the_momentum_and_costs_energy(model, payload):
    """An inelastic impact: momentum stays, energy falls as the inertia grows."""
    data = swinging(model)
    start, momentum = coast(model, data, payload, 0.0, COM_T, 1)
    energies, momenta = coast(model, data, payload, 485.0, COM_T, 10)
    assert payload.mass_kg == pytest.approx(485.0)
    np.testing.assert_allclose(momenta, momentum[-1], rtol=2e-3)
    assert (np.diff(energies) <= 1e-3 * energies[0]).all()
    assert energies[-1] < 0.85 * start[-1]


def test_soil_that_leaves_takes_its_momentum_along(model, payload):
    fill(payload, 485.0)
    data = swinging(model)
    coast(model, data, payload, 485.0, COM_T, 1)
    before = data.qvel[0]
    energies, _ = coast(model, data, payload, 0.0, COM_T, 3)
    assert payload.mass_kg == pytest.approx(0.0, abs=1e-9)
    assert data.qvel[0] == pytest.approx(before, rel=0.02)
    assert (np.diff(energies) <= 1e-3 * energies[0]).all()


LOADS = st.tuples(st.floats(0.0, 500.0), st.floats(0.2, 1.0), st.floats(-0.3, 0.3), st.floats(0.0, 0.5))


@given(st.lists(LOADS, min_size=1, max_size=5), st.tuples(*[st.floats(-0.8, 0.8)] * 4))
@settings(max_examples=25)
def test_no_load_that_comes_goes_or_shifts_gives_energy_to_the_machine(compiled, loads, joint_vel):
    model = copy.copy(compiled)
    payload, data = Payload(model), swinging(model, joint_vel)
    start, _ = coast(model, data, payload, 0.0, COM_T, 1)
    for mass_kg, *com_t in loads:
        energies, _ = coast(model, data, payload, mass_kg, np.array(com_t), 2)
        assert energies.max() <= start.max() * 1.01 + 1e-9


def test_the_momentum_is_that_of_the_joined_part(model, payload):
    """Against the sum over the joined mass as a rigid body, through MuJoCo's own Jacobian; then nothing joins."""
    data = swinging(model, (0.4, -0.3, 0.5, 0.7))
    taken = []
    for _ in range(2):
        payload.approach(20.0, COM_T, 1)
        mujoco.mj_forward(model, data)
        data.qfrc_applied[:] = 0.0
        payload.apply_momentum(data)
        taken.append(-data.qfrc_applied * const.SUBSTEP_S)
    body, linear, angular = model.body("payload"), np.zeros((3, 4)), np.zeros((3, 4))
    mujoco.mj_jacBodyCom(model, data, linear, angular, body.id)
    rotation = data.body("payload").xmat.reshape(3, 3)
    inertia = rotation @ np.diag(body.inertia) @ rotation.T
    momentum = body.mass[0] * linear.T @ linear @ data.qvel + angular.T @ inertia @ angular @ data.qvel
    np.testing.assert_allclose(taken[0], momentum, rtol=1e-9, atol=1e-12)
    assert not taken[1].any()
