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
from lerobot_excav.envs.soil.parameters import PRESETS
from lerobot_excav.envs.soil.patches import PatchKind
from validation.soil.reference.worlds import flat

SAND = PRESETS["sand"]
FULL_SPEED = np.array([-1.0, 0.0, 0.0])
PLATE_RAD = math.atan2(0.39, -0.39)
"""Direction of the bottom plate in the tool frame: 135 degrees."""

INTO = np.array([-1.0, 0.0, -1.0]) / math.sqrt(2)
"""Straight along a plate with a rake of 45 degrees."""


def answer(resistance, field, tool, floor_depth_m=0.0):
    empty = 0.0, np.array([0.5, 0.0, 0.3])
    return resistance.react(field.heights, field.heights, field.grid, tool, floor_depth_m, TICK_S, *empty)


def react(parameters, field, tool, floor_depth_m=0.0):
    return answer(SoilResistance(parameters, 8), field, tool, floor_depth_m)


def force(parameters, field, tool, *kinds):
    """Force on the unhindered tool by some kinds of patches."""
    patches = react(parameters, field, tool).patches
    motion = (tool.position_w, tool.linear_velocity_w, tool.angular_velocity_w)
    return np.sum([patches.of_kind(kind).wrench(*motion)[0] for kind in kinds], axis=0)


def dragged(rake_deg, depth, velocity=FULL_SPEED):
    """The bucket dragged to -x with the bottom plate at a rake from the horizontal."""
    pitch = math.radians(rake_deg) - PLATE_RAD
    return tool_at(np.array([0.0, 0.0, 1.0 - depth]), pitch, velocity, 0.0)


def earthmoving_n(soil, depth, rake_rad, width):
    """The fundamental equation of earthmoving: backward and downward part."""
    friction, steel = soil.friction_angle_rad, soil.steel_friction_angle_rad
    factors = earthmoving_factors(rake_rad, failure_angle(rake_rad, friction, steel), friction, steel)
    weight = soil.density_kg_m3 * GRAVITY_M_S2 * depth**2 * factors.weight
    size = (weight + soil.cohesion_pa * depth * factors.cohesion) * width
    return size * np.array([math.sin(rake_rad + steel), math.cos(rake_rad + steel)])


@pytest.mark.parametrize("cohesion", [0.0, 2000.0])
@pytest.mark.parametrize("rake", [25.0, 35.0, 45.0])
@pytest.mark.parametrize("depth", [0.1, 0.2, 0.4])
def test_flat_ground_gives_the_fundamental_equation_of_earthmoving(rake, depth, cohesion):
    soil = dataclasses.replace(SAND, cohesion_pa=cohesion)
    back, down = earthmoving_n(soil, depth, math.radians(rake), BUCKET.inner_width_m)
    found = force(soil, flat(), dragged(rake, depth), PatchKind.WEDGE)
    np.testing.assert_allclose(found, [back, 0.0, -down], atol=0.01 * math.hypot(back, down))


@given(
    rake=st.floats(0.4, 1.4),
    depth=st.floats(0.02, 0.3),
    width=st.floats(0.2, 3.0),
    density=st.floats(500.0, 3000.0),
    cohesion=st.floats(0.0, 5000.0),
)
@settings(max_examples=30)
def test_a_blade_meets_the_fundamental_equation_of_earthmoving(rake, depth, width, density, cohesion):
    soil = dataclasses.replace(SAND, density_kg_m3=density, cohesion_pa=cohesion)
    found, expected = (force(soil, depth, rake, width) for force in (blade_force_n, earthmoving_n))
    np.testing.assert_allclose(found, expected, rtol=0.01)


def test_a_heap_ahead_counts_and_turns_the_bucket_if_it_is_on_one_side():
    tool, level, heaped, one_sided = dragged(40, 0.3), flat(), flat(), flat()
    heaped.heights[:58] += 0.3  # from 0.1 m before the edge on
    one_sided.heights[:, 60:] += 0.3
    more, less = (np.linalg.norm(force(SAND, field, tool, PatchKind.WEDGE)) for field in (heaped, level))
    assert more > 1.5 * less
    assert abs(react(SAND, one_sided, tool).torque_w_nm[2]) > 100.0


def plunge(soil, depths, way=(0.0, 0.0, -1.0)):
    """Push the edge down along an upright plate, on ground that is not cut; return the resistance at each depth."""
    resistance, found = SoilResistance(soil, 8), []
    for depth in depths:
        tool = tool_at(np.array([0.0, 0.0, 1.0 - depth]), math.radians(90.0) - PLATE_RAD, np.array(way), 0.0)
        patches = answer(resistance, flat(), tool).patches.of_kind(PatchKind.PENETRATION)
        force, _ = patches.wrench(tool.position_w, tool.linear_velocity_w, tool.angular_velocity_w)
        found.append(float(force[2]))
    return found


def test_an_edge_that_is_pushed_straight_down_meets_the_bearing_capacity_in_the_end():
    """Prandtl-Reissner and Vesic, from zero at contact."""
    _, depth_factor, width_factor = bearing_factors(SAND.friction_angle_rad)
    assert depth_factor == pytest.approx(56.0, rel=0.01)
    assert width_factor == pytest.approx(92.2, rel=0.01)
    depths = np.arange(-0.04, 0.4, 0.02)
    found = plunge(SAND, depths)
    assert found[0] == 0.0
    assert (np.diff(found) >= 0.0).all()
    stress = SAND.density_kg_m3 * GRAVITY_M_S2 * (depths[-1] * depth_factor + 0.5 * 0.02 * width_factor)
    assert found[-1] == pytest.approx(stress * 0.02 * BUCKET.inner_width_m, rel=0.05)
    harder = dataclasses.replace(SAND, penetration_scale=2.0)
    assert plunge(harder, depths)[-1] == pytest.approx(2.0 * found[-1])


