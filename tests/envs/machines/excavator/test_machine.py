import dataclasses

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.appearance import Appearance
from lerobot_excav.envs.machines.excavator.kinematics import forward, inverse
from lerobot_excav.envs.machines.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.soil import Reaction
from lerobot_excav.envs.soil.patches import Patches, PatchKind
from lerobot_excav.errors import ConfigurationError

ZERO = np.zeros(4)
LEFT = np.array([1.0, 0.0, 0.0, 0.0])
SWUNG = np.array([-1.0, 0.7, -1.5, -1.8])
CARRY = np.array([0.4, 0.7, -1.5, -1.8])


def carried(mass_kg=0.0, push_n=0.0):
    """A load, and soil at a fixed place that can push the bucket away from the machine."""
    place_w, away_w = np.eye(3)[[2]], np.eye(3)[[0]]
    soil = Patches.alike(place_w, away_w, np.array([push_n]), 0.4, PatchKind.WEDGE)
    return dataclasses.replace(Reaction.free(mass_kg, np.array([0.6, 0.0, 0.2])), patches=soil)


def run(machine, action, ticks, reaction=None):
    for _ in range(ticks):
        machine.tick(np.asarray(action, float), reaction or carried())
    return machine.joint_pos


def test_tick_is_exactly_20_ms(machine):
    machine.reset(CARRY)
    run(machine, ZERO, 50)
    assert machine.data.time == pytest.approx(1.0, abs=1e-9)
    assert machine.model.opt.timestep == const.SUBSTEP_S


@pytest.mark.parametrize(
    ("pose", "mass_kg", "deflection_rad"),
    [(CARRY, 0.0, 4e-3), (CARRY, 485.0, 4e-3), (np.array([0.0, 0.35, -0.55, -0.1]), 485.0, 6e-3)],
    ids=["empty", "loaded", "loaded at full reach"],
)
def test_zero_command_holds_still_for_ten_seconds(machine, pose, mass_kg, deflection_rad):
    reaction = carried(mass_kg)
    machine.reset(pose)
    settled = run(machine, ZERO, 50, reaction)
    later = run(machine, ZERO, 450, reaction)
    assert np.abs(settled - pose).max() < deflection_rad  # of the servo under load
    assert np.abs(later - settled).max() < 1e-6  # nothing creeps


@pytest.mark.parametrize(("joint", "start"), [(0, -1.0), (1, 0.2), (2, -2.4), (3, -2.0)])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_full_stick_reaches_full_speed(machine, joint, start, direction):
    pose = np.array([0.0, 0.3, -0.6, 0.2] if joint == 1 else [0.0, 0.7, -1.5, -1.0])
    lower, upper = const.JOINT_RANGE_RAD[joint]
    pose[joint] = start if direction > 0 else lower + upper - start
    machine.reset(pose)
    speeds = []
    for _ in range(90):
        run(machine, direction * np.eye(4)[joint], 1)
        speeds.append(abs(machine.joint_vel[joint]))
    assert max(speeds) == pytest.approx(const.JOINT_SPEED_RAD_S[joint], rel=0.05)


@pytest.mark.parametrize("joint", [1, 2, 3])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_joints_stop_at_their_limits(machine, joint, direction):
    machine.reset(np.array([0.0, 1.0, -1.2, -1.0]))
    lower, upper = const.JOINT_RANGE_RAD[joint]
    trace = [run(machine, direction * np.eye(4)[joint], 1)[joint] for _ in range(250)]
    assert lower - 2e-3 <= min(trace) <= max(trace) <= upper + 2e-3


def test_release_brings_the_machine_to_rest(machine):
    machine.reset(SWUNG)
    run(machine, [1.0, 0.3, -0.5, 0.4], 60, carried(485.0))
    assert np.abs(machine.joint_vel).max() > 0.3
    run(machine, ZERO, 150, carried(485.0))
    assert np.abs(machine.joint_vel).max() < 1e-4


def test_load_slows_nothing_but_the_first_moment(machine):
    angles = []
    for mass in (0.0, 485.0):
        machine.reset(SWUNG)
        angles.append(run(machine, LEFT, 100, carried(mass))[0])
    assert angles[1] == pytest.approx(angles[0], abs=0.1)
    assert machine.payload_mass_kg == pytest.approx(485.0)


