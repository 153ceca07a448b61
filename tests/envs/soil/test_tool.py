import dataclasses

import numpy as np
import pytest

from bench.soil import BUCKET, rotation_at
from lerobot_excav.envs.soil.tool import Tool, ToolGeometry
from lerobot_excav.errors import ConfigurationError

TRIANGLE = np.array([(1.0, 0.0), (0.5, 0.5), (0.0, 0.0)])

POSE = dict.fromkeys(("position_w", "linear_velocity_w", "angular_velocity_w"), np.zeros(3)) | {"rotation_w": np.eye(3)}


def tool(**changes):
    return Tool(geometry=BUCKET, **(POSE | changes))


def test_volume_and_centroid_of_a_triangle():
    geometry = ToolGeometry(profile_t=TRIANGLE, inner_width_m=2.0)
    assert geometry.struck_volume_m3 == pytest.approx(0.5)
    np.testing.assert_allclose(geometry.centroid_t, [0.5, 0.0, 1.0 / 6.0])


def test_the_first_plane_is_the_opening_and_the_last_two_are_the_sides():
    planes = ToolGeometry(profile_t=TRIANGLE, inner_width_m=2.0).planes_t
    np.testing.assert_allclose(planes[0], [0, 0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(planes[-2:], [[0, -1, 0, 1], [0, 1, 0, 1]])


def test_corners_lie_on_the_planes_and_the_centroid_inside():
    distance = BUCKET.corners_t @ BUCKET.planes_t[:, :3].T - BUCKET.planes_t[:, 3]
    np.testing.assert_allclose(distance.max(axis=1), 0.0, atol=1e-12)
    assert (BUCKET.planes_t[:, :3] @ BUCKET.centroid_t < BUCKET.planes_t[:, 3]).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"profile_t": TRIANGLE[:2]}, r"shape \(2, 2\)"),
        ({"profile_t": TRIANGLE[::-1]}, "not convex and counter-clockwise"),
        ({"profile_t": [(1.0, 0.0), (0.5, 0.1), (0.4, 0.5), (0.0, 0.0)]}, "not convex"),
        ({"profile_t": [(1.0, 0.0), (0.5, 0.5), (0.0, -0.1)]}, "z_t < 0"),
        ({"profile_t": [(1.0, 0.0), (0.5, np.nan), (0.0, 0.0)]}, "not finite"),
        ({"profile_t": [(1.0, 0.0), (1.0, 0.0), (0.5, 0.5), (0.0, 0.0)]}, "lists the same point twice"),
        ({"profile_t": [(1.0, 0.0), (0.5, 0.5), (0.0, 0.0), (1.0, 0.0)]}, "lists the same point twice"),
        ({"profile_t": [(1.0, 0.0), (0.5, 0.0), (0.0, 0.0)]}, "holds no volume"),
        ({"inner_width_m": 0.0}, "inner_width_m=0.0"),
        ({"inner_width_m": np.nan}, "inner_width_m=nan"),
        ({"inner_width_m": np.inf}, "inner_width_m=inf"),
        ({"position_w": np.zeros(2)}, "position_w has shape"),
        ({"linear_velocity_w": np.array([np.inf, 0, 0])}, r"linear_velocity_w=.* is not finite"),
        ({"rotation_w": 2 * np.eye(3)}, "off orthonormal"),
        ({"rotation_w": np.diag([1.0, 1.0, -1.0])}, "is a reflection"),
    ],
)
def test_a_bad_tool_is_refused(changes, message):
    with pytest.raises(ConfigurationError, match=message):
        tool(**changes) if changes.keys() <= POSE.keys() else dataclasses.replace(BUCKET, **changes)


def test_a_geometry_knows_its_shape_and_no_other():
    geometry = dataclasses.replace(BUCKET, profile_t=TRIANGLE)
    assert geometry.has_shape_of(dataclasses.replace(geometry))
    for change in ({"inner_width_m": 2.0}, {"profile_t": 2 * TRIANGLE}, {"profile_t": BUCKET.profile_t}):
        assert not geometry.has_shape_of(dataclasses.replace(geometry, **change))


@pytest.mark.parametrize("pitch", [-3.0, -1.5, 0.0, 0.4, 3.0])
def test_pitch_is_read_from_the_rotation(pitch):
    assert tool(rotation_w=rotation_at(pitch)).pitch_rad == pytest.approx(pitch)


def test_a_tool_keeps_its_own_copy_of_the_pose():
    position = np.zeros(3)
    made = tool(position_w=position)
    position[0] = 1.0
    assert made.position_w[0] == 0.0
