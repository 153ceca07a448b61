import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.envs.excavator import constants as const
from lerobot_excav.envs.excavator.digging import DiggingResistance, resisted_speed
from lerobot_excav.envs.excavator.layout import TARGET_BOX
from lerobot_excav.envs.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.soil import Reaction

REACHED_OUT = np.array([0.0, 0.6, -1.2, -0.8])
ARM_IN = np.array([0.0, 0.0, -1.0, 0.0])


@pytest.fixture(scope="module")
def machine():
    return ExcavatorMachine(container=TARGET_BOX)


def edge_reaction(machine, force_w_n):
    """A reaction whose force acts at the cutting edge."""
    arm = machine.cutting_edge_pos_w - machine.tool().position_w
    return Reaction(
        force_w_n=np.asarray(force_w_n, float),
        torque_w_nm=np.cross(arm, force_w_n),
        payload_mass_kg=0.0,
        payload_com_t=np.array([0.6, 0.0, 0.2]),
    )


def pull_in(machine, force_n, ticks=100):
    """Pull the arm in against a horizontal force; return the speeds of the edge along x per tick."""
    machine.reset(REACHED_OUT)
    speeds = []
    for _ in range(ticks):
        before = machine.cutting_edge_pos_w[0]
        machine.tick(ARM_IN, edge_reaction(machine, [force_n, 0.0, 0.0]))
        speeds.append((machine.cutting_edge_pos_w[0] - before) / const.TICK_S)
    return np.array(speeds)


@given(st.floats(1e-6, 10.0), st.floats(0.0, 1e6), st.floats(1e-3, 1.0))
def test_resisted_speed_solves_its_equation(free, decel, scale):
    speed = resisted_speed(free, decel, scale)
    assert 0.0 <= speed <= free
    assert speed + decel * np.tanh(speed / scale) == pytest.approx(free, rel=1e-6)


@given(st.floats(-10.0, 0.0), st.floats(0.0, 1e6))
def test_motion_along_the_force_is_left_alone(free, decel):
    assert resisted_speed(free, decel, 0.08) == free


def test_without_force_the_speed_is_free():
    assert resisted_speed(0.7, 0.0, 0.08) == pytest.approx(0.7)


def test_small_resistance_is_overcome_and_large_resistance_stalls(machine):
    free, hindered, stalled = (pull_in(machine, force)[50] for force in (0.0, 2e4, 1e6))
    assert free < -1.0
    assert hindered < -1.0
    assert -0.01 < stalled < 0.0


@pytest.mark.parametrize("force_n", [1e4, 5e4, 1e5, 1e6, 1e8])
def test_resistance_of_any_size_never_reverses_the_edge(machine, force_n):
    assert pull_in(machine, force_n).max() <= 1e-6


@pytest.mark.parametrize("force_n", [5e4, 1e6, 1e8])
def test_stall_does_not_chatter(machine, force_n):
    speeds = pull_in(machine, force_n)[40:]
    assert np.abs(np.diff(speeds)).max() <= 0.01


def test_resistance_takes_energy_in_every_substep(machine):
    machine.reset(REACHED_OUT)
    model, data = machine.model, machine.data
    resistance = DiggingResistance(model)
    resistance.set_reaction(edge_reaction(machine, [4e4, 5e3, 2e4]))
    work, jacobian = [], np.zeros((6, 4))
    for i in range(500):
        data.ctrl[:] = REACHED_OUT + 0.3 * np.sin(i / 30.0) * np.array([1.0, 0.5, -1.0, 1.0])
        mujoco.mj_step1(model, data)
        resistance.apply(data)
        mujoco.mj_jacBodyCom(model, data, jacobian[:3], jacobian[3:], model.body("bucket").id)
        generalized = jacobian.T @ data.xfrc_applied[model.body("bucket").id]
        mujoco.mj_step2(model, data)
        work.append(
            float(generalized @ data.qvel) * const.SUBSTEP_S
        )  # qvel is what moves the joints in this step
    assert max(work) <= 1e-6
    assert sum(work) < -100.0


def test_wrench_is_that_of_the_reaction_about_the_tool_origin(machine):
    machine.reset(REACHED_OUT)
    for _ in range(25):
        machine.tick(ARM_IN, edge_reaction(machine, [0.0, 0.0, 0.0]))
    resistance = DiggingResistance(machine.model)
    reaction = edge_reaction(machine, [1e3, 0.0, 0.0])
    for _ in range(60):  # until the blend has settled
        resistance.set_reaction(reaction)
    resistance.apply(machine.data)
    bucket = machine.model.body("bucket").id
    wrench = machine.data.xfrc_applied[bucket]
    assert resistance.scale == pytest.approx(1.0, abs=1e-3)
    np.testing.assert_allclose(wrench[:3], resistance.scale * reaction.force_w_n)
    origin_to_com = machine.data.xipos[bucket] - machine.data.xpos[bucket]
    about_origin = wrench[3:] + np.cross(origin_to_com, wrench[:3])
    np.testing.assert_allclose(about_origin, resistance.scale * reaction.torque_w_nm, atol=1e-6)


def test_reactions_are_blended_over_two_ticks_and_end_at_once(machine):
    machine.reset(REACHED_OUT)
    resistance = DiggingResistance(machine.model)
    acting = []
    for force in (1e3, 1e3, 3e3, 0.0):
        resistance.set_reaction(edge_reaction(machine, [force, 0.0, 0.0]))
        acting.append(resistance._force[0])
    assert acting == pytest.approx([500.0, 750.0, 1875.0, 0.0])
    resistance.set_reaction(edge_reaction(machine, [1e3, 0.0, 0.0]))
    resistance.reset()
    assert not resistance._force.any()


def test_blend_calms_a_bucket_whose_resistance_flips_every_tick(machine, monkeypatch):
    def shaking(blend):
        monkeypatch.setattr(const, "RESISTANCE_BLEND", blend)
        machine.reset(REACHED_OUT)
        speeds = []
        for i in range(120):
            machine.tick(ARM_IN, edge_reaction(machine, [6e4 if i % 2 else 1.5e4, 0.0, 0.0]))
            speeds.append(machine.joint_vel[2])
        return np.abs(np.diff(speeds[60:])).max()

    assert shaking(0.5) < 0.7 * shaking(1.0)


def test_wrench_is_gone_in_the_tick_after_the_reaction(machine):
    pull_in(machine, 1e4, ticks=20)
    assert machine.data.xfrc_applied.any()
    machine.tick(ARM_IN, edge_reaction(machine, [0.0, 0.0, 0.0]))
    assert not machine.data.xfrc_applied.any()


def test_pure_torque_resists_too(machine):
    def curl(torque_nm):
        machine.reset(REACHED_OUT)
        reaction = Reaction(
            force_w_n=np.zeros(3),
            torque_w_nm=np.array([0.0, -torque_nm, 0.0]),
            payload_mass_kg=0.0,
            payload_com_t=np.array([0.6, 0.0, 0.2]),
        )
        for _ in range(30):
            machine.tick(np.array([0.0, 0.0, 0.0, -1.0]), reaction)
        return machine.joint_vel[3]

    assert curl(0.0) < -1.0
    assert -0.2 < curl(1e5) <= 0.0
