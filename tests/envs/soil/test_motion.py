from itertools import pairwise

import numpy as np
import pytest

from lerobot_excav.envs.soil.benchmark import rotation_at
from lerobot_excav.envs.soil.motion import Pose, largest_motion, poses_between

START = Pose(position=np.zeros(3), rotation=rotation_at(0.2))
END = Pose(position=np.array([0.3, -0.6, 0.9]), rotation=rotation_at(-0.4))


def test_steps_join_up_and_share_the_way() -> None:
    steps = list(poses_between(START, END, 3))
    assert steps[0][0] is START
    assert steps[-1][1] is END
    for (_, end), (start, _) in pairwise(steps):
        assert end is start
    np.testing.assert_allclose(steps[0][1].position, END.position / 3)
    np.testing.assert_allclose(steps[0][1].rotation, rotation_at(0.0), atol=1e-12)
    np.testing.assert_allclose(steps[1][1].rotation, rotation_at(-0.2), atol=1e-12)


def test_one_step_is_the_whole_way() -> None:
    assert list(poses_between(START, END, 1)) == [(START, END)]


def test_the_largest_motion_is_that_of_the_farthest_point() -> None:
    turned = Pose(position=START.position, rotation=rotation_at(0.2 + 0.01))
    moved = largest_motion(np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]), START, turned)
    assert moved == pytest.approx(2 * 2.0 * np.sin(0.005))
