import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.soil import BUCKET, tool_at
from lerobot_excav.envs.constants import GRAVITY_M_S2, TICK_S
from lerobot_excav.envs.soil.earthmoving import earthmoving_factors, failure_angle
from lerobot_excav.envs.soil.forces import bearing_factors, soil_strength
from lerobot_excav.envs.soil.parameters import PRESETS
from lerobot_excav.envs.soil.plates import PLATE_THICKNESS_M, OuterFaces
from lerobot_excav.envs.soil.pressure import (
    SINKAGE_EXPONENT,
    SINKAGE_MODULUS,
    PlatePressure,
    ground_factors,
    plate_limits,
    plate_overlaps,
)
from validation.soil.reference.worlds import flat

SAND = PRESETS["sand"]
SOIL = soil_strength(SAND)
WEIGHT = SAND.density_kg_m3 * GRAVITY_M_S2
DOWN, LEVEL = np.array([[0.0, 0.0, -1.0]]), np.array([[1.0, 0.0, 0.0]])


def limit(overlap, sinkage, normal, area=0.1, breadth=0.3, factor=1.0, soil=SOIL):
    before, after = (np.array([[value] for value in part]) for part in ((overlap, sinkage, factor), (area, breadth)))
    return float(plate_limits(*before, normal, *after, soil)[0])


FACES = OuterFaces.of(BUCKET, 4)


def heel_down(height, velocity=(0.0, 0.0, -0.5)):
    """The bucket with its opening level on top and its lowest plate at a height."""
    lowest = tool_at(np.zeros(3), -math.pi, np.zeros(3), 0.0)
    bottom = float((lowest.position_w + FACES.points_t @ lowest.rotation_w.T)[:, 2].min())
    return tool_at(np.array([0.0, 0.0, height - bottom]), -math.pi, np.array(velocity), 0.0)


