"""Heights from depth, against the height field of the soil."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.envs.machines.excavator.cameras import MAIN
from lerobot_excav.envs.machines.excavator.kinematics import inverse
from lerobot_excav.envs.machines.pinhole import PinholeCamera
from lerobot_excav.envs.tasks.planner.surface import see_surface

SOIL_M = 0.05


def errors_m(surface, worksite):
    """Return the error of every cell and whether there is soil, both (nx, ny)."""
    x_w, y_w = np.meshgrid(surface.x_w, surface.y_w, indexing="ij")
    true_m = worksite.soil.height_at(np.stack([x_w, y_w], axis=-1))
    return surface.heights_m - true_m, true_m > SOIL_M


@pytest.mark.parametrize("scene_id", [0, 1, 2])
def test_heights_are_right_within_millimetres_where_soil_is_seen(see, worksite, scene_id):
    surface = see(scene_id)
    error_m, soil = errors_m(surface, worksite)
    seen = surface.is_seen & soil
    assert np.median(np.abs(error_m[seen])) < 0.003
    assert np.quantile(np.abs(error_m[seen]), 0.95) < 0.015
    assert abs(error_m[seen].mean()) < 0.003
    assert seen.sum() / soil.sum() > 0.9


# Over the box, as after a dump; over the pile; with the bucket on the pile, as after a time-out.
POSES = {
    "over the box": {"radius_m": 4.7, "height_m": 1.6, "pitch_rad": -0.8, "swing_rad": 1.4},
    "over the pile": {"radius_m": 4.8, "height_m": 1.8, "pitch_rad": -2.0, "swing_rad": 0.1},
    "on the pile": {"radius_m": 4.6, "height_m": 0.9, "pitch_rad": -2.3, "swing_rad": 0.0},
}


@pytest.mark.parametrize("pose", POSES.values(), ids=POSES)
def test_the_machine_is_never_taken_for_soil(see, worksite, pose):
    surface = see(1, inverse(**pose))
    error_m, _ = errors_m(surface, worksite)
    error_m = np.where(surface.is_seen, np.abs(error_m), 0.0)
    assert np.quantile(error_m, 0.99) < 0.03
    # Of a bucket that lies on the soil a cell or two may pass.
    assert (error_m > 0.06).sum() <= 3


def test_after_a_dump_the_machine_hides_next_to_nothing_of_the_pile(see, worksite):
    surface = see(1, inverse(**POSES["over the box"]))
    _, soil = errors_m(surface, worksite)
    assert (surface.is_seen & soil).sum() / soil.sum() > 0.9


@given(st.integers(0, 2**32 - 1))
def test_any_depth_gives_a_map_within_the_limits(seed):
    depth_m = np.random.default_rng(seed).uniform(0.1, 50.0, (24, 32))
    axes = MAIN.axes
    camera = PinholeCamera(
        position_w=np.array(MAIN.position), axes_w=axes, fovy_rad=np.radians(MAIN.fovy_deg), height=24, width=32
    )
    surface = see_surface(depth_m, camera)
    assert np.isfinite(surface.heights_m).all()
    assert (surface.heights_m >= 0.0).all()


def test_nothing_seen_is_a_map_without_soil():
    camera = PinholeCamera(
        position_w=np.array(MAIN.position), axes_w=MAIN.axes, fovy_rad=np.radians(46.0), height=24, width=32
    )
    surface = see_surface(np.full((24, 32), 0.5), camera)
    assert not surface.is_seen.any()
    assert not surface.heights_m.any()
