import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.appearance import draw_appearance

COLOURS = ("soil_rgb", "machine_rgb", "ground_rgb", "box_rgb")
LOOKS = [draw_appearance(np.random.default_rng(seed)) for seed in range(20)]


def test_a_generator_draws_the_same_look_and_others_differ_in_every_field():
    assert draw_appearance(np.random.default_rng(5)) == LOOKS[5]
    for field in (*COLOURS, "light_dir_w", "light_intensity"):
        assert len({getattr(look, field) for look in LOOKS}) == 20


@pytest.mark.parametrize("look", LOOKS)
def test_every_look_can_be_drawn_and_machine_and_box_keep_their_colours(look):
    assert all(0.0 <= channel <= 1.0 for field in COLOURS for channel in getattr(look, field))
    assert np.linalg.norm(look.light_dir_w) == pytest.approx(1.0)
    assert look.light_dir_w[2] < -0.5  # the sun stands above the horizon
    assert 0.0 < look.light_intensity <= 1.0
    assert look.machine_rgb[0] > look.machine_rgb[1] > look.machine_rgb[2]
    assert look.box_rgb[2] > look.box_rgb[0]
