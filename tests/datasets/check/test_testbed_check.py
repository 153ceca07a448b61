"""What is wrong with a recording of a real machine is found, its late frames counted."""

import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from lerobot.datasets.lerobot_dataset import LeRobotDataset

from lerobot_excav.datasets.alignment.aligned_copy import write_aligned_copy
from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES, STATE_NAMES
from lerobot_excav.robots.excavator_testbed.alignment import Ages, AlignmentLog
from lerobot_excav.scripts.main import main

FRAMES, EPISODES = 6, 3


def vector(names):
    return {"dtype": "float32", "shape": (len(names),), "names": list(names)}


PICTURE = {"dtype": "image", "shape": (16, 24, 3), "names": ["height", "width", "channels"]}
FEATURES = {
    "observation.state": vector(STATE_NAMES),
    "action": vector(ACTION_NAMES),
    "observation.images.target_mask": PICTURE,
}


@pytest.fixture
def recording(tmp_path):
    """Record episodes of a machine, and add what its log says; `change` spoils a frame, `ages` its age."""

    def _record(change=lambda episode, frame, values: None, ages=lambda episode, frame: (80.0, 9.0, True)):
        dataset = LeRobotDataset.create("someone/driven", 10, features=FEATURES, root=tmp_path / "data")
        log = AlignmentLog(tmp_path / "log.jsonl")
        log.start()
        for episode in range(EPISODES):
            log.begin(episode)
            for frame in range(FRAMES):
                mask = np.zeros((16, 24, 3), np.uint8)
                mask[4:8, 4:8] = 255
                state, action = np.full(8, 0.1, np.float32), np.full(4, 0.5, np.float32)
                values = {"observation.state": state, "action": action, "observation.images.target_mask": mask}
                change(episode, frame, values)
                dataset.add_frame({**values, "task": "dig"})
                image_ms, state_ms, is_as_told = ages(episode, frame)
                log.note(Ages(image_ms=image_ms, state_ms=state_ms), "NONE", is_as_told=is_as_told)
            log.end()
            dataset.save_episode()
        dataset.finalize()
        log.close()
        write_aligned_copy(tmp_path / "data", tmp_path / "aligned", log=tmp_path / "log.jsonl")
        return tmp_path / "aligned"

    return _record


def problems(report):
    return report.episodes.set_index("episode_index")["qc_problem"].to_dict()


def test_a_sound_recording_passes_and_gets_no_index(recording, capsys):
    root = recording()
    assert main(["qc", str(root)]) == 0
    out = capsys.readouterr()
    assert out.out == "3 of 3 episodes passed; 0 of them were replayed\n"
    assert "not noted" not in out.err
    assert not (root / "meta" / "excav_pairs.parquet").exists()


def test_late_frames_and_those_in_which_the_machine_did_something_else_fail_their_episodes(recording, capsys):
    def ages(episode, frame):
        is_late, is_other = episode == 1 and frame in (2, 3), episode == 2 and frame == 5
        return (130.0 if is_late else 80.0, 9.0, not is_other)

    root = recording(ages=ages)
    assert main(["qc", str(root)]) == 1
    said = capsys.readouterr().out
    assert "2 of 6 frames saw pictures or a state that were too old, up to 130 and 9 ms, the first one frame 2" in said
    assert "1 of 6 frames did something else than their action says, the first one frame 5" in said
    assert "2 of 3 episodes failed" in said


def spoil(key, value, *, only_frame=3):
    def change(episode, frame, values):
        if episode == 1 and frame == only_frame:
            values[key][...] = value

    return change


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (spoil("action", 1.5), "an action reaches 1.5; allowed are -1 to 1"),
        (spoil("observation.state", np.nan), "observation.state is not finite at frame 3"),
        (spoil("observation.images.target_mask", 0, only_frame=0), "the target mask is empty at frame 0"),
        (spoil("observation.images.target_mask", 100, only_frame=0), "the target mask is not binary at frame 0"),
    ],
)
def test_what_is_wrong_with_an_episode_is_said(recording, change, problem):
    found = problems(check_dataset(recording(change)))
    assert found[1].startswith(problem)
    assert (found[0], found[2]) == ("", "")


def test_the_episodes_asked_for_are_checked(recording):
    assert check_dataset(recording(), episodes=[2]).episodes["episode_index"].tolist() == [2]


@pytest.mark.parametrize("lost", ["meta/episodes", "meta/tasks.parquet", "meta/stats.json", "data"])
def test_a_recording_that_lacks_a_part_does_not_pass(recording, lost):
    root = recording()
    path = root / lost
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    assert not check_dataset(root).has_passed


def test_a_mask_that_is_no_picture_is_a_problem_and_no_error(recording):
    root = recording()
    (path,) = root.glob("data/*/*.parquet")
    table = pq.read_table(path)
    place = table.column_names.index("observation.images.target_mask")
    column = table.column(place)
    broken = pa.array([{"bytes": b"no picture", "path": None}] * len(column), type=column.type)
    pq.write_table(table.set_column(place, table.schema.field(place), broken), path)
    report = check_dataset(root)
    assert not report.has_passed
