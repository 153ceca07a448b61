"""The version of the simulation goes with the frames, and replays of another version are refused."""

from dataclasses import replace

import pytest
from lerobot.datasets import delete_episodes, merge_datasets, split_dataset
from toy_reach.spec import REACH

from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.format.version_check import versions_of
from lerobot_excav.datasets.pairs.paired_index import write_index
from lerobot_excav.envs.tasks.registry import TASKS
from lerobot_excav.scripts.main import main

from ..toy import load, record_toy

pytestmark = pytest.mark.slow

LATER = replace(REACH, simulation_version=2, changes={1: "the first", 2: "a rounder disc"})


@pytest.fixture
def mixed_dataset(paired_dataset, tmp_path, monkeypatch):
    """Merge what this version and a later one recorded."""
    with monkeypatch.context() as patch:
        patch.setitem(TASKS, REACH.id, LATER)
        record_toy(tmp_path / "later", scenes=1)
    merge_datasets([load(paired_dataset), load(tmp_path / "later")], "local/m", output_dir=tmp_path / "mixed")
    return tmp_path / "mixed"


@pytest.mark.parametrize("spec", TASKS.values(), ids=TASKS)
def test_every_version_says_what_it_changed(spec):
    assert sorted(spec.changes) == list(range(1, spec.simulation_version + 1))


def test_the_version_survives_deleting_splitting_and_merging(mixed_dataset, tmp_path):
    expected = {i: 1 + (i >= 19) for i in range(23)}
    assert versions_of(write_index(mixed_dataset)) == expected
    delete_episodes(load(mixed_dataset), [0], output_dir=tmp_path / "d", repo_id="local/d")
    assert list(versions_of(write_index(tmp_path / "d")).values()) == list(expected.values())[1:]
    (part,) = split_dataset(load(mixed_dataset), {"p": [3, 20]}, output_dir=tmp_path / "s").values()
    assert versions_of(write_index(part.root)) == {0: 1, 1: 2}


def test_what_another_version_recorded_is_checked_but_not_replayed(mixed_dataset, monkeypatch):
    report = check_dataset(mixed_dataset, replays=1)
    assert report.episodes["qc"].tolist() == ["passed"] * 19 + ["failed"] * 4
    assert report.episodes["qc_problem"][19].startswith("excav.simulation_version=2 is not known")
    assert check_dataset(mixed_dataset, episodes=range(19), replays=2).has_passed
    monkeypatch.setitem(TASKS, REACH.id, LATER)
    assert check_dataset(mixed_dataset, replays=0).has_passed
    report = check_dataset(mixed_dataset, replays=1)
    assert set(report.episodes["qc"]) == {"passed"}
    (problem,) = report.problems
    for part in (
        f"{mixed_dataset}: episodes 0, 1, 2 and 16 more of version 1 of the simulation",
        "in version 2, which this is (version 2: a rounder disc)",
        "Record again, or install the release",
        "--replays=0",
    ):
        assert part in problem


def test_the_index_command_tells_a_mixture_and_chooses_nothing_of_it(mixed_dataset, capsys):
    assert main(["index", str(mixed_dataset)]) == 0
    text = capsys.readouterr().out
    assert "simulation: version 1, 19 episodes; version 2, 4 episodes" in text
    assert "mixed: a scene's number means another scene in each version" in text
    assert main(["index", str(mixed_dataset), "--select=paired", "--flags"]) == 2
    assert "mixes versions of the simulation" in capsys.readouterr().err
