import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.soil import BUCKET, tool_at
from lerobot_excav.envs.constants import GRAVITY_M_S2, TICK_S
from lerobot_excav.envs.soil.earthmoving import earthmoving_factors, failure_angle
from lerobot_excav.envs.soil.forces import SoilResistance, bearing_factors, blade_force_n
from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.parameters import PRESETS
from lerobot_excav.envs.soil.patches import PatchKind
from lerobot_excav.envs.soil.wedge import PENETRATION_CAP_N

SAND = PRESETS["sand"]
FULL_SPEED = np.array([-1.0, 0.0, 0.0])
PLATE_RAD = math.atan2(0.39, -0.39)
"""Direction of the bottom plate in the tool frame: 135 degrees."""

EMPTY_COM_T = np.array([0.5, 0.0, 0.3])


def flat(height=1.0):
    field = HeightField((120, 120), (0.05, 0.05), 0.0)
    field.reset(np.full((120, 120), height))
    return field


def answer(resistance, field, tool, floor_depth_m=0.0, payload=(0.0, EMPTY_COM_T)):
    return resistance.react(field.heights, field.heights, field.grid, tool, floor_depth_m, TICK_S, *payload)


def react(parameters, field, tool, floor_depth_m=0.0):
    resistance = SoilResistance(parameters, 8)
    return answer(resistance, field, tool, floor_depth_m)


def force(parameters, field, tool, *kinds):
    """Force on the unhindered tool by some kinds of patches."""
    patches = react(parameters, field, tool).patches
    motion = (tool.position_w, tool.linear_velocity_w, tool.angular_velocity_w)
    return np.sum([patches.of_kind(kind).wrench(*motion)[0] for kind in kinds], axis=0)


def dragged(rake_deg, depth, velocity=FULL_SPEED):
    """The bucket dragged to -x with the bottom plate at a rake from the horizontal."""
    pitch = math.radians(rake_deg) - PLATE_RAD
    return tool_at(np.array([0.0, 0.0, 1.0 - depth]), pitch, velocity, 0.0)


@pytest.mark.parametrize("rake", [25.0, 35.0, 45.0])
@pytest.mark.parametrize("depth", [0.1, 0.2, 0.4])
def test_flat_ground_gives_the_fundamental_equation_of_earthmoving(rake, depth):
    friction, steel = SAND.friction_angle_rad, SAND.steel_friction_angle_rad
    failure = failure_angle(math.radians(rake), friction, steel)
    factor = earthmoving_factors(math.radians(rake), failure, friction, steel).weight
    expected = SAND.density_kg_m3 * GRAVITY_M_S2 * depth**2 * factor * BUCKET.inner_width_m
    found = force(SAND, flat(), dragged(rake, depth), PatchKind.WEDGE)
    assert np.linalg.norm(found) == pytest.approx(expected, rel=0.01)
    assert found[0] == pytest.approx(expected * math.sin(math.radians(rake) + steel), rel=0.01)
    assert found[2] == pytest.approx(-expected * math.cos(math.radians(rake) + steel), rel=0.01)


@given(rake=st.floats(0.3, 1.4), depth=st.floats(0.02, 0.3), by=st.floats(0.2, 3.0))
@settings(max_examples=30)
def test_the_force_scales_with_density_width_and_square_of_depth(rake, depth, by):
    once = blade_force_n(SAND, depth, rake, 0.7)
    heavier = dataclasses.replace(SAND, density_kg_m3=SAND.density_kg_m3 * by)
    np.testing.assert_allclose(blade_force_n(heavier, depth, rake, 0.7), by * once, rtol=1e-9)
    np.testing.assert_allclose(blade_force_n(SAND, depth, rake, 0.7 * by), by * once, rtol=1e-9)
    np.testing.assert_allclose(blade_force_n(SAND, depth * by, rake, 0.7), by**2 * once, rtol=1e-9)


def test_cohesion_adds_its_term():
    sticky = dataclasses.replace(SAND, cohesion_pa=2000.0)
    rake, depth = math.radians(40.0), 0.3
    failure = failure_angle(rake, SAND.friction_angle_rad, SAND.steel_friction_angle_rad)
    factor = earthmoving_factors(rake, failure, SAND.friction_angle_rad, SAND.steel_friction_angle_rad).cohesion
    more = force(sticky, flat(), dragged(40, depth), PatchKind.WEDGE)
    more -= force(SAND, flat(), dragged(40, depth), PatchKind.WEDGE)
    assert np.linalg.norm(more) == pytest.approx(2000.0 * depth * BUCKET.inner_width_m * factor, rel=0.01)


