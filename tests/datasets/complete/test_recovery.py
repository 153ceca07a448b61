"""What is rebuilt from a session log after a crash."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
import toy_reach.table
from lerobot.datasets import remove_feature
from toy_reach.spec import REACH

from lerobot_excav.datasets.complete import recovery
from lerobot_excav.datasets.complete.recovery import recover_recording
from lerobot_excav.datasets.complete.resimulation import complete_recording
from lerobot_excav.datasets.complete.session import read_session
from lerobot_excav.datasets.format.schema import excav_features
from lerobot_excav.datasets.format.storage import STORAGES
from lerobot_excav.datasets.pairs.paired_index import build_index
from lerobot_excav.errors import DatasetError

from ..toy import load, write_session

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def recordings(changing_datasets, tmp_path_factory):
    """Eight episodes with changes of the command as lerobot-record leaves them, by storage, with their session logs."""
    folder = tmp_path_factory.mktemp("recordings")
    for storage, dataset in changing_datasets.items():
        out = folder / storage
        remove_feature(load(dataset), list(excav_features(REACH)), output_dir=out, repo_id="local/recording")
        write_session(dataset, folder / f"{storage}.jsonl")
    return folder


@pytest.fixture
def crashed(recordings, tmp_path):
    """A recording whose files were not closed, and its session log."""
    damage(recordings / "image", tmp_path / "data")
    shutil.copy(recordings / "image.jsonl", tmp_path / "session.jsonl")
    return tmp_path / "data", tmp_path / "session.jsonl"


def damage(recording, root):
    """Copy a recording without the end of every table of frames and of episodes, where a crash leaves none."""
    shutil.copytree(recording, root)
    for path in [*root.glob("data/*/*.parquet"), *root.glob("meta/episodes/*/*.parquet")]:
        path.write_bytes(path.read_bytes()[:-100])


def contents(root):
    return {path.relative_to(root): path.read_bytes() for path in root.rglob("*") if path.is_file()}


def change_info(root, **changes):
    path = root / "meta" / "info.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def cut_log(log, lines):
    """Leave out lines at the end."""
    log.write_text("".join(log.read_text().splitlines(keepends=True)[:-lines]))


@pytest.mark.parametrize("storage", STORAGES)
def test_a_recovered_dataset_is_the_one_that_was_recorded(recordings, changing_datasets, tmp_path, storage):
    root, log = tmp_path / "data", recordings / f"{storage}.jsonl"
    damage(recordings / storage, root)
    (root / "README.md").write_text("mine")
    damaged = contents(root)
    result = recover_recording(root, log)
    assert (result.root, result.aside, result.episodes, result.lost) == (root, tmp_path / "data.damaged", 8, None)
    assert contents(root).pop((root / "README.md").relative_to(root)) == b"mine"
    assert contents(result.aside) == {path: data for path, data in damaged.items() if path.name != "README.md"}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data", "data.damaged"]

    recovered, recorded = load(root), load(recordings / storage)
    for found, expected in zip(recovered, recorded, strict=True):
        assert found.keys() == expected.keys()
        for key, value in expected.items():
            np.testing.assert_array_equal(np.asarray(found[key]), np.asarray(value), err_msg=key)
    info, expected = (json.loads((each / "meta/info.json").read_text()) for each in (root, recordings / storage))
    for key in ("fps", "robot_type", "total_episodes", "total_frames", "splits"):
        assert info[key] == expected[key]
    assert {k: v["dtype"] for k, v in info["features"].items()} == {
        k: v["dtype"] for k, v in expected["features"].items()
    }
    for key in ("observation.state", "action"):
        for name, value in recorded.meta.stats[key].items():
            np.testing.assert_allclose(recovered.meta.stats[key][name], value, rtol=1e-6)
    # And what follows works on it.
    complete_recording(root, log, operator="scripted")
    pd.testing.assert_frame_equal(build_index(root), build_index(changing_datasets[storage]))


def test_without_a_readable_description_the_log_alone_suffices(crashed):
    root, log = crashed
    for name in ("info.json", "tasks.parquet"):
        (root / "meta" / name).write_bytes(b'{"codebase')
    assert recover_recording(root, log, task="go there").episodes == 8
    assert load(root)[0]["task"] == "go there"


@pytest.mark.parametrize(("given", "found"), [(None, "as recorded"), ("as told", "as told")])
def test_a_task_text_that_the_dataset_has_lost_is_that_of_the_session(crashed, given, found):
    root, log = crashed
    (root / "meta" / "tasks.parquet").unlink()
    head, *events = log.read_text().splitlines()
    log.write_text("\n".join([json.dumps(json.loads(head) | {"task": "as recorded"}), *events]) + "\n")
    recover_recording(root, log, task=given)
    assert load(root)[0]["task"] == found


def test_nonsense_in_what_is_left_counts_as_unreadable(crashed, tmp_path):
    root, log = crashed
    features = json.loads((root / "meta" / "info.json").read_text())["features"]
    for number, change in enumerate(({"shape": None}, {"shape": 5}, {"info": 5})):
        change_info(root, features=features | {"action": features["action"] | change})
        assert recover_recording(root, log, out=tmp_path / f"{number}").episodes == 8
    change_info(root, features=features)
    episodes = pd.DataFrame({"episode_index": [0, 1, 2], "tasks": [None, [], [7]]})
    episodes.to_parquet(next(root.glob("meta/episodes/*/*.parquet")))
    pd.DataFrame({"task_index": [0]}).to_parquet(root / "meta" / "tasks.parquet")
    assert recover_recording(root, log).texts == [REACH.description]


def test_the_episode_in_hand_is_left_out_and_one_that_the_dataset_counts_is_not(crashed, tmp_path):
    root, log = crashed
    cut_log(log, 1)  # the end of the last episode was not announced
    assert recover_recording(root, log, out=tmp_path / "a").episodes == 8
    change_info(root, total_episodes=7)
    before = contents(root)
    result = recover_recording(root, log, out=tmp_path / "b")
    assert (result.episodes, result.lost, result.aside) == (7, 7, None)
    assert contents(root) == before
    frames = sum(run.actions for run in read_session(log)[7].runs)
    log.write_text(log.read_text() + json.dumps({"event": "stopped", "frames": frames}) + "\n")
    assert recover_recording(root, log, out=tmp_path / "c").episodes == 7
    (root / "meta" / "info.json").write_text("")
    assert recover_recording(root, log, out=tmp_path / "d").episodes == 8
    with pytest.raises(DatasetError, match=r"--out=.*d exists"):
        recover_recording(root, log, out=tmp_path / "d")


def test_a_link_stays_a_link_and_the_working_directory_may_be_the_dataset(crashed, tmp_path, monkeypatch):
    root, log = crashed
    link = tmp_path / "link"
    link.symlink_to(root)
    assert recover_recording(link, log).root == root
    assert link.is_symlink()
    monkeypatch.chdir(root)
    assert recover_recording(root.relative_to(root), log).aside == tmp_path / "data.damaged-2"
    assert load(link).num_episodes == 8


def test_task_texts_are_those_of_readable_episodes_and_several_are_asked_about(recordings, crashed, tmp_path):
    root, log = crashed
    texts = pd.DataFrame({"task_index": [0, 1]}, index=pd.Index(["go", "go on"], name="task"))
    texts.to_parquet(root / "meta" / "tasks.parquet")
    with pytest.raises(DatasetError, match=r"has 2 task texts, .* episode 0 .* --task: 'go', 'go on'"):
        recover_recording(root, log)
    episodes = pd.DataFrame({"episode_index": [0, 1], "tasks": [["go"], ["go on"]]})
    episodes.to_parquet(next(root.glob("meta/episodes/*/*.parquet")))
    recover_recording(root, log, task="go home")
    dataset = load(root)
    found = {int(row["episode_index"]): row["task"] for row in (dataset[i] for i in range(len(dataset)))}
    assert found == {0: "go", 1: "go on"} | dict.fromkeys(range(2, 8), "go home")


@pytest.mark.parametrize(
    ("line", "changes", "message"),
    [
        (0, {"simulation_version": 7}, "episodes 0, 1, 2 and 5 more of version 7"),
        (2, {"action": [0.25, 0.25]}, r"jsonl:2: episode 0, played again, leaves the state .* frame 1 by 0\.\d+"),
        (1, {"episode_index": 1}, r"nothing of episodes \[0\] .*`cat`"),
    ],
)
def test_a_session_that_does_not_fit_is_refused_and_changes_nothing(crashed, tmp_path, line, changes, message):
    root, log = crashed
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    lines[line] |= changes
    log.write_text("".join(json.dumps(line) + "\n" for line in lines))
    before = contents(tmp_path)
    with pytest.raises(DatasetError, match=message):
        recover_recording(root, log)
    assert contents(tmp_path) == before


def test_what_cannot_be_recovered_is_named(crashed, tmp_path):
    root, log = crashed
    with pytest.raises(DatasetError, match="is not a recording of lerobot-record: it has no folder meta"):
        recover_recording(tmp_path, log)
    for changes, message in [
        ({"fps": 5}, "with 5 frames/s, the session of 'toy_reach_sim' with 10"),
        ({"robot_type": "fr5_sim"}, "robot_type='fr5_sim' .* the session of 'toy_reach_sim'"),
        ({"total_episodes": 9}, r"nothing of episodes \[8\]"),
    ]:
        change_info(root, **changes)
        with pytest.raises(DatasetError, match=message):
            recover_recording(root, log)
        change_info(root, fps=10, robot_type="toy_reach_sim", total_episodes=8)
    features = json.loads((root / "meta" / "info.json").read_text())["features"]
    change_info(root, features=features | {"excav.success": {"dtype": "bool", "shape": [1], "names": None}})
    with pytest.raises(DatasetError, match=r"other columns: \['excav.success'\]"):
        recover_recording(root, log)
    change_info(root, total_episodes=0, features=features)
    log.write_text("".join(log.read_text().splitlines(keepends=True)[:4]))
    with pytest.raises(DatasetError, match=r"no episode of .* was finished, so there is nothing to recover"):
        recover_recording(root, log)


def test_a_failure_while_putting_it_in_place_leaves_everything_as_it_was(crashed, tmp_path, monkeypatch):
    before = contents(tmp_path)

    def fail(new, root, aside):
        raise OSError("disk full")

    monkeypatch.setattr(recovery, "exchange", fail)
    with pytest.raises(OSError, match="disk full"):
        recover_recording(*crashed)
    assert contents(tmp_path) == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data", "session.jsonl"]


def test_another_simulation_is_noticed(crashed, monkeypatch):
    monkeypatch.setattr(toy_reach.table, "SPEED_M_S", 1.1)
    with pytest.raises(DatasetError, match="leaves the state that was noted"):
        recover_recording(*crashed)
