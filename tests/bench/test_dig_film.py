from itertools import pairwise

import numpy as np
import pytest

from bench import dig_film
from bench.dig_film import ticks_per_picture
from lerobot_excav.envs.constants import TICKS_PER_SECOND


@pytest.mark.parametrize(
    ("phase", "payload_kg", "airborne_kg", "is_slow"),
    [
        ("reach", 0.0, 0.0, False),
        ("cut", 0.0, 0.0, False),
        ("cut", 30.0, 0.0, True),
        ("curl", 400.0, 0.0, True),
        ("carry", 400.0, 0.0, False),
        ("dump", 400.0, 0.0, False),
        ("dump", 300.0, 100.0, True),
        ("rest", 0.0, 50.0, True),
        ("rest", 0.0, 0.0, False),
    ],
)
def test_the_film_is_slow_while_soil_moves(phase, payload_kg, airborne_kg, is_slow):
    ticks = ticks_per_picture(phase, payload_kg=payload_kg, airborne_kg=airborne_kg)
    assert (ticks == 1) is is_slow


@pytest.mark.slow
def test_the_film_shows_a_whole_cycle(monkeypatch):
    ticks = 25  # fewer pictures than the film has: drawing them takes minutes
    monkeypatch.setattr(dig_film, "ticks_per_picture", lambda *_, **__: ticks)
    images = list(dig_film.pictures(height=96, width=128))
    assert images[0].shape == (96, 128, 3)
    assert 8.0 < len(images) * ticks / TICKS_PER_SECOND < 30.0
    changes = [np.abs(a.astype(int) - b).mean() for a, b in pairwise(images)]
    assert np.mean(np.array(changes) > 0.05) > 0.8
