import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.machines.excavator.braking import (
    CREEP_SPEED_M_S,
    braking_impulse,
    patch_rows,
    patch_speeds,
    solved,
)

SEEDS = st.integers(0, 2**32 - 1)


def random_inertia(rng, joints=4):
    """A mass matrix like the machine's: some tonnes times square metres, coupled."""
    root = rng.normal(size=(joints, joints))
    return 3e3 * (root @ root.T) + np.diag(rng.uniform(100.0, 2e4, joints))


def random_case(rng, count, *, friction):
    rows = rng.normal(size=(count, 3, 4)) * rng.uniform(0.0, 5.0, 4)
    limits = 10.0 ** rng.uniform(-1.0, 3.0, count)
    frictions = rng.uniform(0.0, 0.8, count) if friction else np.zeros(count)
    return rows, limits, frictions, random_inertia(rng), rng.normal(size=4)


def one_patch(limit, friction=0.0):
    """One joint of 100 kg m2 at a lever of 2 m: the point weighs 25 kg along the normal, one along a tangent."""
    rows = np.array([[[2.0, 0.0], [0.0, 2.0], [0.0, 0.0]]])
    return rows, np.array([limit]), np.array([friction]), 100.0 * np.eye(2)


def relaxed(rows, limits, inertia, free):
    """Velocities by projected Gauss-Seidel on smooth patches: slow, patch by patch, to the end."""
    inverse, velocity, impulses = np.linalg.inv(inertia), free.copy(), np.zeros(len(limits))
    for _ in range(20_000):
        before = velocity.copy()
        for k, limit in enumerate(limits):
            row = rows[k, 0]
            mobility = row @ inverse @ row
            wanted = np.clip(impulses[k] - row @ velocity / mobility, 0.0, limit)
            velocity = velocity + inverse @ row * (wanted - impulses[k])
            impulses[k] = wanted
        if np.abs(velocity - before).max() < 1e-13:
            break
    return velocity


@given(SEEDS, st.integers(1, 6))
@settings(max_examples=50)
def test_solved_solves(seed, size):
    rng = np.random.default_rng(seed)
    matrix, right = random_inertia(rng, size), rng.normal(size=size)
    np.testing.assert_allclose(matrix @ solved(matrix, right), right, rtol=1e-8, atol=1e-9)


@given(SEEDS)
@settings(max_examples=30)
def test_rows_give_the_speed_of_a_rigid_body(seed):
    rng = np.random.default_rng(seed)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points, axes = rng.normal(size=(5, 3)), rng.normal(size=(5, 3, 3))
    jacobian, joint_vel = rng.normal(size=(6, 4)), rng.normal(size=4)
    linear, angular = np.split(jacobian @ joint_vel, 2)
    expected = [
        axis @ rotation.T @ (linear + np.cross(angular, rotation @ point))
        for point, axis in zip(points, axes, strict=True)
    ]
    rows = patch_rows(jacobian, np.ascontiguousarray(rotation), points, axes)
    np.testing.assert_allclose(patch_speeds(rows, joint_vel), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("limit", "friction", "free", "impulse", "held"),
    [
        pytest.param(10.0, 0.0, (-0.5, 0.0), (10.0, 0.0, 0.0), [], id="weak: its limit"),
        pytest.param(1e6, 0.0, (-0.5, 0.0), (25.0, 0.0, 0.0), [0], id="strong: it stops 25 kg at 1 m/s"),
        pytest.param(1e3, 0.5, (0.5, 1.0), (0.0, 0.0, 0.0), [], id="motion out of the soil is left alone"),
        pytest.param(10.0, 0.4, (-0.5, 3.0), (10.0, -4.0, 0.0), [], id="friction against the sliding"),
        pytest.param(1e6, 0.4, (-0.5, 0.1), (25.0, -5.0, 0.0), [0, 1], id="friction holds what it can hold"),
    ],
)
def test_a_patch_pushes_and_rubs_as_it_can_but_only_stops_the_motion(limit, friction, free, impulse, held):
    rows, *limits = one_patch(limit, friction)
    total, impulses = braking_impulse(rows, *limits, np.array(free))
    np.testing.assert_allclose(impulses[0], impulse, rtol=1e-3 if held else 1e-6)
    np.testing.assert_allclose(total, 2.0 * impulses[0, :2])
    speeds = patch_speeds(rows, free + total / 100.0)[0]
    assert (np.abs(speeds[held]) < CREEP_SPEED_M_S).all()
    assert np.sign(speeds[0]) == np.sign(free[0])  # slower, never backwards


@given(SEEDS, st.integers(1, 12))
@settings(max_examples=40)
def test_smooth_patches_give_what_relaxing_one_by_one_gives_in_the_end(seed, count):
    rows, limits, frictions, inertia, free = random_case(np.random.default_rng(seed), count, friction=False)
    total, _ = braking_impulse(rows, limits, frictions, inertia, free)
    found = free + np.linalg.solve(inertia, total)
    np.testing.assert_allclose(found, relaxed(rows, limits, inertia, free), atol=1e-3)


@given(SEEDS, st.integers(1, 60))
@settings(max_examples=150)
def test_no_patches_drive_the_joints_reverse_a_point_or_rub_more_than_they_can(seed, count):
    rows, limits, frictions, inertia, free = random_case(np.random.default_rng(seed), count, friction=True)
    total, impulses = braking_impulse(rows, limits, frictions, inertia, free)
    velocity = free + np.linalg.solve(inertia, total)
    speeds = patch_speeds(rows, velocity)
    energy = [v @ inertia @ v for v in (free, velocity)]
    assert total @ velocity <= 1e-9 * energy[0]
    assert energy[1] <= energy[0] * (1.0 + 1e-12)
    assert (impulses[:, 0] >= 0.0).all()
    assert (impulses[:, 0] <= limits * (1.0 + 1e-12)).all()
    assert (np.linalg.norm(impulses[:, 1:], axis=1) <= frictions * limits * (1.0 + 1e-9)).all()
    assert (speeds[impulses[:, 0] > 1e-6 * limits, 0] <= 1e-7).all()
    np.testing.assert_allclose(np.einsum("kaj,ka->j", rows, impulses), total, rtol=1e-9, atol=1e-9)


@given(SEEDS)
@settings(max_examples=30)
def test_the_order_of_the_patches_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    rows, limits, frictions, inertia, free = random_case(rng, 20, friction=True)
    order = rng.permutation(20)
    once, _ = braking_impulse(rows, limits, frictions, inertia, free)
    again, _ = braking_impulse(rows[order], limits[order], frictions[order], inertia, free)
    np.testing.assert_allclose(np.linalg.solve(inertia, once - again), 0.0, atol=1e-4)
