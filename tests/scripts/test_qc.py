import shutil

import pytest
import toy_reach.table

from lerobot_excav.datasets.pairs.paired_index import build_index, store_index
from lerobot_excav.scripts.main import main


@pytest.fixture
def dataset(paired_dataset, tmp_path):
    shutil.copytree(paired_dataset, tmp_path / "dataset")
    return tmp_path / "dataset"


@pytest.fixture
def another_simulation(monkeypatch):
    monkeypatch.setattr(toy_reach.table, "SPEED_M_S", 1.1)


def test_a_sound_dataset_ends_with_0(dataset, capsys):
    assert main(["qc", str(dataset), "--replays=2"]) == 0
    assert "19 of 19 episodes passed; 2 of them were replayed" in capsys.readouterr().out


def test_a_failed_episode_ends_with_1_and_is_tabled(dataset, another_simulation, capsys):
    assert main(["qc", str(dataset), "--episodes=[4,5]", "--replays=2"]) == 1
    text = capsys.readouterr().out
    assert "toy_reach/train/1/0/0  replay leaves the recorded state" in text
    assert "2 of 2 episodes failed" in text


@pytest.mark.slow
def test_the_seed_chooses_the_replays(dataset, another_simulation):
    replayed = set()
    for seed in range(4):
        main(["qc", str(dataset), "--replays=1", f"--seed={seed}"])
        index = build_index(dataset)
        replayed.add(int(index[index["qc"] == "failed"]["episode_index"].iloc[0]))
        store_index(dataset, index.assign(qc="unchecked", qc_problem=""))
    assert len(replayed) > 1
