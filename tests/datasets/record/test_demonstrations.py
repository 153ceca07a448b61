import errno
import os
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import toy_reach.env

from lerobot_excav.datasets.pairs.paired_index import build_index
from lerobot_excav.datasets.record import assembly, simulation
from lerobot_excav.datasets.record.demonstrations import record_demonstrations
from lerobot_excav.datasets.record.episode_store import EpisodeStore
from lerobot_excav.datasets.record.partial_run import PartialRun
from lerobot_excav.datasets.record.provenance import read_provenance
from lerobot_excav.datasets.record.simulation import play_demonstration
from lerobot_excav.errors import ConfigurationError, DatasetError

from ..toy import CHANGE_FRAME, load, record_toy, toy_settings


def contents(root: Path) -> dict[str, object]:
    """Read every file; of the tables the values, as their header holds a random cache key of the library."""
    return {
        str(path.relative_to(root)): pq.read_table(path).to_pylist() if path.suffix == ".parquet" else path.read_bytes()
        for path in sorted(root.rglob("*"))
        if path.is_file()
    }


@pytest.mark.parametrize("changes", [False, True], ids=["one command", "changed command"])
def test_frames_read_back_as_they_were_played(request, paired_dataset, changing_datasets, changes):
    if changes:
        request.getfixturevalue("command_changes")
    settings = toy_settings(scenes=5)
    episode = play_demonstration(settings, settings.pairs()[5])
    items = list(load(changing_datasets["image"] if changes else paired_dataset, [5]))
    assert len(items) == episode.length
    assert episode.target_id.tolist() == [1] * CHANGE_FRAME + [2 if changes else 1] * (len(items) - CHANGE_FRAME)
    for frame, item in enumerate(items):
        np.testing.assert_array_equal(item["observation.state"], episode.state[frame])
        np.testing.assert_array_equal(item["action"], episode.action[frame])
        np.testing.assert_array_equal(item["excav.task_state"], episode.task_state[frame])
        assert int(item["excav.target_id"]) == episode.target_id[frame]
        assert item["excav.pair_uid"] == episode.pair.uid == "toy_reach/train/1/0/1"
        assert (item["excav.table"], item["excav.mask_source"]) == ("wood", "oracle")
        assert int(item["excav.scene_id"]) == 1
        assert bool(item["excav.success"])
        assert item["task"] == "Slide to the spot that the mask marks."


@pytest.mark.slow
def test_an_interrupted_run_continues_to_the_same_bytes(tmp_path, monkeypatch, command_changes):
    record_toy(tmp_path / "whole")
    played = []
    play = simulation.play_demonstration

    def interrupted(settings, pair):
        if len(played) == 5:
            raise KeyboardInterrupt
        played.append(pair)
        return play(settings, pair)

    monkeypatch.setattr(simulation, "play_demonstration", interrupted)
    with pytest.raises(KeyboardInterrupt):
        record_toy(tmp_path / "broken")
    assert not (tmp_path / "broken").exists()
    monkeypatch.setattr(simulation, "play_demonstration", lambda *a: (played.append(a[1]), play(*a))[1])
    record_toy(tmp_path / "broken", resume=True)
    assert len(played) == len(set(played)) == 12
    assert contents(tmp_path / "broken") == contents(tmp_path / "whole")
    assert not (tmp_path / "broken.partial").exists()


@pytest.mark.slow
@pytest.mark.parametrize("stage", ["episode", "outcome", "assembly", "index"])
def test_after_a_full_disk_a_run_continues_and_nothing_that_was_finished_is_played_again(tmp_path, monkeypatch, stage):
    record_toy(tmp_path / "whole", scenes=1)
    played, full = [], OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    play, write, written = simulation.play_demonstration, Path.write_bytes, []

    def write_bytes(path, content):
        written.append(path)
        is_full = len(written) > 4 and {"episode": ".npz.", "outcome": ".json."}.get(stage, "/") in path.name
        write(path, content[:10] if is_full else content)
        if is_full:
            raise full

    def fail(*_, **__):
        raise full

    monkeypatch.setattr(simulation, "play_demonstration", lambda *a: (played.append(a[1]), play(*a))[1])
    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", write_bytes)
        if stage == "assembly":
            patch.setattr(assembly.LeRobotDataset, "save_episode", fail)
        if stage == "index":
            patch.setattr(pd.DataFrame, "to_parquet", fail)
        with pytest.raises(OSError, match=rf"No space left on device: '{tmp_path}/v\.partial/"):
            record_toy(tmp_path / "v", scenes=1)
    assert not (tmp_path / "v").exists()
    finished = len(list((tmp_path / "v.partial" / "episodes").glob("[!.]*.json")))
    record_toy(tmp_path / "v", scenes=1, resume=True)
    assert contents(tmp_path / "v") == contents(tmp_path / "whole")
    assert finished == {"episode": 2, "outcome": 1}.get(stage, 4)
    assert len(played) == 4 + 4 - finished
    assert sorted(path.name for path in tmp_path.iterdir()) == ["v", "whole"]


