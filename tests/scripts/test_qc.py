import shutil
from dataclasses import replace

import pytest
from lerobot_excav.datasets.record.environments import ENVIRONMENTS

from lerobot_excav.datasets.pairs.paired_index import build_index, store_index
from lerobot_excav.scripts.main import main


@pytest.fixture
def play_by(monkeypatch):
    """Let replays be played by another rig."""

    def use(rig):
        described = replace(ENVIRONMENTS["excavator"], rig=lambda **_: rig)
        monkeypatch.setitem(ENVIRONMENTS, "excavator", described)

    return use


@pytest.fixture
def dataset(paired_dataset, toy_rig, tmp_path, play_by):
    play_by(toy_rig())
    shutil.copytree(paired_dataset, tmp_path / "dataset")
    return tmp_path / "dataset"


def test_a_sound_dataset_ends_with_0(dataset, capsys):
    assert main(["qc", str(dataset), "--replays=2"]) == 0
    assert "19 of 19 episodes passed; 2 of them were replayed" in capsys.readouterr().out


def test_a_failed_episode_ends_with_1_and_is_tabled(dataset, toy_rig, play_by, capsys):
    play_by(toy_rig(noise=0.1))
    assert main(["qc", str(dataset), "--episodes=4", "--replays=1"]) == 1
    text = capsys.readouterr().out
    assert "excavator/train/1/0  replay leaves the recorded state" in text
    assert "1 of 1 episodes failed" in text


def test_the_seed_chooses_the_replays(dataset, toy_rig, play_by, capsys):
    play_by(toy_rig(noise=0.1))
    replayed = set()
    for seed in range(4):
        main(["qc", str(dataset), "--replays=1", f"--seed={seed}"])
        index = build_index(dataset)
        replayed.add(int(index[index["qc"] == "failed"]["episode_index"].iloc[0]))
        store_index(dataset, index.assign(qc="unchecked", qc_problem=""))
    assert len(replayed) > 1


def test_a_list_that_is_none_is_an_error_of_usage(dataset, capsys):
    with pytest.raises(SystemExit):
        main(["qc", str(dataset), "--episodes=a,b"])
    assert "'a,b' is no list of numbers" in capsys.readouterr().err
