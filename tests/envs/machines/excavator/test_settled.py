import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.machines.excavator.settled import settled_grains
from lerobot_excav.envs.soil import Container, Soil

TURNED = Container(center_w=[-3.7, 4.7, 0.2], half_extent_m=[1.0, 0.8], wall_height_m=1.0, yaw_rad=0.4)


@pytest.fixture
def soil():
    soil = Soil(container=TARGET_BOX)
    soil.reset(np.full(soil.heights_m.shape, 0.3))
    return soil


def raised(soil, by_m, *, i=30, j=70):
    """The start from which one column has been raised to what it is now."""
    start = soil.heights_m.copy()
    start[i, j] -= by_m
    return start


def test_there_are_none_where_nothing_has_come_to_rest(soil):
    assert len(settled_grains(soil, soil.heights_m, TARGET_BOX).radii_m) == 0
    assert len(settled_grains(soil, soil.heights_m + 0.1, TARGET_BOX).radii_m) == 0


def test_they_lie_on_the_column_that_was_raised_and_grow_with_it(soil):
    sizes = []
    for by_m in np.linspace(0.0, 0.1, 41):
        grains = settled_grains(soil, raised(soil, by_m), TARGET_BOX)
        sizes.append(grains.radii_m.sum())
        if len(grains.radii_m):
            assert grains.positions_w[0, :2] == pytest.approx([soil.x_w[30], soil.y_w[70]])
            assert 0.27 < grains.positions_w[0, 2] < 0.3
    assert np.diff(sizes).min() >= 0.0
    assert max(sizes) > 0.02
    assert np.diff(sizes).max() < 0.2 * max(sizes)  # none pops up


def test_those_in_a_turned_box_lie_in_their_columns():
    soil = Soil(container=TURNED)
    place_w = TURNED.center_w + np.append(np.array([0.62, -0.44]) @ TURNED.axes_w, 0.3)
    soil.add_parcels([place_w], [np.zeros(3)])
    for _ in range(150):
        soil.step()
    assert soil.box_mass_kg > 0.0
    grains = settled_grains(soil, soil.heights_m, TURNED)
    middle_w = np.average(grains.positions_w, axis=0, weights=grains.radii_m)
    assert middle_w[:2] == pytest.approx(place_w[:2], abs=0.15)
    assert 0.2 < middle_w[2] < 0.4


def test_a_column_keeps_its_shape_when_others_come_and_go(soil):
    one = settled_grains(soil, raised(soil, 0.1), TARGET_BOX)
    two = settled_grains(soil, np.minimum(raised(soil, 0.1), raised(soil, 0.1, i=4)), TARGET_BOX)
    assert one.columns[0] in two.columns
    assert len(two.columns) == 2