@pytest.mark.parametrize("keep", [False, True])
def test_failed_episodes_are_listed_and_kept_on_request_only(tmp_path, keep):
    summary = record_toy(tmp_path / "d", first_scene=3, scenes=1, keep_failures=keep)
    assert summary.episodes == 3 + keep
    assert summary.failures == ["toy_reach/train/3/0/1"]
    assert [outcome["kept"] for outcome in read_provenance(tmp_path / "d").outcomes] == [True, keep, True, True]
    assert build_index(tmp_path / "d")["success"].tolist() == [True, *[False] * keep, True, True]


def hide(monkeypatch, *targets):
    true_mask = toy_reach.env.ReachEnv.true_mask
    monkeypatch.setattr(
        toy_reach.env.ReachEnv,
        "true_mask",
        lambda env, command: true_mask(env, command) & (command.target_id not in targets),
    )


def test_an_episode_whose_mask_is_missing_is_never_kept(tmp_path, monkeypatch):
    hide(monkeypatch, 2)
    summary = record_toy(tmp_path / "d", scenes=1, keep_failures=True)
    assert (summary.episodes, summary.failures, summary.waited) == (3, [], ["toy_reach/train/0/0/2"])
    outcome = read_provenance(tmp_path / "d").outcomes[2]
    assert outcome["mask_missing_frames"] > 0
    assert not outcome["kept"]


def test_a_source_that_finds_nothing_is_named_where_nothing_is_written(tmp_path, monkeypatch):
    hide(monkeypatch, 0, 1, 2, 3)
    with pytest.raises(DatasetError, match=r"in 4 of 4 episodes the machine waited .* another --env\.mask_source"):
        record_toy(tmp_path / "d", scenes=1, keep_failures=True)


def test_nothing_is_written_when_every_episode_fails(tmp_path):
    settings = {"env": {"episode_length": 1}, "scenes": 1, "targets": 1}
    with pytest.raises(DatasetError, match=r"none of 1 .* remove \S*d\.partial and record again"):
        record_toy(tmp_path / "d", **settings)
    assert not (tmp_path / "d").exists()


def test_a_finished_dataset_is_neither_overwritten_nor_changed(paired_dataset):
    before = contents(paired_dataset)
    with pytest.raises(DatasetError, match="exists"):
        record_toy(paired_dataset, scenes=5)
    with pytest.raises(ConfigurationError, match="--seed=7 differs from the started run, which has 0"):
        record_toy(paired_dataset, scenes=5, seed=7, resume=True)
    assert record_toy(paired_dataset, scenes=5, resume=True).episodes == 19
    assert contents(paired_dataset) == before


def test_a_started_run_is_neither_resumed_unasked_nor_with_another_setting(tmp_path):
    with PartialRun(tmp_path / "d", toy_settings(), resume=False) as started:
        (started.episodes / "toy_reach-train-0-0-0.npz").write_bytes(b"torn")
        assert EpisodeStore(started.episodes).outcome(toy_settings().pairs()[0]) is None
        with pytest.raises(DatasetError, match="another process"):
            record_toy(tmp_path / "d", resume=True)
    with pytest.raises(DatasetError, match="--resume"):
        record_toy(tmp_path / "d")
    for changes, message in (
        ({"env": {"table": "ice"}}, "--env.table=ice differs from the started run, which has wood"),
        ({"keep_failures": True}, "--keep_failures=true differs .* continue it with --keep_failures=false"),
    ):
        with pytest.raises(ConfigurationError, match=message):
            record_toy(tmp_path / "d", resume=True, **changes)
    settings = started.folder / "settings.json"
    settings.write_text(settings.read_text().replace('version": 1', 'version": 7'))
    with pytest.raises(ConfigurationError, match="is of version 7 of the simulation"):
        record_toy(tmp_path / "d", resume=True)


@pytest.mark.parametrize("workers", [-1, 10**6])
def test_an_impossible_number_of_workers_leaves_no_folder(tmp_path, workers):
    with pytest.raises(ConfigurationError, match=f"--workers={workers}"):
        record_demonstrations(toy_settings(), tmp_path / "d", workers=workers)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_every_episode_has_its_own_seed_whatever_is_recorded_with_it(tmp_path, paired_dataset):
    among = load(paired_dataset, [10])[0]
    for name, changes in (("alone", {}), ("otherwise", {"seed": 1})):
        record_toy(tmp_path / name, first_scene=2, scenes=1, targets=1, **changes)
    alone, otherwise = (load(tmp_path / name)[0] for name in ("alone", "otherwise"))
    assert alone["excav.pair_uid"] == among["excav.pair_uid"]
    np.testing.assert_array_equal(alone["action"], among["action"])
    assert not np.array_equal(otherwise["action"], among["action"])
    outcomes = read_provenance(paired_dataset).outcomes
    assert len({tuple(outcome["seed"]) for outcome in outcomes}) == 20
    assert outcomes[0]["metrics"]["commands"] == [[0, 0]]
