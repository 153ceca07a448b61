"""Every damage is told in a verdict that names it, and what is harmless is passed."""

import shutil

import pytest

from lerobot_excav.datasets.check import quality_check, readability
from lerobot_excav.scripts.main import main

from ..damage import HARMFUL, HARMLESS, SEEN_BY_LEROBOT_ALONE, VIDEOS

ALL_HARMFUL = {"image": HARMFUL, "video": VIDEOS}


@pytest.fixture
def copy(small_datasets, tmp_path):
    def make(storage="image"):
        shutil.copytree(small_datasets[storage], tmp_path / "d")
        return tmp_path / "d"

    return make


@pytest.mark.slow
@pytest.mark.parametrize(
    ("storage", "name"), [(storage, name) for storage, damages in ALL_HARMFUL.items() for name in damages]
)
def test_damage_is_a_verdict_that_names_it_and_no_index_hides_it(copy, capsys, monkeypatch, storage, name):
    # To open what is left takes most of the time, and it is not what is looked at.
    monkeypatch.setattr(readability, "opening_problem", lambda *_, **__: "")
    root, damage = copy(storage), ALL_HARMFUL[storage][name]
    damage.apply(root)
    assert main(["qc", str(root), "--replays=0"]) == 1
    assert damage.told in capsys.readouterr().out
    code = main(["index", str(root)])
    printed = capsys.readouterr()
    assert (code, bool(printed.out), bool(printed.err)) in ((0, True, False), (2, False, True))


def test_a_dataset_that_may_not_be_written_to_is_judged_all_the_same(copy, capsys, monkeypatch):
    monkeypatch.setattr(readability, "opening_problem", lambda *_, **__: "")
    root = copy()
    (root / "meta/excav_pairs.parquet").unlink()
    (root / "meta/excav_pairs.parquet").mkdir()
    assert main(["qc", str(root), "--replays=0"]) == 0
    assert "the verdicts are not noted in the index" in capsys.readouterr().err


def test_what_lerobot_alone_objects_to_is_told(copy, capsys):
    root = copy()
    SEEN_BY_LEROBOT_ALONE.apply(root)
    assert main(["qc", str(root), "--replays=0"]) == 1
    assert SEEN_BY_LEROBOT_ALONE.told in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("name", HARMLESS)
def test_what_is_harmless_is_passed(copy, capsys, name):
    root = copy()
    HARMLESS[name].apply(root)
    assert main(["qc", str(root), "--replays=0"]) == 0, capsys.readouterr().out
    assert main(["index", str(root)]) == 0


def test_several_damages_are_all_told(copy, capsys):
    root = copy()
    for name in ("no stats.json", "no tasks.parquet", "a truncated picture", "timestamps of 0", "version 99"):
        HARMFUL[name].apply(root)
    assert main(["qc", str(root), "--replays=0"]) == 1
    text = capsys.readouterr().out
    assert all(HARMFUL[name].told in text for name in ("no stats.json", "no tasks.parquet"))
    (line,) = (line for line in text.splitlines() if line.startswith("      2  toy_reach/train/1/"))
    assert all(HARMFUL[name].told in line for name in ("a truncated picture", "timestamps of 0", "version 99"))
    assert "4 of 4 episodes failed" in text


def test_sound_episodes_are_replayed_beside_damaged_ones(copy, capsys):
    root = copy()
    HARMFUL["black pictures"].apply(root)
    report = quality_check.check_dataset(root, replays=4)
    assert report.episodes["replayed"].tolist() == [True, True, False, True]
    assert report.episodes["qc"].tolist() == ["passed", "passed", "failed", "passed"]
