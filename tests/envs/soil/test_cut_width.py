"""How much a bucket cuts: what it sweeps, at any width and azimuth. No column lies as the bucket does."""

import dataclasses
import math

import numpy as np
import pytest

from bench.soil import BUCKET, rotation_at
from lerobot_excav.envs.soil.bucket import Bucket
from lerobot_excav.envs.soil.fidelity import FIDELITIES
from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.parameters import PRESETS
from lerobot_excav.envs.soil.tool import Tool

DEPTH, STEP, START, END = 0.15, 0.01, 0.6, 2.4


def cut_width(width_m, azimuth_deg, cell_m=0.05, offset_m=0.0):
    """Drag a bucket through level ground; return volume cut over depth and way: the width of the cut [m]."""
    geometry = dataclasses.replace(BUCKET, inner_width_m=width_m)
    cells = round(6.0 / cell_m)
    field = HeightField((cells, cells), (cell_m, cell_m), 0.0)
    field.reset(np.full((cells, cells), 0.8))
    bucket = Bucket(PRESETS["sand"], FIDELITIES["standard"])
    cos, sin = math.cos(math.radians(azimuth_deg)), math.sin(math.radians(azimuth_deg))
    turned = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    rotation, entered = turned @ rotation_at(math.radians(-105.0)), 0.0
    for k in range(round(END / STEP) + 1):
        edge = turned @ np.array([0.5 * END - STEP * k, offset_m, 0.0]) + [0.0, 0.0, 0.8 - DEPTH]
        pin = edge - rotation @ np.array([1.15, 0.0, 0.0])
        tool = Tool(
            geometry=geometry,
            position_w=pin,
            rotation_w=rotation,
            linear_velocity_w=np.zeros(3),
            angular_velocity_w=np.zeros(3),
        )
        volume, _ = bucket.move(tool, field, 0.0, 0.0)
        bucket.births(all_of_it=True, rng=np.random.default_rng(0))  # never full
        entered += volume if STEP * k > START else 0.0
    return entered / DEPTH / (END - START)


@pytest.mark.parametrize("azimuth_deg", [0.0, 17.0, 45.0, 60.0, 90.0])
def test_a_bucket_cuts_as_wide_as_it_is(azimuth_deg):
    widths = np.array([0.36, 0.40, 0.50, 0.72])
    cuts = np.array([cut_width(width, azimuth_deg, offset_m=0.013) for width in widths])
    assert cuts / widths == pytest.approx(np.full(4, 0.975), abs=0.035)
    assert cuts / widths == pytest.approx(np.full(4, (cuts / widths).mean()), rel=0.02)


@pytest.mark.parametrize("cell_m", [0.04, 0.08, 0.1])
def test_the_width_of_a_cut_is_that_of_no_whole_number_of_columns(cell_m):
    assert cut_width(0.53, 23.0, cell_m) == pytest.approx(0.53, rel=0.06)
