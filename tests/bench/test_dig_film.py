from itertools import pairwise

import av
import numpy as np
import pytest

from bench import dig_film
from bench.dig_film import FRAMES_PER_SECOND, ticks_per_picture, write_video


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
    assert [file.name for file in path.parent.iterdir()] == ["dig.mp4"]
    assert 8.0 < len(images) / FRAMES_PER_SECOND < 30.0
    changes = [np.abs(a.astype(int) - b).mean() for a, b in pairwise(images)]
    assert np.mean(np.array(changes) > 0.05) > 0.8


def test_a_film_that_was_interrupted_does_not_pass_for_a_whole_one(tmp_path, monkeypatch):
    def pictures(height, width):
        yield np.zeros((height, width, 3), dtype=np.uint8)
        raise KeyboardInterrupt

    monkeypatch.setattr(dig_film, "_pictures", pictures)
    with pytest.raises(KeyboardInterrupt):
        write_video(tmp_path / "dig.mp4", height=96, width=128)
    assert not (tmp_path / "dig.mp4").exists()