def press_in(field, depths):
    """Press the bucket down on flat ground to some depths, in turn."""
    plates = PlatePressure(FACES, SOIL)
    for depth, way in zip(depths, np.diff(depths, prepend=-0.01), strict=True):
        tool = heel_down(1.0 - depth, (0.0, 0.0, -way / TICK_S))
        yield plates.patches(field.heights, field.grid, tool, 0.0, TICK_S)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_overlaps_are_those_of_a_plain_look_at_the_ground(seed):
    rng = np.random.default_rng(seed)
    field = flat()
    field.heights[:] = rng.uniform(0.0, 1.0, field.heights.shape)
    points = rng.uniform((-3.5, -3.5, 0.0), (3.5, 3.5, 1.0), (40, 3))
    normals = rng.normal(size=(40, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    looked = points[:, :2] + 0.05 * normals[:, :2]
    expected = np.where(field.contains(looked), np.maximum(0.0, field.sample(looked) - points[:, 2]), 0.0)
    np.testing.assert_allclose(plate_overlaps(field.heights, field.grid, points, normals), expected, atol=1e-12)


def test_a_plate_that_sinks_meets_the_measured_pressure_of_dry_sand():
    """Bekker's k z^n: 30 kPa at 2.8 cm of sinkage in the dry sand of Wong's table."""
    assert limit(0.05, 0.0281, DOWN) / 0.1 == pytest.approx(30e3, rel=0.02)
    ratio = limit(0.05, 0.06, DOWN) / limit(0.05, 0.03, DOWN)
    assert ratio == pytest.approx(2.0**SINKAGE_EXPONENT)


def test_the_bearing_capacity_of_the_footing_bounds_the_pressure():
    _, depth_factor, width_factor = bearing_factors(SAND.friction_angle_rad)
    capacity = WEIGHT * (0.05 * depth_factor + 0.5 * 0.3 * width_factor)
    assert capacity < SINKAGE_MODULUS * 1.0
    assert limit(0.05, 1.0, DOWN) == pytest.approx(0.1 * capacity)


def test_an_upright_plate_meets_the_fundamental_equation_of_earthmoving():
    """A wall of slices at all depths adds up to gamma d^2 N_gamma w, normal to the plate."""
    depth, width, count = 0.4, 0.7, 400
    levels = (np.arange(count) + 0.5) / count * depth
    whole = sum(limit(float(z), 0.0, LEVEL, area=depth / count * width, breadth=0.0) for z in levels)
    rake = math.radians(90.0)  # the end of the table
    failure = failure_angle(rake, SAND.friction_angle_rad, SAND.steel_friction_angle_rad)
    factor = earthmoving_factors(rake, failure, SAND.friction_angle_rad, SAND.steel_friction_angle_rad).weight
    expected = WEIGHT * depth**2 * factor * width * math.cos(SAND.steel_friction_angle_rad)
    # The pressure fades in over the plate's thickness, at the top.
    assert whole == pytest.approx(expected, rel=(PLATE_THICKNESS_M / depth) ** 2)


def test_cohesion_adds_to_an_upright_plate_what_the_equation_says():
    sticky = SOIL._replace(cohesion=2000.0)
    more = limit(0.2, 0.0, LEVEL, breadth=0.0, soil=sticky) - limit(0.2, 0.0, LEVEL, breadth=0.0)
    assert more == pytest.approx(0.1 * 2000.0 * SOIL.table[-1, 2] * math.cos(SAND.steel_friction_angle_rad))


@pytest.mark.parametrize("normal", [DOWN, LEVEL, np.array([[0.6, 0.0, -0.8]]), np.array([[0.0, 0.6, 0.8]])])
def test_the_pressure_starts_from_zero_at_contact(normal):
    """Also for a plate that has sunk far before."""
    overlaps = np.linspace(0.0, 0.1, 200)
    found = np.array([limit(float(z), 0.2, normal) for z in overlaps])
    assert found[0] == 0.0 < found[1]
    assert (np.diff(found) >= -1e-9 * found.max()).all()
    assert np.diff(found).max() < 0.05 * found.max()


def test_the_ground_bears_less_beside_a_slope():
    field = flat()
    points = np.array([[0.0, 0.0, 1.0]])
    assert ground_factors(field.heights, field.grid, points) == pytest.approx([1.0])
    field.heights[:] = (1.0 - 0.4 * np.abs(field.centres(0)))[:, None]
    assert ground_factors(field.heights, field.grid, points) == pytest.approx([0.36], abs=0.03)
    field.heights[:] = (0.2 + 0.4 * np.abs(field.centres(0)))[:, None]  # a trench holds as level ground does
    assert ground_factors(field.heights, field.grid, points) == pytest.approx([1.0])
    assert limit(0.05, 0.05, DOWN, factor=0.36) == pytest.approx(0.36 * limit(0.05, 0.05, DOWN))


def test_a_bucket_above_the_ground_feels_nothing_and_one_that_is_pressed_in_ever_more():
    found = list(press_in(flat(), np.linspace(-0.01, 0.25, 53)))
    sizes = [patches.limits_n.sum() for patches in found]
    above, below = sizes[:3], sizes[3:]
    assert not np.any(above)
    assert (np.diff(below) > 0.0).all()
    assert np.diff(below).max() < 0.1 * below[-1]
    assert below[-1] > 20e3
    assert all((patches.normals_w[:, 2] > -1e-9).all() for patches in found)  # out of the ground, into the bucket
    assert found[-1].frictions == pytest.approx(math.tan(SAND.steel_friction_angle_rad))


def test_the_sinkage_is_forgotten_when_the_plate_leaves_the_ground():
    sizes = [patches.limits_n.sum() for patches in press_in(flat(), [0.1, 0.11, 0.12, -0.01, 0.1])]
    assert sizes[0] < sizes[1] < sizes[2]
    assert sizes[3:] == [0.0, pytest.approx(sizes[0])]


def test_soil_on_one_side_pushes_to_the_other():
    field = flat(0.0)
    field.heights[:, 68:] = 1.0  # beyond the left side plate only
    tool = heel_down(0.3, (0.0, 1.0, 0.0))
    patches = PlatePressure(FACES, SOIL).patches(field.heights, field.grid, tool, 0.0, TICK_S)
    assert len(patches) > 0
    np.testing.assert_allclose(patches.normals_w, np.tile([0.0, -1.0, 0.0], (len(patches), 1)), atol=1e-9)
    assert patches.wrench(tool.position_w, tool.linear_velocity_w, np.zeros(3))[0][1] < -500.0
