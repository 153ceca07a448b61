import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from lerobot.datasets import LeRobotDataset

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.record import simulation
from lerobot_excav.datasets.record.demonstrations import record_demonstrations
from lerobot_excav.datasets.record.episode_store import EpisodeStore
from lerobot_excav.datasets.record.partial_run import PartialRun
from lerobot_excav.datasets.record.provenance import read_provenance
from lerobot_excav.datasets.record.simulation import play_demonstration
from lerobot_excav.errors import ConfigurationError, DatasetError


def contents(root: Path) -> dict[str, object]:
    """Read every file; of the tables the values, as their header holds a random cache key of the library."""
    return {
        str(path.relative_to(root)): pq.read_table(path).to_pylist()
        if path.suffix == ".parquet"
        else path.read_bytes()
        for path in sorted(root.rglob("*"))
        if path.is_file()
    }


def test_frames_read_back_as_they_were_played(paired_dataset, toy_rig, toy_settings):
    settings = toy_settings(scenes=5)
    pair = settings.pairs()[5]
    episode = play_demonstration(toy_rig(), settings, pair)
    dataset = LeRobotDataset("local/toy", root=paired_dataset, episodes=[5])
    assert len(dataset) == episode.length
    for frame in range(episode.length):
        item = dataset[frame]
        np.testing.assert_array_equal(item["observation.state"], episode.state[frame])
        np.testing.assert_array_equal(item["action"], episode.action[frame])
        np.testing.assert_array_equal(item["excav.task_state"], episode.task_state[frame])
        for camera, frames in episode.images.items():
            image = (item[f"observation.images.{camera}"].numpy() * 255).round().astype(np.uint8)
            np.testing.assert_array_equal(image.transpose(1, 2, 0), frames[frame])
        assert item["excav.pair_uid"] == pair.uid
        assert (item["excav.soil"], item["excav.fidelity"]) == (settings.soil, settings.fidelity)
        assert (int(item["excav.scene_id"]), int(item["excav.target_id"])) == (pair.scene_id, pair.target_id)
        assert bool(item["excav.success"])
        assert item["task"] == "Dig where the mask points."


def test_an_interrupted_run_continues_to_the_same_bytes(tmp_path, record_toy, toy_rig, monkeypatch):
    record_toy(tmp_path / "whole")
    played = []
    play = simulation.play_demonstration

    def interrupted(rig, settings, pair):
        if len(played) == 5:
            raise KeyboardInterrupt
        played.append(pair)
        return play(rig, settings, pair)

    monkeypatch.setattr(simulation, "play_demonstration", interrupted)
    with pytest.raises(KeyboardInterrupt):
        record_toy(tmp_path / "broken")
    assert not (tmp_path / "broken").exists()
    monkeypatch.setattr(simulation, "play_demonstration", lambda *a: (played.append(a[2]), play(*a))[1])
    record_toy(tmp_path / "broken", resume=True)
    assert len(played) == len(set(played)) == 12
    assert contents(tmp_path / "broken") == contents(tmp_path / "whole")
    assert not (tmp_path / "broken.partial").exists()


def test_half_written_episodes_are_played_again(tmp_path, toy_rig, toy_settings):
    settings = toy_settings()
    pair = settings.pairs()[0]
    store = EpisodeStore(tmp_path)
    (tmp_path / "excavator-train-0-0.npz").write_bytes(b"torn")
    assert store.outcome(pair) is None


def test_failed_episodes_are_left_out_and_listed(tmp_path, record_toy):
    summary = record_toy(tmp_path / "d", first_scene=3, scenes=1)
    assert summary.episodes == 3
    assert summary.failures == ["excavator/train/3/1"]
    outcomes = read_provenance(tmp_path / "d").outcomes
    assert [outcome["kept"] for outcome in outcomes] == [True, False, True, True]


def test_failed_episodes_can_be_kept_and_are_marked(tmp_path, record_toy):
    record_toy(tmp_path / "d", first_scene=3, scenes=1, keep_failures=True)
    dataset = LeRobotDataset("local/toy", root=tmp_path / "d")
    assert dataset.num_episodes == 4
    assert {bool(value) for value in dataset.hf_dataset["excav.success"]} == {True, False}


