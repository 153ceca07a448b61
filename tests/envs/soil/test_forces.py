import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil import reference
from lerobot_excav.envs.soil.benchmark import BUCKET, tool_at
from lerobot_excav.envs.soil.earthmoving import earthmoving_factors, failure_angle
from lerobot_excav.envs.soil.forces import PENETRATION_CAP_N, DiggingResistance, bearing_factors, wedge_area
from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.parameters import GRAVITY_M_S2, PRESETS, SoilParameters
from lerobot_excav.envs.soil.tool import Tool

SAND = PRESETS["sand"]
NO_EDGE = dataclasses.replace(SAND, penetration_scale=0.0)
FULL_SPEED = np.array([-1.0, 0.0, 0.0])
PLATE_RAD = math.atan2(0.38, -0.38)
"""Direction of the bottom plate in the tool frame: 135 degrees."""


def flat(height: float = 1.0) -> HeightField:
    field = HeightField((120, 120), (0.05, 0.05), 0.0)
    field.reset(np.full((120, 120), height))
    return field


def force(parameters: SoilParameters, field: HeightField, tool: Tool, slices: int = 8) -> np.ndarray:
    return DiggingResistance(parameters, slices).wrench(field.heights, field.grid, tool, 0.0)[0]


def dragged(rake_deg: float, depth: float, velocity: np.ndarray = FULL_SPEED) -> Tool:
    """The bucket dragged to -x with the bottom plate at a rake from the horizontal."""
    pitch = math.radians(rake_deg) - PLATE_RAD
    return tool_at(np.array([0.0, 0.0, 1.0 - depth]), pitch, velocity, 0.0)


@pytest.mark.parametrize("rake", [25.0, 35.0, 45.0])
@pytest.mark.parametrize("depth", [0.1, 0.2, 0.4])
def test_flat_ground_gives_the_fundamental_equation_of_earthmoving(rake: float, depth: float) -> None:
    friction, steel = SAND.friction_angle_rad, SAND.steel_friction_angle_rad
    failure = failure_angle(math.radians(rake), friction, steel)
    factor = earthmoving_factors(math.radians(rake), failure, friction, steel).weight
    expected = SAND.density_kg_m3 * GRAVITY_M_S2 * depth**2 * factor * BUCKET.inner_width_m
    found = force(NO_EDGE, flat(), dragged(rake, depth))
    assert np.linalg.norm(found) == pytest.approx(expected, rel=0.01)
    assert found[0] == pytest.approx(expected * math.sin(math.radians(rake) + steel), rel=0.01)
    assert found[2] == pytest.approx(-expected * math.cos(math.radians(rake) + steel), rel=0.01)


def test_cohesion_adds_its_term() -> None:
    sticky = dataclasses.replace(NO_EDGE, cohesion_pa=2000.0)
    rake, depth = math.radians(40.0), 0.3
    failure = failure_angle(rake, SAND.friction_angle_rad, SAND.steel_friction_angle_rad)
    factor = earthmoving_factors(
        rake, failure, SAND.friction_angle_rad, SAND.steel_friction_angle_rad
    ).cohesion
    more = np.linalg.norm(
        force(sticky, flat(), dragged(40, depth)) - force(NO_EDGE, flat(), dragged(40, depth))
    )
    assert more == pytest.approx(2000.0 * depth * BUCKET.inner_width_m * factor, rel=0.01)


def test_the_weight_of_a_heap_ahead_counts() -> None:
    heaped = flat()
    heaped.heights[:50] += 0.3
    assert np.linalg.norm(force(NO_EDGE, heaped, dragged(40, 0.3))) > 1.5 * np.linalg.norm(
        force(NO_EDGE, flat(), dragged(40, 0.3))
    )


def test_there_is_no_force_above_the_surface_and_it_starts_from_zero() -> None:
    depths = np.linspace(-0.05, 0.4, 200)
    forces = np.array([np.linalg.norm(force(SAND, flat(), dragged(35, d))) for d in depths])
    assert (forces[depths <= 0] == 0).all()
    assert forces[depths > 0].min() > 0
    assert (np.diff(forces) >= 0).all()
    assert np.diff(forces).max() < 0.02 * forces.max()


