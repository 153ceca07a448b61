import json
import shutil

import numpy as np
import pandas as pd
import pytest
from lerobot.datasets import LeRobotDataset, delete_episodes, merge_datasets, remove_feature
from lerobot_excav.datasets.record.environments import ENVIRONMENTS
from lerobot_excav.datasets.record.excavator_environment import EXCAVATOR
from lerobot_excav.envs.tasks.scoop.simulation_version import SIMULATION_VERSION

from lerobot_excav.datasets.complete import resimulation
from lerobot_excav.datasets.complete.resimulation import complete_recording
from lerobot_excav.datasets.format.schema import excav_features
from lerobot_excav.datasets.format.storage import STORAGES
from lerobot_excav.datasets.pairs.paired_index import INDEX_PATH, build_index, write_index
from lerobot_excav.errors import DatasetError, ExcavError


@pytest.fixture(scope="module")
def recording(paired_dataset, tmp_path_factory):
    """Make what `lerobot-record` leaves of a session: no excav columns, but a session log."""
    folder = tmp_path_factory.mktemp("recorded")
    dataset = LeRobotDataset("local/toy", root=paired_dataset, video_backend="pyav")
    remove_feature(
        dataset, list(excav_features(EXCAVATOR)), output_dir=folder / "recording", repo_id="local/recording"
    )
    index = build_index(paired_dataset)
    lines = [
        {
            "episode_index": int(row.episode_index),
            "scene_set": row.scene_set,
            "scene_id": int(row.scene_id),
            "target_id": int(row.target_id),
            "fps": 10,
            "soil": "sand",
            "fidelity": "standard",
            "simulation_version": SIMULATION_VERSION,
            "observation_height": 32,
            "observation_width": 48,
            "task": "Scoop-v0",
            "frames": int(row.length),
            "restarts": [],
        }
        for row in index.itertuples()
    ]
    write_session(folder / "session.jsonl", lines)
    return folder, lines


def write_session(path, lines):
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path


@pytest.fixture
def session(recording, tmp_path):
    """Write the session with some lines changed: `{episode_index: changes}`."""
    _, lines = recording

    def write(changes=None):
        changed = [{**line, **(changes or {}).get(line["episode_index"], {})} for line in lines]
        return write_session(tmp_path / "session.jsonl", changed)

    return write


def test_completing_a_recording_restores_what_the_simulation_knew(
    recording, paired_dataset, toy_rig, tmp_path
):
    folder, _ = recording
    out = complete_recording(
        folder / "recording", folder / "session.jsonl", out=tmp_path / "c", rig=toy_rig()
    )
    pd.testing.assert_frame_equal(build_index(out), build_index(paired_dataset))
    completed = LeRobotDataset("local/c", root=out, video_backend="pyav")
    original = LeRobotDataset("local/o", root=paired_dataset, video_backend="pyav")
    for frame in (0, 7, 100):
        for key, value in original[frame].items():
            np.testing.assert_array_equal(np.asarray(completed[frame][key]), np.asarray(value))


def test_a_completed_recording_merges_with_scripted_demonstrations(
    recording, paired_dataset, toy_rig, tmp_path
):
    folder, _ = recording
    out = complete_recording(
        folder / "recording", folder / "session.jsonl", out=tmp_path / "c", rig=toy_rig()
    )
    parts = [LeRobotDataset("local/x", root=root, video_backend="pyav") for root in (out, paired_dataset)]
    merge_datasets(parts, "local/m", output_dir=tmp_path / "m")
    index = write_index(tmp_path / "m")
    assert index["pair_uid"].value_counts().tolist() == [2] * 19


def test_completing_in_place_replaces_the_recording(recording, toy_rig, tmp_path):
    folder, _ = recording
    root = tmp_path / "recording"
    shutil.copytree(folder / "recording", root)
    assert complete_recording(root, folder / "session.jsonl", rig=toy_rig()) == root
    assert len(build_index(root)) == 19
    assert [path.name for path in tmp_path.iterdir()] == ["recording"]


def test_the_later_of_two_lines_about_an_episode_counts(recording, toy_rig, tmp_path):
    folder, lines = recording
    session = write_session(tmp_path / "s.jsonl", [{**lines[0], "scene_id": 4}, *lines])
    complete_recording(folder / "recording", session, out=tmp_path / "c", rig=toy_rig())
    assert build_index(tmp_path / "c")["scene_id"][0] == 0