@pytest.mark.parametrize("depth", [0.1, 0.2, 0.4])
def test_an_edge_that_is_dragged_level_adds_little_to_its_wedge(depth):
    """The soil before it fails with the wedge; the edge's bearing carried half of all digging work."""
    tool = dragged(35, depth)
    wedge, edge = (-force(SAND, flat(), tool, kind) @ FULL_SPEED for kind in (PatchKind.WEDGE, PatchKind.PENETRATION))
    assert 0.0 < edge < 0.35 * wedge


def test_the_load_weighs_on_the_draught():
    """3568 N with 7 kg in the bucket and 3579 N with 156 kg were seen."""
    tool, found = dragged(30, 0.2), []
    for load in (7.0, 80.0, 156.0):
        reaction = SoilResistance(SAND, 8).react(
            *(flat().heights,) * 2, flat().grid, tool, 0.0, TICK_S, load, np.array([0.5, 0.0, 0.3])
        )
        found.append(float(reaction.force_w_n[0]))
    assert found[0] < found[1] < found[2]
    assert found[2] - found[0] > 0.4 * (156.0 - 7.0) * GRAVITY_M_S2


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
    np.testing.assert_allclose(reaction.force_w_n, force(SAND, flat(), tool, *PatchKind), rtol=1e-9, atol=1e-9)
    power = reaction.force_w_n @ tool.linear_velocity_w + reaction.torque_w_nm @ tool.angular_velocity_w
    assert power <= 1e-9


@given(pitch=st.floats(-3.0, -1.4), depth=st.floats(0.05, 0.5), angle=st.floats(0.0, 2 * math.pi))
@settings(max_examples=50)
def test_what_the_wedge_can_hold_depends_on_the_pose_and_not_on_the_motion(pitch, depth, angle):
    """Nothing can jump with the direction of motion."""
    edge = np.array([0.0, 0.0, 1.0 - depth])
    still = react(SAND, flat(), tool_at(edge, pitch, np.zeros(3), 0.0)).patches
    motion = np.array([math.cos(angle), 0.0, math.sin(angle)])
    moving = react(SAND, flat(), tool_at(edge, pitch, motion, 0.0)).patches
    one, other = (patches.of_kind(PatchKind.WEDGE).full_forces_w_n for patches in (moving, still))
    np.testing.assert_array_equal(one, other)


def test_the_force_is_continuous_in_the_direction_of_a_deep_scrape():
    angles = np.radians(np.arange(90.0, 271.0, 0.25))
    field, ways = flat(), np.stack([np.cos(angles), 0.0 * angles, np.sin(angles)], axis=1)
    deep = [force(SAND, field, dragged(20, 0.8, way), *PatchKind) for way in ways]
    jumps = np.linalg.norm(np.diff(deep, axis=0), axis=1)
    assert jumps.max() < 0.05 * np.linalg.norm(deep, axis=1).max()


def test_a_bucket_at_rest_feels_nothing_and_its_edge_leaves_freely():
    assert not react(SAND, flat(), dragged(40, 0.3, np.zeros(3))).force_w_n.any()
    out = dragged(40, 0.3, np.array([math.cos(math.radians(40)), 0.0, math.sin(math.radians(40))]))
    edge = (PatchKind.WEDGE, PatchKind.PENETRATION)
    assert np.linalg.norm(force(SAND, flat(), out, *edge)) < 1e-9


def test_the_world_floor_depth_shifts_the_force_only():
    tool = dragged(40, 0.3)
    lower = tool_at(np.array([0.0, 0.0, 0.7 - 0.7]), tool.pitch_rad, FULL_SPEED, 0.0)
    one, other = react(SAND, flat(), tool), react(SAND, flat(), lower, 0.7)
    np.testing.assert_allclose(other.force_w_n, one.force_w_n, rtol=1e-9)
    np.testing.assert_allclose(other.torque_w_nm, one.torque_w_nm, rtol=1e-9)


def test_a_bucket_remembers_how_far_it_has_sunk_in_unless_it_was_away():
    """Also one that is described by another geometry of the same shape in every step."""
    field, resistance = flat(), SoilResistance(SAND, 8)
    tool = tool_at(np.array([0.0, 0.0, 1.0]), -math.pi, np.array([0.0, 0.0, -1.0]), 0.0)
    alike = dataclasses.replace(tool, geometry=dataclasses.replace(BUCKET))

    def held(tool):
        return float(answer(resistance, field, tool).patches.limits_n.sum())

    sunk = [held(t) for t in (tool, tool, tool)]
    resistance.forget()
    assert [held(t) for t in (tool, alike, tool)] == sunk == sorted(set(sunk))


@pytest.mark.parametrize("preset", PRESETS)
def test_every_soil_resists(preset):
    found = force(PRESETS[preset], flat(), dragged(40, 0.3), *PatchKind)
    assert 1e3 < -found @ FULL_SPEED < 60e3