def test_the_edge_bears_more_as_it_goes_deeper_over_the_ramp() -> None:
    """Straight in, against bearing theory times a ramp from 10 to 100 percent over 0.2 m."""
    into = np.array([-1.0, 0.0, -1.0]) / math.sqrt(2)
    depth_factor, width_factor = bearing_factors(SAND.friction_angle_rad)
    assert depth_factor == pytest.approx(56.0, rel=0.01)
    assert width_factor == pytest.approx(92.2, rel=0.01)
    area = (0.02 + 5 * 0.06 * 0.015 / 0.7) * BUCKET.inner_width_m
    for depth, ramp in ((0.1, 0.55), (0.2, 1.0), (0.3, 1.0)):
        stress = SAND.density_kg_m3 * GRAVITY_M_S2 * (depth * depth_factor + 0.5 * 0.02 * width_factor)
        found = force(SAND, flat(), dragged(45, depth, into))
        assert -(found @ into) == pytest.approx(ramp * stress * area, rel=0.01)


def test_the_penetration_scale_scales_and_the_cap_limits() -> None:
    into = np.array([-1.0, 0.0, -1.0]) / math.sqrt(2)
    once = np.linalg.norm(force(SAND, flat(), dragged(45, 0.2, into)))
    twice = np.linalg.norm(
        force(dataclasses.replace(SAND, penetration_scale=2.0), flat(), dragged(45, 0.2, into))
    )
    capped = np.linalg.norm(
        force(dataclasses.replace(SAND, penetration_scale=99.0), flat(), dragged(45, 0.4, into))
    )
    assert twice == pytest.approx(2 * once)
    assert capped == pytest.approx(PENETRATION_CAP_N, rel=1e-3)


@given(
    pitch=st.floats(-3.5, 0.5),
    depth=st.floats(-0.1, 0.6),
    velocity=st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2)),
)
@settings(max_examples=100, deadline=None)
def test_the_soil_never_drives_the_edge(
    pitch: float, depth: float, velocity: tuple[float, float, float]
) -> None:
    edge = np.array([0.0, 0.0, 1.0 - depth])
    found = force(SAND, flat(), tool_at(edge, pitch, np.array(velocity), 0.0))
    assert np.isfinite(found).all()
    assert found @ np.array(velocity) <= 1e-9


def test_a_bucket_at_rest_or_pulled_out_feels_nothing() -> None:
    assert not force(SAND, flat(), dragged(40, 0.3, np.zeros(3))).any()
    out = dragged(40, 0.3, np.array([math.cos(math.radians(40)), 0.0, math.sin(math.radians(40))]))
    assert np.linalg.norm(force(SAND, flat(), out)) < 1e-9


def test_the_torque_is_that_of_the_force_at_the_edge() -> None:
    tool, field = dragged(40, 0.3), flat()
    found, torque = DiggingResistance(SAND, 8).wrench(field.heights, field.grid, tool, 0.0)
    arm = tool.rotation_w @ np.array([1.15, 0.0, 0.0])
    np.testing.assert_allclose(torque, np.cross(arm, found), atol=1e-6)


def test_a_one_sided_heap_turns_the_bucket() -> None:
    tool, field = dragged(40, 0.3), flat()
    field.heights[:, 60:] += 0.3
    _, torque = DiggingResistance(SAND, 8).wrench(field.heights, field.grid, tool, 0.0)
    assert abs(torque[2]) > 100.0


def test_the_world_floor_depth_shifts_the_force_only() -> None:
    field, deep = flat(), 0.7
    tool = dragged(40, 0.3)
    lower = tool_at(np.array([0.0, 0.0, 0.7 - deep]), tool.pitch_rad, FULL_SPEED, 0.0)
    resistance = DiggingResistance(SAND, 8)
    same = resistance.wrench(field.heights, field.grid, lower, deep)[0]
    np.testing.assert_allclose(same, resistance.wrench(field.heights, field.grid, tool, 0.0)[0], rtol=1e-9)


@given(failure=st.floats(0.25, 0.6), slope=st.floats(-0.4, 0.2), depth=st.floats(0.05, 0.5))
@settings(max_examples=30, deadline=None)
def test_the_wedge_on_a_slope_is_weighed_exactly(failure: float, slope: float, depth: float) -> None:
    field = flat()
    field.heights[:] = (1.0 - slope * (field.centres(0)))[:, None]
    found = wedge_area(field.heights, field.grid, (0.0, 0.0, 1.0 - depth), (-1.0, 0.0), failure)
    reach = np.arange(0.0, 2.9, 0.001)
    expected = reference.wedge_area(depth + slope * np.maximum(reach, 0.05), 0.001, failure)
    assert found == pytest.approx(expected, rel=0.03)