def test_a_deviating_resimulation_names_episode_and_frame_and_leaves_no_trace(
    recording, session, toy_rig, tmp_path
):
    folder, _ = recording
    with pytest.raises(DatasetError, match=r"episode 0: .* at frame 1 of 6 .*largest deviation 0\.0\d+"):
        complete_recording(folder / "recording", session(), out=tmp_path / "c", rig=toy_rig(noise=0.1))
    with pytest.raises(DatasetError, match=r"episode 2: .* at frame 0"):
        complete_recording(
            folder / "recording", session({2: {"scene_id": 4}}), out=tmp_path / "c", rig=toy_rig()
        )
    assert [path.name for path in tmp_path.iterdir()] == ["session.jsonl"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({1: {"fps": 5}}, "ran at 5 frames/s, the dataset has 10"),
        ({1: {"frames": 5}}, r"episode 1 has 6 frames, but the session noted 5 .* edited after recording"),
        ({1: {"target_id": 2}}, r"episode 1 does not show the target mask of excavator/train/0/2"),
        ({1: {"observation_height": 64}}, r"episode 1 does not show the target mask"),
        ({1: {"simulation_version": 1}}, r"episodes 1 of version 1 of the simulation cannot be replayed"),
        ({1: {"restarts": [3]}}, r"restarted within episode 1 at frame \[3\], .* --skip-restarted"),
        ({1: {"episode_index": 99}}, r"no line for episodes \[1\]"),
    ],
)
def test_a_session_that_does_not_fit_is_refused(recording, session, toy_rig, tmp_path, changes, message):
    folder, _ = recording
    with pytest.raises(DatasetError, match=message):
        complete_recording(folder / "recording", session(changes), out=tmp_path / "c", rig=toy_rig())


def test_restarted_episodes_are_left_out_on_request(recording, paired_dataset, session, toy_rig, tmp_path):
    folder, _ = recording
    path = session({1: {"restarts": [3], "frames": 2}, 6: {"restarts": [0]}})
    out = complete_recording(
        folder / "recording", path, out=tmp_path / "c", skip_restarted=True, rig=toy_rig()
    )
    expected = build_index(paired_dataset).drop(index=[1, 6]).reset_index(drop=True)
    expected["episode_index"] = range(17)
    pd.testing.assert_frame_equal(build_index(out), expected)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c", "session.jsonl"]


def test_a_recording_of_restarted_episodes_alone_is_refused(recording, session, toy_rig, tmp_path):
    folder, _ = recording
    with pytest.raises(DatasetError, match="if others remain"):
        complete_recording(
            folder / "recording",
            session({index: {"restarts": [1]} for index in range(19)}),
            out=tmp_path / "c",
            skip_restarted=True,
            rig=toy_rig(),
        )


def test_a_recording_edited_before_indexing_is_refused(recording, toy_rig, tmp_path):
    folder, _ = recording
    dataset = LeRobotDataset("local/toy", root=folder / "recording", video_backend="pyav")
    delete_episodes(dataset, [0], output_dir=tmp_path / "edited", repo_id="local/edited")
    with pytest.raises(
        DatasetError, match=r"episode 0 .* excavator/train/0/0, .*Index first, edit afterwards"
    ):
        complete_recording(tmp_path / "edited", folder / "session.jsonl", rig=toy_rig())
    assert "excav.pair_uid" not in (tmp_path / "edited" / "meta" / "info.json").read_text()


def test_a_session_without_frame_counts_is_accepted(recording, toy_rig, tmp_path):
    folder, lines = recording
    bare = [{key: value for key, value in line.items() if key != "frames"} for line in lines]
    session = write_session(tmp_path / "s.jsonl", bare)
    out = complete_recording(folder / "recording", session, out=tmp_path / "c", rig=toy_rig())
    assert len(build_index(out)) == 19


