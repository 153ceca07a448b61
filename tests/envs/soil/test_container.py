import dataclasses
import math

import numpy as np
import pytest

from lerobot_excav.envs.soil.container import Container
from lerobot_excav.errors import ConfigurationError


def box(x=0.0, y=0.0, yaw=0.0):
    return Container(center_w=np.array([x, y, 0.0]), half_extent_m=np.array([1.0, 0.5]), wall_height_m=1.0, yaw_rad=yaw)


def test_local_axes_turn_with_the_yaw():
    turned = box(2.0, 3.0, yaw=np.pi / 2)
    np.testing.assert_allclose(turned.to_local(np.array([2.0, 4.0])), [1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(turned.to_local(np.array([1.0, 3.0])), [0.0, 1.0], atol=1e-12)


@pytest.mark.parametrize(
    ("placed", "overlaps"),
    [
        (box(), True),
        (box(3.9), True),
        (box(4.1), False),
        (box(3.9, yaw=np.pi / 2), False),
        (box(3.5, 3.5, yaw=-np.pi / 4), False),  # axis-aligned bounds would touch, the corner does not
        (box(3.2, 3.2, yaw=-np.pi / 4), True),
    ],
)
def test_overlap_with_the_dig_area(placed, overlaps):
    assert placed.overlaps((6.0, 6.0)) is overlaps


@pytest.mark.parametrize(
    ("field", "value"),
    [("wall_height_m", bad) for bad in (0.0, math.nan, math.inf)]
    + [("center_w", np.zeros(2)), ("half_extent_m", np.array([1.0, 0.0])), ("yaw_rad", math.nan)],
)
def test_a_box_that_cannot_be_is_refused(field, value):
    with pytest.raises(ConfigurationError, match=field):
        dataclasses.replace(box(), **{field: value})