def test_the_weight_of_a_heap_ahead_counts():
    heaped = flat()
    heaped.heights[:50] += 0.3
    assert np.linalg.norm(force(SAND, heaped, dragged(40, 0.3), PatchKind.WEDGE)) > 1.5 * np.linalg.norm(
        force(SAND, flat(), dragged(40, 0.3), PatchKind.WEDGE)
    )


def test_the_edge_bears_more_as_it_goes_deeper_over_the_ramp():
    """Straight in, against bearing theory times a ramp from 10 to 100 percent over 0.2 m."""
    into = np.array([-1.0, 0.0, -1.0]) / math.sqrt(2)
    _, depth_factor, width_factor = bearing_factors(SAND.friction_angle_rad)
    assert depth_factor == pytest.approx(56.0, rel=0.01)
    assert width_factor == pytest.approx(92.2, rel=0.01)
    area = (0.02 + 5 * 0.06 * 0.015 / 0.7) * BUCKET.inner_width_m
    for depth, ramp in ((0.1, 0.55), (0.2, 1.0), (0.3, 1.0)):
        stress = SAND.density_kg_m3 * GRAVITY_M_S2 * (depth * depth_factor + 0.5 * 0.02 * width_factor)
        found = force(SAND, flat(), dragged(45, depth, into), PatchKind.PENETRATION)
        assert -(found @ into) == pytest.approx(ramp * stress * area, rel=0.01)


def test_the_penetration_scale_scales_and_the_cap_limits():
    def bearing(scale, depth):
        soil = dataclasses.replace(SAND, penetration_scale=scale)
        into = np.array([-1.0, 0.0, -1.0]) / math.sqrt(2)
        return float(np.linalg.norm(force(soil, flat(), dragged(45, depth, into), PatchKind.PENETRATION)))

    assert bearing(2.0, 0.2) == pytest.approx(2 * bearing(1.0, 0.2))
    assert bearing(99.0, 0.4) == pytest.approx(PENETRATION_CAP_N, rel=1e-3)


@given(
    pitch=st.floats(-3.5, 0.5),
    depth=st.floats(-0.1, 0.6),
    velocity=st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2)),
    turning=st.floats(-2, 2),
)
@settings(max_examples=100)
def test_the_soil_never_drives_the_bucket(pitch, depth, velocity, turning):
    edge = np.array([0.0, 0.0, 1.0 - depth])
    tool = tool_at(edge, pitch, np.array(velocity), turning)
    reaction = react(SAND, flat(), tool)
    assert np.isfinite([*reaction.force_w_n, *reaction.torque_w_nm]).all()
    power = reaction.force_w_n @ tool.linear_velocity_w + reaction.torque_w_nm @ tool.angular_velocity_w
    assert power <= 1e-9


@given(pitch=st.floats(-3.0, -1.4), depth=st.floats(0.05, 0.5), angle=st.floats(0.0, 2 * math.pi))
@settings(max_examples=50)
def test_what_the_soil_can_hold_depends_on_the_pose_and_not_on_the_motion(pitch, depth, angle):
    """Nothing can jump with the direction of motion: for the first step, before any sinkage."""
    edge = np.array([0.0, 0.0, 1.0 - depth])
    still = react(SAND, flat(), tool_at(edge, pitch, np.zeros(3), 0.0)).patches
    motion = np.array([math.cos(angle), 0.0, math.sin(angle)])
    moving = react(SAND, flat(), tool_at(edge, pitch, motion, 0.0)).patches
    for kind in (PatchKind.WEDGE, PatchKind.PENETRATION):
        np.testing.assert_array_equal(moving.of_kind(kind).full_forces_w_n, still.of_kind(kind).full_forces_w_n)


