import json
import shutil

import numpy as np
import pandas as pd
import pytest
import toy_reach.table
from lerobot.datasets import delete_episodes, merge_datasets, remove_feature
from toy_reach.spec import REACH

from lerobot_excav.datasets.complete import resimulation
from lerobot_excav.datasets.complete.resimulation import complete_recording
from lerobot_excav.datasets.complete.session import read_session
from lerobot_excav.datasets.format.episode_table import iterate_episodes
from lerobot_excav.datasets.format.schema import PAIR_KEY, SCENE_KEY, TARGET_KEY, excav_features
from lerobot_excav.datasets.format.storage import STORAGES
from lerobot_excav.datasets.pairs.paired_index import build_index, write_index
from lerobot_excav.errors import DatasetError
from lerobot_excav.robots.session_log import SessionLog

from ..toy import load, record_toy, toy_settings


def make_recording(dataset, folder, env=None):
    """Make what `lerobot-record` leaves of a session: no excav columns, but a log that the robot wrote."""
    remove_feature(
        load(dataset), list(excav_features(REACH)), output_dir=folder / "recording", repo_id="local/recording"
    )
    log = SessionLog(folder / "session.jsonl", REACH, toy_settings(env=env).env)
    for episode in iterate_episodes(dataset, (PAIR_KEY, SCENE_KEY, TARGET_KEY)):
        log.begin(episode.index, scene_id=episode.pair.scene_id, target_id=episode.pair.target_id)
        for target_id in [*episode.target_id[1:], episode.target_id[-1]]:
            log.count_frame(int(target_id))
    log.write()
    return folder / "recording", folder / "session.jsonl"


@pytest.fixture(scope="module")
def recorded(paired_dataset, tmp_path_factory):
    """A recording and its session. Not to be changed by tests."""
    return make_recording(paired_dataset, tmp_path_factory.mktemp("recorded"))


@pytest.fixture
def recording(recorded):
    return recorded[0]


@pytest.fixture
def session(recorded, tmp_path):
    """Write the session with some lines changed: `{episode_index: changes}`; settings are changed one by one."""
    lines = [json.loads(line) for line in recorded[1].read_text().splitlines()]

    def write(changes=None, *, first=None):
        before = [] if first is None else [{**lines[0], **first}]
        changed = [*before, *({**line, **(changes or {}).get(line["episode_index"], {})} for line in lines)]
        for line in changed:
            if line["env"] == "toy_reach":
                line["settings"] = {**lines[0]["settings"], **line["settings"]}
        path = tmp_path / "session.jsonl"
        path.write_text("".join(json.dumps(line) + "\n" for line in changed))
        return path

    return write


def test_completing_a_recording_restores_what_the_simulation_knew(recording, session, paired_dataset, tmp_path):
    out = complete_recording(recording, session(), out=tmp_path / "c")
    pd.testing.assert_frame_equal(build_index(out), build_index(paired_dataset))
    for completed, original in zip(load(out), load(paired_dataset), strict=True):
        assert completed.keys() == original.keys()
        for key, value in original.items():
            np.testing.assert_array_equal(np.asarray(completed[key]), np.asarray(value))
    # And it merges with scripted demonstrations.
    merge_datasets([load(out), load(paired_dataset)], "local/m", output_dir=tmp_path / "m")
    assert write_index(tmp_path / "m")["pair_uid"].value_counts().tolist() == [2] * 19


@pytest.mark.parametrize("storage", STORAGES)
def test_a_recording_with_changed_commands_is_completed_from_either_storage(changing_datasets, storage, tmp_path):
    recording, session = make_recording(changing_datasets[storage], tmp_path)
    complete_recording(recording, session)
    index = build_index(recording)
    pd.testing.assert_frame_equal(index, build_index(changing_datasets[storage]))
    assert (index["final_target_id"] == (index["target_id"] + 1) % 4).all()


def test_a_recording_of_corrupted_masks_is_completed(tmp_path):
    env = {"mask_condition": "zero", "table": "ice"}
    record_toy(tmp_path / "original", scenes=1, env=env)
    recording, session = make_recording(tmp_path / "original", tmp_path, env=env)
    complete_recording(recording, session)
    pd.testing.assert_frame_equal(build_index(recording), build_index(tmp_path / "original"))


def test_completing_in_place_replaces_the_recording_and_the_later_of_two_lines_counts(recording, session, tmp_path):
    root = tmp_path / "recording"
    shutil.copytree(recording, root)
    path = session(first={"scene_id": 4})
    assert complete_recording(root, path) == root
    assert build_index(root)["scene_id"].tolist()[:4] == [0] * 4
    assert sorted(path.name for path in tmp_path.iterdir()) == ["recording", "session.jsonl"]
    with pytest.raises(DatasetError, match="already"):
        complete_recording(root, path)