def test_a_failure_while_writing_leaves_the_recording_alone(recording, toy_rig, tmp_path, monkeypatch):
    folder, _ = recording
    root = tmp_path / "recording"
    shutil.copytree(folder / "recording", root)
    before = {path: path.read_bytes() for path in root.rglob("*") if path.is_file()}

    def fail(_):
        raise OSError("disk full")

    monkeypatch.setattr(resimulation, "write_index", fail)
    with pytest.raises(OSError, match="disk full"):
        complete_recording(root, folder / "session.jsonl", rig=toy_rig())
    assert {path: path.read_bytes() for path in root.rglob("*") if path.is_file()} == before
    assert [path.name for path in tmp_path.iterdir()] == ["recording"]


def test_a_failed_exchange_puts_the_recording_back(tmp_path):
    (tmp_path / "recording").mkdir()
    with pytest.raises(FileNotFoundError):
        resimulation._put_in_place(tmp_path / "absent", tmp_path / "recording", None)
    assert [path.name for path in tmp_path.iterdir()] == ["recording"]


def test_a_dataset_with_the_columns_is_not_completed_again(paired_dataset, session, toy_rig, tmp_path):
    with pytest.raises(DatasetError, match="already"):
        complete_recording(paired_dataset, session(), out=tmp_path / "c", rig=toy_rig())
    assert (paired_dataset / INDEX_PATH).is_file()


@pytest.mark.parametrize(("text", "message"), [("{", "not JSON"), ('{"episode_index": 0}', "lacks fps")])
def test_a_damaged_session_names_the_line(recording, toy_rig, tmp_path, text, message):
    folder, _ = recording
    (tmp_path / "s.jsonl").write_text(text)
    with pytest.raises(DatasetError, match=rf"s\.jsonl:1: {message}"):
        complete_recording(folder / "recording", tmp_path / "s.jsonl", out=tmp_path / "c", rig=toy_rig())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"restarts": None}, r"restarts=None is not possible; give a list of frames"),
        ({"target_id": 9}, "target_id=9 .*from 0 to 3"),
        ({"scene_set": "foo"}, "scene_set='foo' .*'train'"),
        ({"simulation_version": None}, "simulation_version=None .*whole number"),
        ({"fps": "50"}, "fps='50' .*whole number"),
        ({"soil": "lava"}, "soil='lava' .*'sand'"),
        ({"task": "Dance-v0"}, "task='Dance-v0' .*'Scoop-v0'"),
    ],
)
def test_a_session_with_an_impossible_value_names_line_field_and_what_is_allowed(
    recording, session, toy_rig, tmp_path, changes, message
):
    folder, _ = recording
    with pytest.raises(ExcavError, match=rf"session\.jsonl:2: {message}"):
        complete_recording(folder / "recording", session({1: changes}), out=tmp_path / "c", rig=toy_rig())


@pytest.mark.parametrize("storage", STORAGES)
def test_a_recording_of_the_arm_is_completed_from_either_storage(record_toy, toy_rig, tmp_path, storage):
    record_toy(tmp_path / "original", env="fr5_grasp", scenes=1, storage=storage)
    dataset = LeRobotDataset("local/o", root=tmp_path / "original", video_backend="pyav")
    columns = list(excav_features(ENVIRONMENTS["fr5_grasp"]))
    remove_feature(dataset, columns, output_dir=tmp_path / "recording", repo_id="local/r")
    common = {
        "env": "fr5_grasp",
        "simulation_version": ENVIRONMENTS["fr5_grasp"].simulation_version,
        "scene_set": "train",
        "scene_id": 0,
        "fps": 50,
        "observation_height": 32,
        "observation_width": 48,
        "task": "FR5Grasp-v0",
    }
    lines = [{**common, "episode_index": number, "target_id": number} for number in range(4)]
    session = write_session(tmp_path / "session.jsonl", lines)
    complete_recording(tmp_path / "recording", session, rig=toy_rig())
    index = build_index(tmp_path / "recording")
    pd.testing.assert_frame_equal(index, build_index(tmp_path / "original"))
    assert index["success"].all()


def test_a_session_of_another_environment_is_refused(recording, session, toy_rig, tmp_path):
    folder, _ = recording
    changes = {"env": "fr5_grasp", "task": "FR5Grasp-v0", "simulation_version": 2}
    with pytest.raises(
        DatasetError, match="episode 1: the session is of fr5_grasp, the recording of excavator"
    ):
        complete_recording(folder / "recording", session({1: changes}), out=tmp_path / "c", rig=toy_rig())
