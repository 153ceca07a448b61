"""The ages of what was seen, as columns of a recording."""

import json

import numpy as np
import pytest

from lerobot_excav.datasets.alignment.aligned_copy import write_aligned_copy
from lerobot_excav.datasets.format.alignment_columns import ALIGNMENT_COLUMNS
from lerobot_excav.errors import DatasetError
from lerobot_excav.robots.excavator_testbed.alignment import Ages, AlignmentLog
from lerobot_excav.scripts.main import main

from ..toy import load, record_toy


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    root = tmp_path_factory.mktemp("driven") / "data"
    record_toy(root, scenes=1, targets=2)
    return root


def lengths_of(root):
    return [int(length) for length in load(root).meta.episodes["length"]]


def write_log(path, lengths, *, late=(), other=(), blind=()):
    """Write the log of a recording by the robot's own writer; the last episode was recorded twice."""
    log = AlignmentLog(path)
    log.start()
    for episode, length in [*enumerate(lengths), (len(lengths) - 1, lengths[-1])]:
        log.begin(episode)
        for frame in range(length):
            key = (episode, frame)
            ages = Ages(image_ms=None if key in blind else 130.0 if key in late else 80.0 + frame, state_ms=9.0)
            log.note(ages, "NONE", is_as_told=key not in other)
        log.end()
    log.close()
    return path


def column(root, name):
    return np.array([frame[name] for frame in load(root)]).ravel()


def test_every_frame_says_how_old_what_it_saw_was(recording, tmp_path):
    log = write_log(tmp_path / "log.jsonl", lengths_of(recording), late=[(1, 3)], other=[(0, 2)], blind=[(0, 0)])
    counts = write_aligned_copy(recording, tmp_path / "out", log=log)
    first, second = lengths_of(recording)
    assert (counts.frames, counts.late_frames, counts.late_episodes, counts.other_frames) == (
        first + second,
        1,
        (1,),
        1,
    )
    assert (counts.worst_image_ms, counts.worst_state_ms) == (130.0, 9.0)
    ages = column(tmp_path / "out", "excav.image_age_ms")
    assert ages[[0, 1, first + 3]].tolist() == [-1.0, 81.0, 130.0]
    assert np.flatnonzero(~column(tmp_path / "out", "excav.is_causal")).tolist() == [first + 3]
    assert np.flatnonzero(~column(tmp_path / "out", "excav.is_as_told")).tolist() == [2]


@pytest.mark.slow
def test_all_else_stays_as_it_is(recording, tmp_path):
    write_aligned_copy(recording, tmp_path / "out", log=write_log(tmp_path / "log.jsonl", lengths_of(recording)))
    for ours, theirs in zip(load(tmp_path / "out"), load(recording), strict=True):
        assert set(ours) == set(theirs) | set(ALIGNMENT_COLUMNS)
        assert all(np.array_equal(ours[name], value) for name, value in theirs.items())


def told(capsys, *arguments):
    """Return the exit code of the command, and what it prints."""
    code = main(["alignment", *map(str, arguments)])
    return code, capsys.readouterr().out


@pytest.mark.slow
def test_the_command_counts_and_its_exit_code_tells(recording, tmp_path, capsys):
    lengths = lengths_of(recording)
    sound = write_log(tmp_path / "sound.jsonl", lengths)
    code, out = told(capsys, recording, f"--log={sound}", f"--out={tmp_path / 'a'}")
    assert code == 0
    assert out.startswith(f"0 of {sum(lengths)} frames (0.0%) saw something too old")
    late = write_log(tmp_path / "late.jsonl", lengths, late=[(1, 0)])
    code, out = told(capsys, recording, f"--log={late}", f"--out={tmp_path / 'b'}")
    assert code == 1
    assert "oldest picture 130 ms, of 120 ms allowed\n" in out
    assert "in episodes 1\n" in out
    other = write_log(tmp_path / "other.jsonl", lengths, other=[(0, 1)])
    code, out = told(capsys, recording, f"--log={other}", f"--out={tmp_path / 'c'}")
    assert code == 1
    assert f"1 of {sum(lengths)} frames: the machine did something else" in out
    every_frame = [(episode, frame) for episode, length in enumerate(lengths) for frame in range(length)]
    blind = write_log(tmp_path / "blind.jsonl", lengths, blind=every_frame)
    code, out = told(capsys, recording, f"--log={blind}", f"--out={tmp_path / 'd'}")
    assert code == 0
    assert "oldest picture of unknown age" in out


