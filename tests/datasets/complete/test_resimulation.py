import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import toy_reach.table
from lerobot.datasets import LeRobotDataset, delete_episodes, merge_datasets, remove_feature
from toy_reach.spec import REACH

from lerobot_excav.datasets.complete import resimulation
from lerobot_excav.datasets.complete.resimulation import complete_recording
from lerobot_excav.datasets.format.schema import PAIR_KEY, excav_features
from lerobot_excav.datasets.format.storage import STORAGES
from lerobot_excav.datasets.pairs.paired_index import build_index, write_index
from lerobot_excav.errors import DatasetError
from lerobot_excav.scripts.main import main

from ..toy import load, record_toy, write_session

pytestmark = pytest.mark.slow


def make_recording(dataset, folder, env=None):
    """Make what `lerobot-record` leaves of a session: no excav columns, but a log that the robot wrote."""
    remove_feature(
        load(dataset), list(excav_features(REACH)), output_dir=folder / "recording", repo_id="local/recording"
    )
    for path in folder.glob("recording/meta/episodes/*/*.parquet"):
        table = pq.read_table(path)  # the statistics of the columns are still there
        pq.write_table(table.select([name for name in table.column_names if "/excav." not in name]), path)
    write_session(dataset, folder / "session.jsonl", env)
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
    """Write the session with some episodes changed: `{episode_index: changes}`.

    A change is a field of the lines `session` and `episode`, a setting (`settings`, one by one), or how many `frames`
    are left, after which of them the machine was `held`, or events `more` after the episode.
    """
    lines = [json.loads(line) for line in recorded[1].read_text().splitlines()]
    begins = [number for number, line in enumerate(lines) if line["event"] == "episode"]
    chunks = [lines[begin:end] for begin, end in zip(begins, [*begins[1:], len(lines)], strict=True)]

    def changed(chunk, frames=None, held=None, more=(), **fields):
        head = lines[0] | {name: fields.pop(name) for name in ("env", "simulation_version") if name in fields}
        settings = fields.pop("settings", {})
        head["settings"] = (lines[0]["settings"] if head["env"] == "toy_reach" else {}) | settings
        begin, *events = chunk
        events = events[:frames]
        if held is not None:
            events.insert(held, {"event": "held"})
        return [head, begin | fields, *events, *more]

    def write(changes=None, *, first=None):
        before = [] if first is None else changed(chunks[0], **first)
        events = [event for i, chunk in enumerate(chunks) for event in changed(chunk, **(changes or {}).get(i, {}))]
        path = tmp_path / "session.jsonl"
        path.write_text("".join(json.dumps(event) + "\n" for event in [*before, *events]))
        return path

    return write


def episode_statistics(root):
    table = pq.read_table(next(root.glob("meta/episodes/*/*.parquet")))
    return table.select([name for name in table.column_names if name.startswith("stats/")]).to_pandas()


def test_completing_a_recording_restores_what_the_simulation_knew(recording, session, paired_dataset, tmp_path):
    out = complete_recording(recording, session(), out=tmp_path / "c", operator="scripted")
    pd.testing.assert_frame_equal(build_index(out), build_index(paired_dataset))
    for completed, original in zip(load(out), load(paired_dataset), strict=True):
        assert completed.keys() == original.keys()
        for key, value in original.items():
            np.testing.assert_array_equal(np.asarray(completed[key]), np.asarray(value))
    # Statistics as well, of the dataset and of every episode.
    found, expected = load(out).meta.stats, load(paired_dataset).meta.stats
    assert found.keys() == expected.keys()
    for key, stats in expected.items():
        for name, value in stats.items():
            np.testing.assert_allclose(found[key][name], value, rtol=1e-6, atol=1e-9, err_msg=f"{key}/{name}")
    found, expected = episode_statistics(out), episode_statistics(paired_dataset)
    pd.testing.assert_frame_equal(found[expected.columns], expected)
    assert set(found.columns) == set(expected.columns)
    # And it merges with scripted demonstrations.
    merge_datasets([load(out), load(paired_dataset)], "local/m", output_dir=tmp_path / "m")
    assert write_index(tmp_path / "m")["pair_uid"].value_counts().tolist() == [2] * 19


def test_who_commanded_is_a_person_unless_log_or_option_say_otherwise(small_datasets, tmp_path):
    recording, log = make_recording(small_datasets["image"], tmp_path)
    lines = log.read_text().splitlines(keepends=True)
    second = [number for number, line in enumerate(lines) if '"episode"' in line][1]
    lines.insert(second + 1, '{"event": "operator", "operator": "scripted"}\n')
    plain, log = log, tmp_path / "noted.jsonl"
    log.write_text("".join(lines))
    by_person = complete_recording(recording, log, out=tmp_path / "person")
    assert build_index(by_person)["operator"].tolist() == ["person", "scripted", "person", "person"]
    with pytest.raises(DatasetError, match=r"--operator=policy, but .* says who commanded \(episode 1: scripted\)"):
        complete_recording(recording, log, out=tmp_path / "c", operator="policy")
    assert main(["index", str(recording), f"--session={plain}", "--operator=policy", f"--out={tmp_path / 'p'}"]) == 0
    index = build_index(tmp_path / "p")
    assert index["operator"].tolist() == ["policy"] * 4
    assert index["intervention_frames"].tolist() == [0] * 4


