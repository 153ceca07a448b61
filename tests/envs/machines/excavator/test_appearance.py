import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.appearance import Appearance, draw_appearance

COLOURS = ("soil_rgb", "machine_rgb", "ground_rgb", "box_rgb")


def test_same_generator_draws_the_same_look():
    assert draw_appearance(np.random.default_rng(5)) == draw_appearance(np.random.default_rng(5))


def test_looks_differ_between_scenes_in_every_field():
    looks = [draw_appearance(np.random.default_rng(seed)) for seed in range(20)]
    for field in (*COLOURS, "light_dir_w", "light_intensity"):
        assert len({getattr(look, field) for look in looks}) == 20


@pytest.mark.parametrize("seed", range(20))
def test_every_look_can_be_drawn(seed):
    look = draw_appearance(np.random.default_rng(seed))
    for field in COLOURS:
        assert all(0.0 <= channel <= 1.0 for channel in getattr(look, field))
    assert np.linalg.norm(look.light_dir_w) == pytest.approx(1.0)
    assert look.light_dir_w[2] < -0.5  # the sun stands above the horizon
    assert 0.0 < look.light_intensity <= 1.0


def test_machine_stays_yellow_and_box_blue():
    for seed in range(20):
        look = draw_appearance(np.random.default_rng(seed))
        assert look.machine_rgb[0] > look.machine_rgb[1] > look.machine_rgb[2]
        assert look.box_rgb[2] > look.box_rgb[0]
    assert Appearance() == Appearance()