@pytest.mark.slow
@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda lines: lines[:-1], "frames of episode 1, and"),
        (lambda lines: [*lines, frame_line(7, 0)], "tells of 1 frames of episode 7"),
        (lambda lines: [*lines, lines[-1].replace('"frame_index": ', '"frame_index": 9')], "is not a frame"),
        (lambda lines: [json.dumps({"excavator_testbed": "alignment", "image_limit_ms": 99}), *lines[1:]], "limits"),
        (lambda lines: [lines[0], lines[1].replace("frame_index", "frame"), *lines[2:]], "line 2: is not a frame"),
        (lambda lines: [*lines[:3], "[1]", *lines[3:]], "line 4: is not a frame"),
        (lambda lines: [*lines[:3], lines[3].replace(",", ";"), *lines[4:]], "line 4: .* damaged"),
        (lambda lines: ["{}", *lines[1:]], "is not an alignment log"),
        (lambda _: [], "is not an alignment log"),
    ],
)
def test_the_log_of_something_else_is_refused_and_nothing_is_written(recording, tmp_path, damage, said):
    path = write_log(tmp_path / "log.jsonl", lengths_of(recording))
    lines = damage(path.read_text().splitlines()[: sum(lengths_of(recording)) + 1])
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(DatasetError, match=said):
        write_aligned_copy(recording, tmp_path / "out", log=path)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["log.jsonl"]


def frame_line(episode, frame):
    return json.dumps({
        **{"episode_index": episode, "frame_index": frame, "image_age_ms": 1.0, "state_age_ms": 1.0},
        **{"is_causal": True, "is_as_told": True},
    })  # fmt: skip


@pytest.mark.slow
def test_an_episode_that_was_recorded_again_and_is_shorter_counts_as_it_was_the_last_time(recording, tmp_path):
    lengths = lengths_of(recording)
    path = write_log(tmp_path / "log.jsonl", [lengths[0] + 5, lengths[1]])
    again = write_log(tmp_path / "again.jsonl", lengths, late=[(0, 1)]).read_text().splitlines()[1:]
    path.write_text(path.read_text() + "\n".join(again) + "\n")
    assert write_aligned_copy(recording, tmp_path / "out", log=path).late_frames == 1


@pytest.mark.slow
def test_an_episode_that_was_begun_and_thrown_away_at_the_end_is_no_fault(recording, tmp_path):
    path = write_log(tmp_path / "log.jsonl", lengths_of(recording))
    path.write_text(path.read_text() + frame_line(2, 0) + "\n")
    assert write_aligned_copy(recording, tmp_path / "out", log=path).late_frames == 0


@pytest.mark.slow
def test_a_line_that_a_crash_cut_off_is_passed_over(recording, tmp_path):
    path = write_log(tmp_path / "log.jsonl", lengths_of(recording))
    path.write_text(path.read_text() + '{"episode_index": 1, "fra')
    assert write_aligned_copy(recording, tmp_path / "out", log=path).late_frames == 0


def test_a_folder_that_exists_no_dataset_and_columns_that_are_there_are_refused(recording, tmp_path):
    log = write_log(tmp_path / "log.jsonl", lengths_of(recording))
    write_aligned_copy(recording, tmp_path / "out", log=log)
    with pytest.raises(DatasetError, match="exists"):
        write_aligned_copy(recording, tmp_path / "out", log=log)
    with pytest.raises(DatasetError, match="give the folder of a dataset"):
        write_aligned_copy(tmp_path, tmp_path / "again", log=log)
    with pytest.raises(DatasetError, match=r"excav\.image_age_ms, .* already"):
        write_aligned_copy(tmp_path / "out", tmp_path / "again", log=log)
