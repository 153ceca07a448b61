import mujoco
import numpy as np
import pytest

from lerobot_excav.envs.machines.camera_pictures import CameraPictures, visible_groups
from lerobot_excav.errors import ConfigurationError, RenderingError

HEIGHT, WIDTH = 40, 60
FLOOR, BOX = 0, 1

# A camera 2 m above a floor looks down on a box of 0.4 m edge that stands on it.
MODEL = mujoco.MjModel.from_xml_string("""
<mujoco>
  <statistic extent="1"/>
  <visual><map znear="0.1" zfar="10"/><quality offsamples="0"/></visual>
  <worldbody>
    <light pos="0 0 3"/>
    <geom type="plane" size="5 5 0.1" group="0" rgba="0 0 1 1"/>
    <geom type="box" size="0.2 0.2 0.2" pos="0 0 0.2" group="1" rgba="1 0 0 1"/>
    <camera name="above" pos="0 0 2" fovy="60"/>
    <camera name="aside" pos="2 0 1" xyaxes="0 1 0 -0.45 0 0.9"/>
  </worldbody>
</mujoco>
""")
EVERYTHING = visible_groups(0, 1)
FLOOR_ONLY = visible_groups(0)


@pytest.fixture
def pictures():
    data = mujoco.MjData(MODEL)
    mujoco.mj_forward(MODEL, data)
    pictures = CameraPictures(MODEL, data, cameras=("above", "aside"), height=HEIGHT, width=WIDTH, max_geoms=10)
    yield pictures
    pictures.close()


def test_colours_are_those_of_the_things_in_view(pictures):
    picture = pictures.colour("above", EVERYTHING)
    assert (picture.shape, picture.dtype) == ((HEIGHT, WIDTH, 3), np.uint8)
    assert picture[HEIGHT // 2, WIDTH // 2].argmax() == 0
    assert picture[0, 0].argmax() == 2


def test_hidden_groups_are_looked_through(pictures):
    assert pictures.colour("above", FLOOR_ONLY)[HEIGHT // 2, WIDTH // 2].argmax() == 2
    assert set(np.unique(pictures.geoms("above", FLOOR_ONLY))) == {FLOOR}


def test_distance_is_measured_along_the_optical_axis(pictures):
    distance_m = pictures.distance_m("above", EVERYTHING)
    on_box = pictures.geoms("above", EVERYTHING) == BOX
    assert distance_m[on_box].min() == pytest.approx(1.6, abs=1e-3)
    # Everywhere the same on a level floor, though the corners of the picture are farther from the lens.
    assert distance_m[~on_box] == pytest.approx(2.0, abs=1e-3)


def test_points_are_where_the_pixels_look(pictures):
    points_w = pictures.points_w("above", FLOOR_ONLY)
    assert points_w[..., 2] == pytest.approx(0.0, abs=2e-3)
    px_m = 2.0 * np.tan(np.radians(30.0)) / (HEIGHT / 2)
    assert points_w[0, 0, :2] == pytest.approx([(0.5 - WIDTH / 2) * px_m, (HEIGHT / 2 - 0.5) * px_m], abs=1e-3)


def test_every_pixel_of_a_geom_lies_on_it(pictures):
    points_w = pictures.points_w("aside", EVERYTHING)
    geoms = pictures.geoms("aside", EVERYTHING)
    on_box = geoms == BOX
    assert 50 < on_box.sum() < 0.5 * on_box.size
    assert (np.abs(points_w[on_box] - [0.0, 0.0, 0.2]).max(axis=-1) < 0.205).all()
    assert points_w[geoms == FLOOR][:, 2] == pytest.approx(0.0, abs=5e-3)
    assert np.isin(geoms, [FLOOR, BOX, -1]).all()


def test_pictures_are_copies_and_naming_geoms_leaves_colours_as_they_were(pictures):
    first = pictures.colour("above", EVERYTHING)
    kept = first.copy()
    pictures.geoms("aside", EVERYTHING)
    np.testing.assert_array_equal(first, kept)
    np.testing.assert_array_equal(pictures.colour("above", EVERYTHING), kept)


def test_context_is_made_with_the_first_picture_and_freed_by_close(pictures):
    assert pictures._context is None
    pictures.colour("above", EVERYTHING)
    assert pictures._context is not None
    pictures.close()
    pictures.close()
    assert pictures._context is None
    for take in (pictures.colour, pictures.distance_m, pictures.geoms):
        with pytest.raises(RenderingError, match="closed"):
            take("above", EVERYTHING)


def test_an_unknown_camera_and_a_picture_without_pixels_are_refused(pictures):
    with pytest.raises(ConfigurationError, match=r"camera='below'.*'above', 'aside'"):
        pictures.colour("below", EVERYTHING)
    with pytest.raises(ConfigurationError, match="height=0"):
        CameraPictures(MODEL, mujoco.MjData(MODEL), cameras=("above",), height=0, width=8, max_geoms=10)
