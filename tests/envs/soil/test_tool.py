import numpy as np
import pytest

from bench.soil import BUCKET, rotation_at
from lerobot_excav.envs.soil.tool import Tool, ToolGeometry
from lerobot_excav.errors import ConfigurationError

TRIANGLE = np.array([(1.0, 0.0), (0.5, 0.5), (0.0, 0.0)])


def tool(**changes):
    values: dict[str, object] = {
        "geometry": BUCKET,
        "position_w": np.zeros(3),
        "rotation_w": np.eye(3),
        "linear_velocity_w": np.zeros(3),
        "angular_velocity_w": np.zeros(3),
    }
    return Tool(**(values | changes))


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
    ("profile", "message"),
    [
        (TRIANGLE[:2], r"shape \(2, 2\)"),
        (TRIANGLE[::-1], "not convex and counter-clockwise"),
        (np.array([(1.0, 0.0), (0.5, 0.1), (0.4, 0.5), (0.0, 0.0)]), "not convex"),
        (np.array([(1.0, 0.0), (0.5, 0.5), (0.0, -0.1)]), "z_t < 0"),
        (np.array([(1.0, 0.0), (0.5, np.nan), (0.0, 0.0)]), "not finite"),
        (np.array([(1.0, 0.0), (1.0, 0.0), (0.5, 0.5), (0.0, 0.0)]), "lists the same point twice"),
        (np.array([(1.0, 0.0), (0.5, 0.5), (0.0, 0.0), (1.0, 0.0)]), "lists the same point twice"),
        (np.array([(1.0, 0.0), (0.5, 0.0), (0.0, 0.0)]), "holds no volume"),
    ],
)
def test_a_bad_profile_is_refused(profile, message):
    with pytest.raises(ConfigurationError, match=message):
        ToolGeometry(profile_t=profile, inner_width_m=1.0)


@pytest.mark.parametrize("width", [0.0, np.nan, np.inf])
def test_a_bad_width_is_refused(width):
    with pytest.raises(ConfigurationError, match="inner_width_m"):
        ToolGeometry(profile_t=TRIANGLE, inner_width_m=width)


def test_a_geometry_knows_its_shape_and_no_other():
    geometry = ToolGeometry(profile_t=TRIANGLE, inner_width_m=1.0)
    assert geometry.has_shape_of(ToolGeometry(profile_t=TRIANGLE, inner_width_m=1.0))
    assert not geometry.has_shape_of(ToolGeometry(profile_t=TRIANGLE, inner_width_m=2.0))
    assert not geometry.has_shape_of(ToolGeometry(profile_t=2 * TRIANGLE, inner_width_m=1.0))
    assert not geometry.has_shape_of(BUCKET)


def test_a_bad_pose_is_refused():
    with pytest.raises(ConfigurationError, match="position_w has shape"):
        tool(position_w=np.zeros(2))
    with pytest.raises(ConfigurationError, match=r"linear_velocity_w=.* is not finite"):
        tool(linear_velocity_w=np.array([np.inf, 0, 0]))
    with pytest.raises(ConfigurationError, match="off orthonormal"):
        tool(rotation_w=2 * np.eye(3))
    with pytest.raises(ConfigurationError, match="is a reflection"):
        tool(rotation_w=np.diag([1.0, 1.0, -1.0]))


@pytest.mark.parametrize("pitch", [-3.0, -1.5, 0.0, 0.4, 3.0])
def test_pitch_is_read_from_the_rotation(pitch):
    assert tool(rotation_w=rotation_at(pitch)).pitch_rad == pytest.approx(pitch)


def test_a_tool_keeps_its_own_copy_of_the_pose():
    position = np.zeros(3)
    made = tool(position_w=position)
    position[0] = 1.0
    assert made.position_w[0] == 0.0