def test_the_force_is_continuous_in_the_direction_of_a_deep_scrape():
    angles = np.radians(np.arange(90.0, 271.0, 0.25))
    deep = [
        force(SAND, flat(), dragged(20, 0.8, np.array([math.cos(a), 0.0, math.sin(a)])), *PatchKind) for a in angles
    ]
    jumps = np.linalg.norm(np.diff(deep, axis=0), axis=1)
    assert jumps.max() < 0.05 * np.linalg.norm(deep, axis=1).max()


def test_a_bucket_at_rest_feels_nothing_and_its_edge_leaves_freely():
    assert not react(SAND, flat(), dragged(40, 0.3, np.zeros(3))).force_w_n.any()
    out = dragged(40, 0.3, np.array([math.cos(math.radians(40)), 0.0, math.sin(math.radians(40))]))
    edge = (PatchKind.WEDGE, PatchKind.PENETRATION)
    assert np.linalg.norm(force(SAND, flat(), out, *edge)) < 1e-9


def test_the_torque_is_that_of_the_force_at_the_edge():
    tool = dragged(40, 0.3)
    wedge = react(SAND, flat(), tool).patches.of_kind(PatchKind.WEDGE)
    found, torque = wedge.wrench(tool.position_w, tool.linear_velocity_w, tool.angular_velocity_w)
    arm = tool.rotation_w @ np.array([1.15, 0.0, 0.0])
    np.testing.assert_allclose(torque, np.cross(arm, found), atol=1e-6)


def test_a_one_sided_heap_turns_the_bucket():
    tool, field = dragged(40, 0.3), flat()
    field.heights[:, 60:] += 0.3
    assert abs(react(SAND, field, tool).torque_w_nm[2]) > 100.0


def test_the_wrench_is_the_sum_of_its_patches_at_the_present_velocity():
    tool = dragged(40, 0.3, np.array([-0.7, 0.2, -0.4]))
    reaction = react(SAND, flat(), tool)
    assert len(reaction.patches.of_kind(PatchKind.PRESSURE)) > 0
    np.testing.assert_allclose(reaction.force_w_n, force(SAND, flat(), tool, *PatchKind), rtol=1e-9)


def test_the_world_floor_depth_shifts_the_force_only():
    deep = 0.7
    tool = dragged(40, 0.3)
    lower = tool_at(np.array([0.0, 0.0, 0.7 - deep]), tool.pitch_rad, FULL_SPEED, 0.0)
    same = react(SAND, flat(), lower, deep)
    np.testing.assert_allclose(same.force_w_n, react(SAND, flat(), tool).force_w_n, rtol=1e-9)
    np.testing.assert_allclose(same.torque_w_nm, react(SAND, flat(), tool).torque_w_nm, rtol=1e-9)


def test_the_reaction_says_what_the_bucket_holds():
    com = np.array([0.6, 0.1, 0.2])
    found = answer(SoilResistance(SAND, 8), flat(), dragged(40, 0.3), payload=(321.0, com))
    assert found.payload_mass_kg == 321.0
    np.testing.assert_array_equal(found.payload_com_t, com)


def test_a_bucket_that_was_away_has_not_sunk_in():
    field, resistance = flat(), SoilResistance(SAND, 8)
    tool = tool_at(np.array([0.0, 0.0, 1.0]), -math.pi, np.array([0.0, 0.0, -1.0]), 0.0)

    def held():
        return float(answer(resistance, field, tool).patches.limits_n.sum())

    first, second = held(), held()
    resistance.forget()
    assert second > first == held()


def test_a_bucket_described_anew_remembers_how_far_it_has_sunk_in():
    field, velocity = flat(), np.array([0.0, 0.0, -1.0])
    tool = tool_at(np.array([0.0, 0.0, 1.0]), -math.pi, velocity, 0.0)
    limits = []
    for anew in (False, True):
        resistance = SoilResistance(SAND, 8)
        for _ in range(3):
            geometry = dataclasses.replace(BUCKET) if anew else BUCKET
            reaction = answer(resistance, field, dataclasses.replace(tool, geometry=geometry))
        limits.append(reaction.patches.limits_n)
    np.testing.assert_array_equal(*limits)


@pytest.mark.parametrize("preset", PRESETS)
def test_every_soil_resists(preset):
    found = force(PRESETS[preset], flat(), dragged(40, 0.3), *PatchKind)
    assert 1e3 < -found @ FULL_SPEED < 60e3
