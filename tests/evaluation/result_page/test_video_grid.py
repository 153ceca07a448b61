import pytest

from lerobot_excav.evaluation.result_page import video_grid
from lerobot_excav.evaluation.result_page.video_grid import Clip, GridRow
from lerobot_excav.evaluation.result_page.words import STRIP_HEIGHT
from lerobot_excav.evaluation.video import read_video

from .conftest import write_clip

TALL = 192 + 2 * STRIP_HEIGHT  # words above and below a tile


@pytest.fixture
def clip(tmp_path, make_run, grasp_line):
    def make(name, *, outcome=None, frames=20, rate=50, **size):
        path = tmp_path / f"{name}.mp4"
        write_clip(path, frames=frames, rate=rate, **size)
        (episode,) = make_run(name, [grasp_line(0, **(outcome or {}))]).episodes
        return Clip(path=path, episode=episode)

    return make


def write_rows(path, rows):
    video_grid.write_grid(path, [GridRow(about=f"row {number}", clips=row) for number, row in enumerate(rows)])


def test_clips_stand_in_rows_at_half_their_rate(clip, tmp_path):
    path = tmp_path / "new" / "grid.mp4"
    write_rows(path, [[clip("a"), clip("b")], [clip("c", frames=10)]])
    pictures = list(read_video(path))
    assert len(pictures) == 10  # 20 frames at 50 per second
    assert pictures[0].shape == (2 * TALL, 2 * 256, 3)
    assert not list(path.parent.glob("*.partial"))
    assert pictures[0][TALL + 100, 400].max() < 10  # no clip here


@pytest.mark.parametrize("rate", [10, 25, 30, 50])
def test_clips_of_any_rate_are_shown_in_real_time(clip, tmp_path, rate):
    write_rows(tmp_path / "grid.mp4", [[clip("a", frames=rate, rate=rate)]])
    pictures = list(read_video(tmp_path / "grid.mp4"))
    assert len(pictures) == 25
    # The clip brightens by 5 a frame.
    seconds = [picture[STRIP_HEIGHT + 96, 128].mean() / 5 / rate for picture in pictures]
    assert seconds == pytest.approx([tick / 25 for tick in range(25)], abs=1.5 / rate)


def test_the_border_tells_success_and_obedience_to_a_wrong_mask(clip, tmp_path):
    failure = {"is_success": False, "mask_condition": "mismatched", "shown_target_id": 2}
    obeyed, ignored = ({**failure, "first_grasped_block": block} for block in (2, 1))
    dropped = {"is_success": False, "first_grasped_block": 0}
    outcomes = {"a": {}, "b": obeyed, "c": ignored, "d": dropped}
    write_rows(tmp_path / "grid.mp4", [[clip(name, outcome=outcome) for name, outcome in outcomes.items()]])
    picture = next(read_video(tmp_path / "grid.mp4")).astype(int)
    colours = [video_grid.SUCCESS_RGB, video_grid.OBEYED_RGB, video_grid.FAILURE_RGB, video_grid.FAILURE_RGB]
    for number, colour in enumerate(colours):
        assert picture[STRIP_HEIGHT + 100, 256 * number + 1] == pytest.approx(colour, abs=25)


@pytest.mark.parametrize(("height", "width"), [(24, 32), (96, 128), (480, 640), (270, 480)])
def test_clips_of_any_size_become_tiles_of_one_height(clip, tmp_path, height, width):
    write_rows(tmp_path / "grid.mp4", [[clip("a", height=height, width=width)]])
    shape = next(read_video(tmp_path / "grid.mp4")).shape
    assert shape[0] == TALL
    assert shape[1] == pytest.approx(192 * width / height, abs=1.01)


def test_a_grid_that_weighs_too_much_becomes_coarser(clip, tmp_path, monkeypatch, caplog):
    tried = []
    write = video_grid.write_video
    monkeypatch.setattr(video_grid, "write_video", lambda *a, crf: (tried.append(crf), write(*a, crf=crf)))
    monkeypatch.setattr(video_grid, "MAX_BYTES", 10)
    write_rows(tmp_path / "grid.mp4", [[clip("a")]])
    assert tried == list(video_grid._QUALITIES)
    assert "bytes, more than 10; show fewer clips, or shorter ones" in caplog.text


def test_words_name_the_row_and_say_how_each_episode_ended(clip, tmp_path, monkeypatch):
    said = []
    strip = video_grid.strip
    monkeypatch.setattr(
        video_grid, "strip", lambda words, *args, **more: said.append(words) or strip(words, *args, **more)
    )
    wrong = {"is_success": False, "mask_condition": "mismatched", "shown_target_id": 2, "first_grasped_block": 2}
    write_rows(
        tmp_path / "grid.mp4", [[clip("a"), clip("b", outcome=wrong)], [clip("c", outcome={"is_success": False})]]
    )
    assert said == ["row 0", "success", "did what the wrong mask said", "row 1", "failure"]
    picture = next(read_video(tmp_path / "grid.mp4"))
    bands = (0, STRIP_HEIGHT + 192, TALL, TALL + STRIP_HEIGHT + 192)
    assert all(picture[top : top + STRIP_HEIGHT, :256].max() > 150 for top in bands)
    assert picture[bands[3] : bands[3] + STRIP_HEIGHT, 260:].max() < 30  # there is one tile in this row
