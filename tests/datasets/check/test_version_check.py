"""The version of the simulation goes with the frames, and replays of another version are refused."""

import shutil
from dataclasses import replace

import pytest
from lerobot.datasets import LeRobotDataset, delete_episodes, merge_datasets, remove_feature, split_dataset
from lerobot_excav.datasets.record.environments import ENVIRONMENTS
from lerobot_excav.datasets.record.excavator_environment import EXCAVATOR
from lerobot_excav.envs.tasks.scoop.simulation_version import CHANGES, SIMULATION_VERSION, UNMARKED_VERSION

from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.format.schema import unmarked_columns
from lerobot_excav.datasets.format.version_check import require_one_version, versions_of
from lerobot_excav.datasets.pairs.paired_index import build_index, write_index
from lerobot_excav.datasets.record import partial_run
from lerobot_excav.errors import ConfigurationError, DatasetError
from lerobot_excav.scripts.main import main

KEY = "excav.simulation_version"


def load(root):
    return LeRobotDataset(f"local/{root.name}", root=root, video_backend="pyav")


@pytest.fixture(scope="module")
def first_dataset(paired_dataset, tmp_path_factory):
    """Make a dataset as the first version did: without the column. Not to be changed by tests."""
    root = tmp_path_factory.mktemp("first") / "dataset"
    remove_feature(
        load(paired_dataset), list(unmarked_columns(EXCAVATOR)), output_dir=root, repo_id="local/first"
    )
    return root


@pytest.fixture
def mixed_dataset(paired_dataset, record_toy, tmp_path, monkeypatch):
    """Merge what this version and a later one recorded."""
    with monkeypatch.context() as patch:
        later = replace(EXCAVATOR, simulation_version=SIMULATION_VERSION + 1)
        patch.setitem(ENVIRONMENTS, "excavator", later)
        record_toy(tmp_path / "later", scenes=1)
    merge_datasets([load(paired_dataset), load(tmp_path / "later")], "local/m", output_dir=tmp_path / "mixed")
    return tmp_path / "mixed"


def test_every_version_says_what_it_changed():
    assert sorted(CHANGES) == list(range(UNMARKED_VERSION, SIMULATION_VERSION + 1))


def test_every_frame_names_the_version_that_made_it(paired_dataset):
    assert {int(version) for version in load(paired_dataset).hf_dataset[KEY]} == {SIMULATION_VERSION}
    assert set(build_index(paired_dataset)["simulation_version"]) == {SIMULATION_VERSION}


def test_the_version_survives_deleting_splitting_and_merging(mixed_dataset, tmp_path):
    expected = {i: SIMULATION_VERSION + (i >= 19) for i in range(23)}
    assert versions_of(write_index(mixed_dataset)) == expected
    delete_episodes(load(mixed_dataset), [0], output_dir=tmp_path / "d", repo_id="local/d")
    assert list(versions_of(write_index(tmp_path / "d")).values()) == list(expected.values())[1:]
    (part,) = split_dataset(load(mixed_dataset), {"p": [3, 20]}, output_dir=tmp_path / "s").values()
    assert versions_of(write_index(part.root)) == {0: SIMULATION_VERSION, 1: SIMULATION_VERSION + 1}


def test_a_dataset_without_the_column_is_of_the_first_version(first_dataset, tmp_path):
    shutil.copytree(first_dataset, tmp_path / "d")
    index = write_index(tmp_path / "d")
    assert set(index["simulation_version"]) == {UNMARKED_VERSION}
    assert set(index["soil"]) == {"unknown"}


def test_an_older_dataset_is_checked_but_not_replayed(first_dataset, toy_rig, tmp_path):
    shutil.copytree(first_dataset, tmp_path / "old")
    assert set(check_dataset(tmp_path / "old", replays=0, rig=toy_rig())["qc"]) == {"passed"}
    with pytest.raises(DatasetError) as caught:
        check_dataset(tmp_path / "old", replays=1, rig=toy_rig())
    message = str(caught.value)
    assert message.startswith(
        f"{tmp_path / 'old'}: episodes 0, 1, 2 and 16 more of version 1 of the simulation"
    )
    for part in (
        f"in version {SIMULATION_VERSION}",
        CHANGES[2],
        "Record again, or install the release",
        "--replays=0",
    ):
        assert part in message


def test_a_newer_dataset_is_not_replayed(mixed_dataset, toy_rig):
    with pytest.raises(
        DatasetError, match=r"episodes 19, 20, 21 and 1 more of version .* this older package"
    ):
        check_dataset(mixed_dataset, replays=1, rig=toy_rig())


def test_what_this_version_recorded_in_a_mixed_dataset_is_replayed(mixed_dataset, toy_rig):
    rows = check_dataset(mixed_dataset, episodes=range(19), replays=2, rig=toy_rig())
    assert set(rows["qc"]) == {"passed"}


def test_lerobot_does_not_merge_a_dataset_with_one_of_the_first_version(
    first_dataset, paired_dataset, tmp_path
):
    with pytest.raises(ValueError, match="Same features"):
        merge_datasets([load(first_dataset), load(paired_dataset)], "local/m", output_dir=tmp_path / "m")


def test_the_index_command_tells_a_mixture_and_chooses_nothing_of_it(mixed_dataset, capsys):
    assert main(["index", str(mixed_dataset)]) == 0
    text = capsys.readouterr().out
    assert (
        f"simulation: version {SIMULATION_VERSION}, 19 episodes; version {SIMULATION_VERSION + 1}, 4" in text
    )
    assert "mixed: a scene's number means another scene in each version" in text
    assert main(["index", str(mixed_dataset), "--select=paired", "--flags"]) == 2
    assert "mixes versions of the simulation" in capsys.readouterr().err


def test_episodes_of_one_version_are_not_mixed(tmp_path):
    require_one_version({0: 1, 1: 1}, source=tmp_path)
    with pytest.raises(DatasetError, match=r"version 1: episodes 0; version 2: episodes 1\)"):
        require_one_version({0: 1, 1: 2}, source=tmp_path)


def test_a_run_that_another_version_began_is_not_continued(record_toy, toy_settings, tmp_path):
    with partial_run.PartialRun(tmp_path / "d", toy_settings(), resume=False) as partial:
        settings = partial.folder / "settings.json"
    settings.write_text(settings.read_text().replace(f'version": {SIMULATION_VERSION}', 'version": 1'))
    with pytest.raises(ConfigurationError, match="is of version 1 of the simulation"):
        record_toy(tmp_path / "d", resume=True)