def test_nothing_is_written_when_every_episode_fails(tmp_path, toy_rig, toy_settings, monkeypatch):
    rig, settings = toy_rig(), toy_settings(first_scene=3, scenes=1)
    monkeypatch.setattr(type(settings), "pairs", lambda self: [Pair("excavator", "train", 3, 1)])
    with pytest.raises(DatasetError, match=r"none of 1 .* remove \S*d\.partial and record again"):
        record_demonstrations(settings, tmp_path / "d", workers=0, rig=rig, show_progress=False)
    assert not (tmp_path / "d").exists()


def test_an_existing_dataset_is_not_overwritten(paired_dataset, record_toy):
    before = contents(paired_dataset)
    with pytest.raises(DatasetError, match="exists"):
        record_toy(paired_dataset, scenes=5)
    assert contents(paired_dataset) == before


def test_resuming_a_finished_run_does_nothing(paired_dataset, record_toy):
    before = contents(paired_dataset)
    assert record_toy(paired_dataset, scenes=5, resume=True).episodes == 19
    assert contents(paired_dataset) == before


def test_resuming_with_another_setting_names_it(paired_dataset, record_toy):
    with pytest.raises(ConfigurationError, match="--seed=7 differs from the started run, which has 0"):
        record_toy(paired_dataset, scenes=5, seed=7, resume=True)


def test_a_started_run_is_neither_resumed_unasked_nor_with_another_setting(
    tmp_path, record_toy, toy_settings
):
    with PartialRun(tmp_path / "d", toy_settings(), resume=False):
        pass
    with pytest.raises(DatasetError, match="--resume"):
        record_toy(tmp_path / "d")
    with pytest.raises(ConfigurationError, match="--soil=gravel differs"):
        record_toy(tmp_path / "d", soil="gravel", resume=True)


def test_a_switch_that_differs_is_named_as_the_user_writes_it(toy_settings):
    with pytest.raises(ConfigurationError, match="does not have --keep-failures; continue it without"):
        toy_settings(keep_failures=True).require_same(toy_settings())


def test_a_negative_number_of_workers_leaves_no_folder(tmp_path, toy_settings):
    with pytest.raises(ConfigurationError, match="--workers=-1"):
        record_demonstrations(toy_settings(), tmp_path / "d", workers=-1)
    assert not list(tmp_path.iterdir())


def test_two_runs_cannot_write_the_same_dataset(tmp_path, record_toy, toy_settings):
    with (
        PartialRun(tmp_path / "d", toy_settings(), resume=False),
        pytest.raises(DatasetError, match="another process"),
    ):
        record_toy(tmp_path / "d", resume=True)


def test_every_episode_has_its_own_seed_whatever_is_recorded_with_it(tmp_path, paired_dataset, record_toy):
    record_toy(tmp_path / "one", first_scene=2, scenes=1, targets=1)
    alone = LeRobotDataset("local/toy", root=tmp_path / "one")
    among = LeRobotDataset("local/toy", root=paired_dataset, episodes=[10])
    assert alone[0]["excav.pair_uid"] == among[0]["excav.pair_uid"]
    np.testing.assert_array_equal(alone[0]["action"], among[0]["action"])
    seeds = [tuple(outcome["seed"]) for outcome in read_provenance(paired_dataset).outcomes]
    assert len(set(seeds)) == 20


def test_the_seed_changes_the_actions(tmp_path, record_toy, paired_dataset):
    record_toy(tmp_path / "d", scenes=1, targets=1, seed=1)
    first = LeRobotDataset("local/toy", root=tmp_path / "d")[0]["action"]
    assert not np.array_equal(
        first, LeRobotDataset("local/toy", root=paired_dataset, episodes=[0])[0]["action"]
    )


def test_provenance_is_readable_json(paired_dataset):
    record = json.loads((paired_dataset / "meta" / "excav_demonstrations.json").read_text())
    assert record["operator"] == "scripted"
    assert record["episodes"][0]["metrics"] == {"retained_mass_kg": 600.0}