def test_same_actions_give_bit_equal_motion_also_in_a_new_machine(machine):
    actions = np.random.default_rng(3).uniform(-1, 1, (60, 4))
    traces = []
    for each in (machine, machine, ExcavatorMachine()):
        each.reset(CARRY)
        poses = [run(each, action, 1, carried(485.0, 5e3)).tolist() for action in actions]
        traces.append((poses, each.joint_vel.tolist()))
    assert traces[0] == traces[1] == traces[2]


def test_tool_is_the_bucket_now_and_moves_as_it_says(machine):
    machine.reset(np.array([0.5, 0.7, -1.5, -1.8]))
    run(machine, [1.0, 0.5, -0.5, 0.5], 40)
    before = machine.tool()
    edge_w, _ = forward(machine.joint_pos)
    np.testing.assert_allclose(before.position_w + 1.15 * before.rotation_w[:, 0], edge_w, atol=1e-9)
    np.testing.assert_allclose(machine.cutting_edge_pos_w, edge_w, atol=1e-9)
    run(machine, [1.0, 0.5, -0.5, 0.5], 1)
    after = machine.tool()
    moved = (after.position_w - before.position_w) / const.TICK_S
    np.testing.assert_allclose(moved, 0.5 * (before.linear_velocity_w + after.linear_velocity_w), atol=5e-3)
    turned = (after.rotation_w - before.rotation_w) @ before.rotation_w.T / const.TICK_S
    spin = 0.5 * np.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]])
    np.testing.assert_allclose(spin, before.angular_velocity_w, atol=0.05)


def test_ground_stops_the_bucket_and_is_not_the_box(machine):
    machine.reset(np.array([0.0, 0.5, -1.2, -0.8]))
    run(machine, [0.0, -1.0, 0.0, 0.0], 300)
    assert -0.05 < machine.cutting_edge_pos_w[2] < 0.05
    assert np.abs(machine.joint_vel).max() < 1e-2
    assert machine.data.ncon > 0
    assert machine.box_contact_force_n == 0.0


def test_swinging_into_the_wall_of_the_box_is_a_hard_contact_and_passing_over_it_none(machine):
    machine.reset(inverse(4.9, 0.5, -1.8, 0.6))
    forces = []
    for _ in range(150):
        run(machine, LEFT, 1)
        forces.append(machine.box_contact_force_n)
    assert forces[0] == 0.0
    assert 5e3 <= max(forces) < 1e7
    assert machine.joint_pos[0] < np.arctan2(4.75, 0.85)
    machine.reset(inverse(4.9, 2.2, -1.8, 0.6))  # above the box
    for _ in range(100):
        run(machine, LEFT, 1, carried(485.0))
        assert machine.box_contact_force_n == 0.0


@pytest.mark.parametrize("joint_pos", [np.zeros(3), np.zeros(4), np.array([0.0, 0.5, np.nan, 0.0])])
def test_unusable_joint_position_is_refused(machine, joint_pos):
    with pytest.raises(ConfigurationError, match="joint_pos"):
        machine.reset(joint_pos)


def test_appearance_changes_colours_and_light_but_no_physics():
    machine = ExcavatorMachine()
    before = machine.model.body_mass.copy(), machine.model.geom_size.copy()
    look = {"machine_rgb": (0.1, 0.2, 0.3), "soil_rgb": (0.4, 0.3, 0.2)}
    machine.set_appearance(Appearance(**look, light_dir_w=(0.0, 0.0, -2.0), light_intensity=0.5))
    np.testing.assert_allclose(machine.model.material("machine").rgba[:3], look["machine_rgb"], atol=1e-6)
    of_skins = machine.model.mat_rgba[machine.model.skin_matid, :3]  # they draw the soil
    np.testing.assert_allclose(of_skins, [look["soil_rgb"]] * len(of_skins), atol=1e-6)
    np.testing.assert_allclose(machine.model.light("sun").dir, [0.0, 0.0, -1.0])
    np.testing.assert_allclose(machine.model.light("sun").diffuse, 0.5)
    np.testing.assert_array_equal(machine.model.body_mass, before[0])
    np.testing.assert_array_equal(machine.model.geom_size, before[1])
