import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.cameras import CAB, MAIN, OVERVIEW
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX

HEIGHT, WIDTH = 96, 128


def project(pose, points_w):
    """Image coordinates (column, row) of world points at the default image size."""
    local = (np.atleast_2d(points_w) - pose.position) @ pose.axes
    focal = 0.5 * HEIGHT / np.tan(0.5 * np.radians(pose.fovy_deg))
    return np.stack([WIDTH / 2 - focal * local[:, 0] / local[:, 2], HEIGHT / 2 + focal * local[:, 1] / local[:, 2]], 1)


def rectangle(half_x, half_y, center=(0.0, 0.0, 0.0), height=0.0):
    return [np.add(center, (x, y, height)) for x in (-half_x, half_x) for y in (-half_y, half_y)]


def on_machine(*points):
    return np.add(points, const.MACHINE_POS_W)


@pytest.mark.parametrize("pose", [MAIN, CAB, OVERVIEW])
def test_camera_axes_are_a_right_handed_frame_that_keeps_up_up(pose):
    rotation = pose.axes
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert rotation[2, 1] > 0
    assert rotation[2, 0] == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("pose", "points_w"),
    [
        pytest.param(MAIN, rectangle(2.1, 2.1), id="main: where a pile can be"),
        pytest.param(MAIN, rectangle(1.0, 1.5, height=1.2), id="main: its top"),
        pytest.param(MAIN, rectangle(0.5, 0.5, TARGET_BOX.center_w), id="main: into the box"),
        pytest.param(MAIN, on_machine((0.4, 0.6, 2.3), (-1.3, -0.9, 0.3), (1.8, 0, 0)), id="main: cab and tracks"),
        pytest.param(OVERVIEW, rectangle(2.1, 2.1), id="overview: where a pile can be"),
        pytest.param(OVERVIEW, rectangle(1.0, 1.5, height=1.2), id="overview: its top"),
        pytest.param(OVERVIEW, rectangle(*TARGET_BOX.half_extent_m, TARGET_BOX.center_w), id="overview: box"),
        pytest.param(OVERVIEW, rectangle(*TARGET_BOX.half_extent_m, TARGET_BOX.center_w, 1.0), id="overview: wall"),
        pytest.param(OVERVIEW, on_machine((-1.5, -1.0, 0.5), (0.5, 2.5, 4.3)), id="overview: raised boom"),
    ],
)
def test_a_camera_sees_what_it_is_for(pose, points_w):
    pixels = project(pose, points_w)
    assert ((pixels >= 0) & (pixels <= [WIDTH, HEIGHT])).all()


def test_cab_sees_the_middle_of_the_box_over_its_wall():
    eye = np.array([*const.MACHINE_POS_W[:2], const.SWING_HEIGHT_M + CAB.position[2]])
    distance = np.hypot(*(TARGET_BOX.center_w[:2] - eye[:2])) - CAB.position[0]
    wall = distance - TARGET_BOX.half_extent_m.min() - const.BOX_WALL_THICKNESS_M
    line_of_sight = eye[2] + (TARGET_BOX.wall_height_m - eye[2]) * distance / wall
    assert line_of_sight < 0.4  # the height of one scoop's heap


@pytest.mark.parametrize("x", [-1.5, 0.0, 1.5])
@pytest.mark.parametrize("y", [-1.5, 0.0, 1.5])
def test_dig_region_is_large_enough_in_the_default_picture(x, y):
    width, height = np.ptp(project(MAIN, rectangle(0.4, 0.4, (x, y, 0.4))), axis=0)
    assert width >= 9.0
    assert height >= 6.0


@pytest.mark.parametrize("x", [-1.6, 0.0, 2.0])
@pytest.mark.parametrize("y", [-2.0, 0.0, 1.8])
def test_main_looks_down_more_steeply_than_a_pile_of_sand_is(x, y):
    to_camera = np.subtract(MAIN.position, (x, y, 0.3))
    assert np.degrees(np.arctan2(to_camera[2], np.hypot(*to_camera[:2]))) > 40.0


def test_overview_reaches_the_horizon():
    assert np.degrees(np.arcsin(OVERVIEW.axes[2, 2])) < 0.5 * OVERVIEW.fovy_deg - 2.0