@pytest.mark.parametrize("storage", STORAGES)
def test_a_recording_with_changed_commands_is_completed_from_either_storage(changing_datasets, storage, tmp_path):
    recording, session = make_recording(changing_datasets[storage], tmp_path)
    complete_recording(recording, session, operator="scripted")
    index = build_index(recording)
    pd.testing.assert_frame_equal(index, build_index(changing_datasets[storage]))
    assert (index["final_target_id"] == (index["target_id"] + 1) % 4).all()


def test_a_recording_of_corrupted_masks_is_completed(tmp_path):
    env = {"mask_condition": "zero", "table": "ice"}
    record_toy(tmp_path / "original", scenes=1, env=env)
    recording, session = make_recording(tmp_path / "original", tmp_path, env=env)
    complete_recording(recording, session, operator="scripted")
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


@pytest.mark.parametrize("name", ["meta/info.json", "meta/stats.json", "meta/tasks.parquet", "meta/episodes", "data"])
@pytest.mark.parametrize("is_missing", [False, True], ids=["cut off", "missing"])
def test_a_recording_that_lerobot_cannot_open_is_named_and_the_way_out_too(
    recording, session, tmp_path, name, is_missing
):
    root = tmp_path / "recording"
    shutil.copytree(recording, root)
    (path,) = [root / name] if (root / name).is_file() else (root / name).glob("*/*.parquet")
    if is_missing:
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:-60])
    with pytest.raises(DatasetError, match=r"(?s)(missing|cannot be read|JSON|has no).*add --recover to write"):
        complete_recording(root, session())


def test_a_recording_without_an_episode_is_refused(recording, session, tmp_path):
    created = LeRobotDataset.create("local/none", fps=10, features={}, root=tmp_path / "none")
    created.finalize()
    with pytest.raises(DatasetError, match="meta/episodes is missing"):
        complete_recording(tmp_path / "none", session())


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
        ({"target_id": 2}, r"episode 1 does not show the target mask of toy_reach/train/0/0/2"),
        ({"scene_id": 4}, r"episode 1 does not show the target mask of toy_reach/train/4/0/1"),
        ({"settings": {"observation_height": 64}}, r"episode 1 does not show the target mask"),
        ({"settings": {"table": "ice"}}, r"episode 1: the re-simulation of .* at frame 1"),
        ({"simulation_version": 7}, r"episodes 1 of version 7 of the simulation cannot be replayed"),
        ({"held": 3}, r"restarted, .* within episode 1 at frame \[3\], .* --skip_restarted"),
        ({"episode_index": 99}, r"no line for episodes \[1\]"),
        (
            {"env": "fr5_grasp", "settings": {}, "frames": 0},
            "episode 1: the session is of fr5_grasp, the recording of toy_reach",
        ),
    ],
)
def test_a_session_that_does_not_fit_is_refused(recording, session, tmp_path, changes, message):
    with pytest.raises(DatasetError, match=message):
        complete_recording(recording, session({1: changes}), out=tmp_path / "c")


def test_restarted_episodes_are_left_out_on_request(recording, paired_dataset, session, tmp_path):
    path = session({1: {"held": 3, "frames": 4}, 6: {"held": 0}})
    out = complete_recording(recording, path, out=tmp_path / "c", skip_restarted=True, operator="scripted")
    expected = build_index(paired_dataset).drop(index=[1, 6]).reset_index(drop=True)
    expected["episode_index"] = range(17)
    pd.testing.assert_frame_equal(build_index(out), expected)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c", "session.jsonl"]
    path = session({index: {"held": 1} for index in range(19)})
    with pytest.raises(DatasetError, match="if others remain"):
        complete_recording(recording, path, out=tmp_path / "d", skip_restarted=True)


def test_a_recording_edited_before_indexing_is_refused(recording, recorded, tmp_path):
    delete_episodes(load(recording), [0], output_dir=tmp_path / "edited", repo_id="local/edited")
    with pytest.raises(DatasetError, match=r"episode 0 .* toy_reach/train/0/0/0.*Index first, edit afterwards"):
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


def test_a_link_to_a_recording_stays_a_link_and_the_recording_may_be_the_working_directory(
    recording, recorded, tmp_path, monkeypatch
):
    for name in ("linked", "here"):
        shutil.copytree(recording, tmp_path / name)
        (tmp_path / name / "README.md").write_text("mine")
    (tmp_path / "link").symlink_to("linked")
    assert main(["index", str(tmp_path / "link"), f"--session={recorded[1]}"]) == 0
    monkeypatch.chdir(tmp_path / "here")
    assert main(["index", ".", f"--session={recorded[1]}"]) == 0
    assert sorted(path.name for path in Path().iterdir()) == ["README.md", "data", "meta"]
    assert (tmp_path / "link").is_symlink()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["here", "link", "linked"]
    for name in ("linked", "here"):
        assert len(build_index(tmp_path / name)) == 19
        assert (tmp_path / name / "README.md").read_text() == "mine"


def test_a_log_with_other_actions_than_the_recording_is_refused(recording, session, tmp_path):
    path = session()
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    third = [line for line in lines if line["event"] == "action"][2]
    third["action"][0] = 0.25
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    with pytest.raises(DatasetError, match=r"episode 0: .*session\.jsonl:2 .* different actions in frame 2"):
        complete_recording(recording, path, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()
