import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil.patches import REST_SPEED_M_S, Patches, PatchKind

UP, FORWARD = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])


def floor_patch(limit=1000.0, friction=0.5):
    """Soil under the origin that pushes upwards."""
    return Patches.alike(np.zeros((1, 3)), UP[None], np.array([limit]), friction, PatchKind.PRESSURE)


def force(patches, velocity):
    return patches.wrench(np.zeros(3), velocity, np.zeros(3))[0]


def random_patches(rng, count):
    normals = rng.normal(size=(count, 3))
    return Patches(
        points_w=rng.normal(size=(count, 3)),
        normals_w=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        limits_n=rng.uniform(1.0, 1e5, count),
        frictions=rng.uniform(0.0, 1.0, count),
        kinds=rng.integers(0, 3, count).astype(np.int8),
    )


def test_straight_in_meets_the_limit_and_straight_out_nothing():
    np.testing.assert_allclose(force(floor_patch(), -UP), 1000.0 * UP)
    np.testing.assert_array_equal(force(floor_patch(), UP), 0.0)
    np.testing.assert_array_equal(force(floor_patch(), FORWARD), 0.0)


def test_sliding_rubs_against_the_motion_with_the_friction_of_the_push():
    found = force(floor_patch(), np.array([0.5, 0.0, -0.5]))
    np.testing.assert_allclose(found, [-500.0, 0.0, 1000.0])


def test_resistance_does_not_fade_at_digging_speeds_and_ends_at_rest():
    for speed in (0.05, 0.5, 5.0):
        np.testing.assert_allclose(force(floor_patch(), -speed * UP), 1000.0 * UP)
    assert force(floor_patch(), -1e-3 * REST_SPEED_M_S * UP)[2] < 10.0
    np.testing.assert_array_equal(force(floor_patch(), np.zeros(3)), 0.0)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50)
def test_the_wrench_takes_power_from_every_motion(seed):
    rng = np.random.default_rng(seed)
    patches, origin = random_patches(rng, 12), rng.normal(size=3)
    linear, angular = rng.normal(size=3), rng.normal(size=3)
    found, torque = patches.wrench(origin, linear, angular)
    assert found @ linear + torque @ angular <= 1e-9 * (1.0 + np.linalg.norm(found))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50)
def test_the_wrench_is_continuous_in_the_direction_of_motion(seed):
    """No direction of motion is a step: turning by a thousandth changes the force by about a hundredth at most."""
    rng = np.random.default_rng(seed)
    patches = random_patches(rng, 12)
    angle, turn = rng.uniform(0, 2 * np.pi), 1e-3
    around = [np.array([np.cos(a), 0.0, np.sin(a)]) for a in (angle, angle + turn)]
    change = np.linalg.norm(force(patches, around[1]) - force(patches, around[0]))
    assert change <= 12.0 * turn * patches.limits_n.sum()


def test_the_torque_is_about_the_given_origin():
    origin = np.array([0.3, -0.2, 0.9])
    found, torque = floor_patch().wrench(origin, -UP, np.zeros(3))
    np.testing.assert_allclose(torque, np.cross(-origin, found))


def test_patches_turn_with_the_tool_that_carries_them():
    """A tool that turns about a distant axis moves the patch as that axis says."""
    found, _ = floor_patch().wrench(np.array([-2.0, 0.0, 0.0]), np.zeros(3), np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(found, 1000.0 * UP)


def test_patches_that_hold_nothing_are_left_out():
    made = Patches.alike(np.eye(3), np.eye(3), np.array([5.0, 0.0, 7.0]), 0.4, PatchKind.WEDGE)
    assert len(made) == 2
    np.testing.assert_array_equal(made.full_forces_w_n, [[5, 0, 0], [0, 0, 7]])
    assert len(Patches.none()) == 0


def test_joined_patches_can_be_told_apart_by_kind():
    joined = Patches.joined(floor_patch(), Patches.alike(np.zeros((1, 3)), UP[None], np.ones(1), 0.0, PatchKind.WEDGE))
    assert len(joined) == 2
    assert joined.of_kind(PatchKind.WEDGE).limits_n == pytest.approx([1.0])
    assert joined.of_kind(PatchKind.PRESSURE).limits_n == pytest.approx([1000.0])
    assert len(joined.of_kind(PatchKind.PENETRATION)) == 0
