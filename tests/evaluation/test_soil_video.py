from itertools import pairwise

import av
import numpy as np
import pytest

from lerobot_excav.evaluation.soil_video import FRAMES_PER_SECOND, ticks_per_picture, write_video


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
def test_the_film_shows_a_whole_cycle(tmp_path):
    path = tmp_path / "new" / "dig.mp4"
    write_video(path, height=96, width=128)
    with av.open(str(path)) as container:
        images = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert images[0].shape == (96, 128, 3)
    assert 8.0 < len(images) / FRAMES_PER_SECOND < 30.0
    changes = [np.abs(a.astype(int) - b).mean() for a, b in pairwise(images)]
    assert np.mean(np.array(changes) > 0.05) > 0.8
