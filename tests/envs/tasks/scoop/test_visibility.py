import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.cameras import MAIN
from lerobot_excav.envs.machines.pinhole import CameraPose
from lerobot_excav.envs.tasks.scoop.visibility import hidden_cells, seen_area_px

CELL_M = 0.05
AXIS_W = CELL_M * (np.arange(60) - 29.5)
PICTURE_PX = 96
FROM_THE_SIDE = CameraPose(position=(10.0, 0.0, 5.0), target=(0.0, 0.0, 0.0), fovy_deg=46.0)


def seen_px(heights_m, pose=MAIN):
    return seen_area_px(heights_m, AXIS_W, AXIS_W, pose, picture_height_px=PICTURE_PX)


def hidden_finely(heights_m, eye_w, *, points=4000):
    """Tell the same as `hidden_cells` by very many points on every line of sight, in plain NumPy."""
    hidden = np.zeros(heights_m.shape, dtype=bool)
    for index in np.ndindex(heights_m.shape):
        foot_w = np.array([AXIS_W[index[0]], AXIS_W[index[1]], heights_m[index]])
        share = np.linspace(0.0, 1.0, points)[1:, None]
        line_w = foot_w + share * (eye_w - foot_w)
        line_w = line_w[np.hypot(*(line_w - foot_w)[:, :2].T) >= CELL_M]
        u = (line_w[:, :2] - AXIS_W[0]) / CELL_M
        inside = ((u >= 0.0) & (u < AXIS_W.size - 1)).all(axis=1)
        (i, j), (du, dv) = u[inside].astype(int).T, (u[inside] % 1.0).T
        near = heights_m[i, j] * (1 - du) + heights_m[i + 1, j] * du
        far = heights_m[i, j + 1] * (1 - du) + heights_m[i + 1, j + 1] * du
        hidden[index] = np.any(near * (1 - dv) + far * dv > line_w[inside, 2])
    return hidden


def test_level_ground_fills_what_its_corners_enclose_in_pixels_of_any_size():
    heights_m = np.full((60, 60), 0.4)
    corners_w = np.array([(x, y, 0.4) for x, y in ((-1.5, -1.5), (1.5, -1.5), (1.5, 1.5), (-1.5, 1.5))])
    local = (corners_w - MAIN.position) @ MAIN.axes
    focal_px = 0.5 * PICTURE_PX / np.tan(0.5 * np.radians(MAIN.fovy_deg))
    column, row = (focal_px * local[:, :2] / local[:, 2:]).T
    enclosed_px = 0.5 * abs(np.dot(column, np.roll(row, 1)) - np.dot(row, np.roll(column, 1)))
    assert seen_px(heights_m).sum() == pytest.approx(enclosed_px, rel=0.01)
    large = seen_area_px(heights_m, AXIS_W, AXIS_W, MAIN, picture_height_px=2 * PICTURE_PX)
    np.testing.assert_allclose(large, 4.0 * seen_px(heights_m))


def test_a_slope_that_falls_more_steeply_than_the_line_of_sight_is_not_seen():
    slope = np.broadcast_to(0.6 * (1.5 - AXIS_W)[:, None], (60, 60))
    assert (seen_px(slope, FROM_THE_SIDE) > 0.0).all()
    assert (seen_px(slope[::-1], FROM_THE_SIDE) == 0.0).all()


def test_a_wall_hides_its_shadow_and_nothing_more():
    heights_m = np.zeros((60, 60))
    heights_m[45] = 0.5
    eye_w = np.asarray(FROM_THE_SIDE.position)
    # Similar triangles: the line of sight over the wall's top reaches the ground this far behind it.
    shadow_m = 0.5 * (eye_w[0] - AXIS_W[45]) / (eye_w[2] - 0.5)
    hidden = hidden_cells(heights_m, AXIS_W[0], AXIS_W[0], CELL_M, eye_w)
    assert hidden[:45, 30].sum() * CELL_M == pytest.approx(shadow_m, abs=1.5 * CELL_M)
    assert not hidden[45:].any()


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)])
def test_lines_of_sight_agree_with_very_many_points_on_them(seed):
    rng = np.random.default_rng(seed)
    bumps = rng.uniform(-1.3, 1.3, (6, 2))
    distance = np.hypot(AXIS_W[:, None, None] - bumps[:, 0], AXIS_W[None, :, None] - bumps[:, 1])
    heights_m = np.maximum(0.0, rng.uniform(0.4, 1.2, 6) - rng.uniform(0.5, 2.0, 6) * distance).max(axis=2)
    eye_w = np.asarray(MAIN.position)
    hidden = hidden_cells(heights_m, AXIS_W[0], AXIS_W[0], CELL_M, eye_w)
    finely = hidden_finely(heights_m, eye_w)
    assert 0.01 < finely.mean() < 0.9
    # Steps of half a cell can pass over the crest of a cone.
    assert np.mean(hidden != finely) < 0.01
