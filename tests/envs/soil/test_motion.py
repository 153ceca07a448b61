import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.soil import rotation_at
from lerobot_excav.envs.soil.motion import Pose, largest_motion, path, poses_between, turned

START = Pose(position=np.zeros(3), rotation=rotation_at(0.2))
END = Pose(position=np.array([0.3, -0.6, 0.9]), rotation=rotation_at(-0.4))


@pytest.mark.parametrize("steps", [1, 3])
def test_steps_join_up_and_share_the_way(steps):
    visited = list(poses_between(START, END, steps))
    assert len(visited) == steps
    assert visited[0][0] is START
    assert visited[-1][1] is END
    for k, (start, end) in enumerate(visited):
        assert k == 0 or start is visited[k - 1][1]
        np.testing.assert_allclose(end.position, (k + 1) / steps * END.position)
        np.testing.assert_allclose(end.rotation, rotation_at(0.2 - 0.6 * (k + 1) / steps), atol=1e-12)


def test_the_largest_motion_is_that_of_the_farthest_point():
    turned = Pose(position=START.position, rotation=rotation_at(0.2 + 0.01))
    moved = largest_motion(np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]), START, turned)
    assert moved == pytest.approx(2 * 2.0 * np.sin(0.005))


vectors = st.tuples(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2), st.floats(-1.2, 1.2))


@given(first=vectors, turn=vectors, share=st.floats(0.0, 1.0))
@settings(max_examples=60)
def test_a_turned_rotation_is_a_rotation_by_the_share_of_the_angle(first, turn, share):
    start = turned(np.eye(3), np.array(first), 1.0)
    result = turned(start, np.array(turn), share)
    np.testing.assert_allclose(result.T @ result, np.eye(3), atol=1e-12)
    assert np.linalg.det(result) == pytest.approx(1.0)
    angle = math.acos(np.clip(0.5 * (np.trace(start.T @ result) - 1.0), -1.0, 1.0))
    assert angle == pytest.approx(share * float(np.linalg.norm(turn)), abs=1e-6)
    np.testing.assert_allclose(result @ np.array(turn), start @ np.array(turn), atol=1e-12)  # the axis stays


@given(first=vectors, turn=vectors)
@settings(max_examples=60)
def test_the_turn_of_a_path_leads_from_the_first_rotation_to_the_last(first, turn):
    before = turned(np.eye(3), np.array(first), 1.0)
    now = turned(before, np.array(turn), 1.0)
    _, rotations, turn_w = path(Pose(np.zeros(3), before), Pose(np.zeros(3), now), 2)
    np.testing.assert_allclose(rotations[-1], now, atol=1e-9)
    np.testing.assert_allclose(turn_w, before @ np.array(turn), atol=1e-9)
