"""Soil that falls into the bucket, through the whole chain to the joints."""

import math

import mujoco
import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.appearance import Appearance
from lerobot_excav.envs.machines.excavator.worksite import Worksite, WorksiteStart

POSE = np.array([0.0, 0.9, -1.5, -2.4])
"""The bucket is raised and looks up."""

FALL_M = 2.0


@pytest.fixture
def worksite():
    site = Worksite(fidelity="fast")
    site.reset(WorksiteStart(joint_pos=POSE, heights_m=np.zeros_like(site.soil.heights_m), appearance=Appearance()))
    for _ in range(25):
        site.tick(np.zeros(4))
    return site


def drop(site):
    """Let three by five parcels fall into the bucket; return their mass [kg] and the middle of the bucket [m]."""
    tool = site.machine.tool()
    middle = tool.position_w + tool.rotation_w @ [0.6, 0.0, 0.2]
    layer = 0.125 * np.array([(x, y, 0.0) for x in range(-1, 2) for y in range(-2, 3)])
    site.soil.add_parcels(middle + layer + [0.0, 0.0, FALL_M], np.zeros((15, 3)))
    return 15 * site.soil.parcel_mass_kg, middle


def kinetic_energy_j(machine):
    inertia, row = np.zeros((4, 4)), np.zeros(4)
    for k in range(4):
        mujoco.mj_mulM(machine.model, machine.data, row, np.eye(4)[k])
        inertia[k] = row
    return 0.5 * machine.data.qvel @ inertia @ machine.data.qvel


def test_the_boom_feels_m_sqrt_2gh_at_its_lever_and_the_servos_stop_it(worksite, monkeypatch):
    """From rest to rest, the impulse of the motors beyond the weights is that of the fallen soil."""
    mass, middle = drop(worksite)
    motors = np.zeros(4)
    step = mujoco.mj_step2

    def watched(model, data):
        step(model, data)
        motors[:] += const.SUBSTEP_S * (data.qfrc_actuator + data.qfrc_passive - data.qfrc_bias)

    monkeypatch.setattr("lerobot_excav.envs.machines.excavator.machine.mujoco.mj_step2", watched)
    energies = []
    for _ in range(150):
        worksite.tick(np.zeros(4))
        energies.append(kinetic_energy_j(worksite.machine))
    assert worksite.soil.payload_mass_kg == pytest.approx(mass)
    assert np.abs(worksite.machine.joint_vel).max() < 1e-6
    lever = middle[0] - const.MACHINE_POS_W[0] - const.BOOM_PIN_S[0]
    blow = mass * math.sqrt(2.0 * const.GRAVITY_M_S2 * FALL_M)
    assert motors[1] == pytest.approx(lever * blow, rel=0.08)
    assert motors[0] == pytest.approx(0.0, abs=0.02 * lever * blow)
    assert max(energies) < 0.5 * mass * const.GRAVITY_M_S2 * FALL_M


def test_a_machine_without_motors_gains_no_more_energy_than_the_soil_loses(worksite):
    """An inelastic blow on a mechanism that moves freely; gravity pulls at the soil alone."""
    machine = worksite.machine
    machine.model.actuator_gainprm[:] = 0.0
    machine.model.actuator_biasprm[:] = 0.0
    machine.model.opt.gravity[:] = 0.0
    mass, _ = drop(worksite)
    energies = []
    for _ in range(45):  # the soil has just arrived
        worksite.tick(np.zeros(4))
        energies.append(kinetic_energy_j(machine))
    fall = mass * const.GRAVITY_M_S2 * (FALL_M + 0.6)
    assert 0.001 * fall < max(energies) < fall