def test_a_deviating_resimulation_names_episode_and_frame_and_leaves_no_trace(
    recording, session, tmp_path, monkeypatch
):
    monkeypatch.setattr(toy_reach.table, "SPEED_M_S", 1.1)
    with pytest.raises(DatasetError, match=r"episode 0: .* at frame 1 of \d .*largest deviation 0\.0\d+"):
        complete_recording(recording, session(), out=tmp_path / "c")
    assert [path.name for path in tmp_path.iterdir()] == ["session.jsonl"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"settings": {"fps": 5}}, "episode 1: the robot ran at 5 frames/s, the dataset has 10"),
        ({"frames": 5}, r"episode 1 has 8 frames, but the session noted 5 .* edited after recording"),
        ({"commands": [[0, 2]]}, r"episode 1 does not show the target mask of toy_reach/train/0/2"),
        ({"scene_id": 4}, r"episode 1 does not show the target mask of toy_reach/train/4/1"),
        ({"settings": {"observation_height": 64}}, r"episode 1 does not show the target mask"),
        ({"settings": {"table": "ice"}}, r"episode 1: the re-simulation of .* at frame 1"),
        ({"simulation_version": 7}, r"episodes 1 of version 7 of the simulation cannot be replayed"),
        ({"restarts": [3]}, r"restarted, .* within episode 1 at frame \[3\], .* --skip_restarted"),
        ({"episode_index": 99}, r"no line for episodes \[1\]"),
        ({"env": "fr5_grasp", "settings": {}}, "episode 1: the session is of fr5_grasp, the recording of toy_reach"),
    ],
)
def test_a_session_that_does_not_fit_is_refused(recording, session, tmp_path, changes, message):
    with pytest.raises(DatasetError, match=message):
        complete_recording(recording, session({1: changes}), out=tmp_path / "c")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"restarts": None}, "restarts=None: Input should be a valid array"),
        ({"restarts": [-1]}, r"restarts\.0=-1: .*greater than or equal to 0"),
        ({"commands": [[0, 9]]}, "commands: target_id=9 .*from 0 to 3"),
        ({"commands": [[1, 2]]}, r"commands=\[\[1, 2\]\] .*it begins with \[0, first target\]"),
        ({"commands": [[0, 1], [3, 7]]}, "commands: target_id=7 .*from 0 to 3"),
        ({"commands": [[0, 1], [3, 2], [3, 0]]}, "commands: frame=3 .*from 4 to 7"),
        ({"commands": [[0, 1], [2]]}, r"commands=.*: \[2\] is not a pair of frame and target"),
        ({"commands": []}, "commands=.* at least 1 item"),
        ({"simulation_version": "1"}, "simulation_version='1': .*valid integer"),
        ({"scene_id": -3}, "scene_id=-3: .*greater than or equal to 0"),
        ({"colour": 1}, "colour is not known"),
        ({"env": "lathe"}, "env='lathe' .*'toy_reach'"),
        ({"settings": {"fps": "10"}}, "fps='10' .*give one of"),
        ({"settings": {"task": "Dance-v0"}}, "task='Dance-v0' .*'Reach-v0'"),
        ({"settings": {"colour": 1}}, "colour is not a setting of toy_reach; allowed: task"),
    ],
)
def test_a_session_with_an_impossible_value_names_line_field_and_what_is_allowed(session, changes, message):
    with pytest.raises(DatasetError, match=rf"session\.jsonl:2: {message}"):
        read_session(session({1: changes}))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not JSON .* Remove the line if it is the last"),
        ("[3]", "a JSON object is expected"),
        ('{"episode_index": 0}', "lacks simulation_version; lacks env;"),
    ],
)
def test_a_damaged_or_missing_session_is_named(tmp_path, text, message):
    (tmp_path / "s.jsonl").write_text(f"\n{text}")
    with pytest.raises(DatasetError, match=rf"s\.jsonl:2: {message}"):
        read_session(tmp_path / "s.jsonl")
    with pytest.raises(DatasetError, match=r"none does not exist; .* --robot\.session_log"):
        read_session(tmp_path / "none")


def test_restarted_episodes_are_left_out_on_request(recording, paired_dataset, session, tmp_path):
    path = session({1: {"restarts": [3], "frames": 2}, 6: {"restarts": [0]}})
    out = complete_recording(recording, path, out=tmp_path / "c", skip_restarted=True)
    expected = build_index(paired_dataset).drop(index=[1, 6]).reset_index(drop=True)
    expected["episode_index"] = range(17)
    pd.testing.assert_frame_equal(build_index(out), expected)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c", "session.jsonl"]
    path = session({index: {"restarts": [1]} for index in range(19)})
    with pytest.raises(DatasetError, match="if others remain"):
        complete_recording(recording, path, out=tmp_path / "d", skip_restarted=True)


def test_a_recording_edited_before_indexing_is_refused(recording, recorded, tmp_path):
    delete_episodes(load(recording), [0], output_dir=tmp_path / "edited", repo_id="local/edited")
    with pytest.raises(DatasetError, match=r"episode 0 .* toy_reach/train/0/0.*Index first, edit afterwards"):
        complete_recording(tmp_path / "edited", recorded[1])
    assert PAIR_KEY not in (tmp_path / "edited" / "meta" / "info.json").read_text()


def test_a_failure_while_writing_leaves_the_recording_alone(recording, recorded, tmp_path, monkeypatch):
    root = tmp_path / "recording"
    shutil.copytree(recording, root)
    before = {path: path.read_bytes() for path in root.rglob("*") if path.is_file()}

    def fail(_):
        raise OSError("disk full")

    monkeypatch.setattr(resimulation, "write_index", fail)
    with pytest.raises(OSError, match="disk full"):
        complete_recording(root, recorded[1])
    assert {path: path.read_bytes() for path in root.rglob("*") if path.is_file()} == before
    assert [path.name for path in tmp_path.iterdir()] == ["recording"]


def test_a_failed_exchange_puts_the_recording_back(tmp_path):
    (tmp_path / "recording").mkdir()
    with pytest.raises(FileNotFoundError):
        resimulation._put_in_place(tmp_path / "absent", tmp_path / "recording", None)
    assert [path.name for path in tmp_path.iterdir()] == ["recording"]
