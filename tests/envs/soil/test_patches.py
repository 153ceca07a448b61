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


def random_patches(rng, count=12):
    normals = rng.normal(size=(count, 3))
    return Patches(
        points_w=rng.normal(size=(count, 3)),
        normals_w=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        limits_n=rng.uniform(1.0, 1e5, count),
        frictions=rng.uniform(0.0, 1.0, count),
        kinds=rng.integers(0, 3, count).astype(np.int8),
    )


@pytest.mark.parametrize("speed", [0.05, 0.5, 5.0])
def test_straight_in_meets_the_limit_at_any_digging_speed_and_straight_out_nothing(speed):
    np.testing.assert_allclose(force(floor_patch(), -speed * UP), 1000.0 * UP)
    for way in (UP, FORWARD, 0.0 * UP):
        np.testing.assert_array_equal(force(floor_patch(), speed * way), 0.0)
    assert force(floor_patch(), -1e-3 * REST_SPEED_M_S * UP)[2] < 10.0


def test_sliding_rubs_against_the_motion_with_the_friction_of_the_push():
    np.testing.assert_allclose(force(floor_patch(), np.array([0.5, 0.0, -0.5])), [-500.0, 0.0, 1000.0])


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50)
def test_the_wrench_takes_power_from_every_motion_and_has_its_torque_about_the_origin(seed):
    rng = np.random.default_rng(seed)
    patches = random_patches(rng)
    origin, linear, angular = rng.normal(size=(3, 3))
    found, torque = patches.wrench(origin, linear, angular)
    assert found @ linear + torque @ angular <= 1e-9 * (1.0 + np.linalg.norm(found))
    other, shifted = patches.wrench(np.zeros(3), linear - np.cross(angular, origin), angular)  # the same motion
    np.testing.assert_allclose(other, found, rtol=1e-9)
    np.testing.assert_allclose(shifted, torque + np.cross(origin, found), rtol=1e-9, atol=1e-6)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50)
def test_the_wrench_is_continuous_in_the_direction_of_motion(seed):
    """No direction of motion is a step: turning by a thousandth changes the force by about a hundredth at most."""
    rng, turn = np.random.default_rng(seed), 1e-3
    patches, angle = random_patches(rng), rng.uniform(0, 2 * np.pi)
    one, other = (force(patches, np.array([np.cos(a), 0.0, np.sin(a)])) for a in (angle, angle + turn))
    assert np.linalg.norm(other - one) <= 12.0 * turn * patches.limits_n.sum()


def test_joined_patches_can_be_told_apart_by_kind_and_those_that_hold_nothing_are_left_out():
    wedges = Patches.alike(np.eye(3), np.eye(3), np.array([5.0, 0.0, 7.0]), 0.4, PatchKind.WEDGE)
    joined = Patches.joined(floor_patch(), wedges, Patches.none())
    assert [len(joined), *(len(joined.of_kind(kind)) for kind in PatchKind)] == [3, 2, 0, 1]
    np.testing.assert_array_equal(joined.of_kind(PatchKind.WEDGE).full_forces_w_n, [[5, 0, 0], [0, 0, 7]])


def test_the_patches_of_some_kinds_can_be_held_to_a_total():
    wedges = Patches.alike(np.eye(3), np.eye(3), np.array([5.0, 6.0, 7.0]), 0.4, PatchKind.WEDGE)
    joined = Patches.joined(wedges, floor_patch(1000.0), floor_patch(3000.0))
    bounded = joined.bounded(400.0, PatchKind.PRESSURE)
    np.testing.assert_allclose(bounded.limits_n, [5.0, 6.0, 7.0, 100.0, 300.0])
    np.testing.assert_array_equal(joined.bounded(4000.0, PatchKind.PRESSURE).limits_n, joined.limits_n)
    assert len(Patches.none().bounded(400.0, PatchKind.PRESSURE)) == 0
