import numpy as np
import pytest

from lerobot_excav.envs.masks.oracle import OracleSource
from lerobot_excav.envs.masks.source import make_mask_source, mask_source_names, register_mask_source
from lerobot_excav.errors import ConfigurationError


def test_the_oracle_is_known():
    assert "oracle" in mask_source_names()
    assert isinstance(make_mask_source("oracle"), OracleSource)


def test_an_unknown_source_is_named_with_the_known_ones():
    with pytest.raises(ConfigurationError, match="mask_source='crystal ball' is not known; allowed: 'oracle'"):
        make_mask_source("crystal ball")


def test_a_name_belongs_to_one_source():
    register_mask_source("oracle", OracleSource)
    with pytest.raises(ConfigurationError, match="'oracle' exists"):
        register_mask_source("oracle", object)


def test_a_camera_sees_the_points_that_it_projects():
    from lerobot_excav.envs.machines.pinhole import CameraPose, PinholeCamera

    pose = CameraPose((0.0, 0.0, 2.0), (0.5, 1.0, 0.0), 60.0)
    camera = PinholeCamera(
        position_w=np.array(pose.position), axes_w=pose.axes, fovy_rad=np.radians(60.0), height=30, width=40
    )
    depth = np.full((30, 40), 3.0)
    points_w = camera.points_w(depth)
    in_camera = (points_w - pose.position) @ pose.axes
    assert np.allclose(in_camera[..., 2], -3.0)
    # The edge of the picture lies at half the field of view, half a pixel inside.
    assert np.isclose(in_camera[0, 0, 1] / 3.0, np.tan(np.radians(30.0)) * 29 / 30)
    assert in_camera[0, 0, 0] < 0 < in_camera[0, -1, 0]
