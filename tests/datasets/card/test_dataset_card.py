"""The card of a dataset: what it says, what it refuses, and that it is uploaded."""

import json
import os
import re
import shutil
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from huggingface_hub import DatasetCard
from PIL import Image

from lerobot_excav.datasets.card import contact_sheet, dataset_card
from lerobot_excav.datasets.card.dataset_card import CARD_PATH, PICTURE_PATH, write_card
from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.errors import DatasetError
from lerobot_excav.scripts.main import main

from ..toy import load
from .hub import hub

pytestmark = pytest.mark.slow

TOY = Path(__file__).parents[3] / "examples" / "toy_reach"


@pytest.fixture
def dataset(paired_dataset, tmp_path):
    return Path(shutil.copytree(paired_dataset, tmp_path / "digging"))


def test_a_card_says_what_is_in_the_dataset(dataset):
    write_card(dataset, replays=2)
    card = DatasetCard.load(dataset / CARD_PATH)
    assert set(card.data.tags) >= {"LeRobot", "toy_reach"}
    assert card.data.license == "apache-2.0"
    rows = dict(re.findall(r"^\| ([\w ]+) \| (.+) \|$", card.text, flags=re.MULTILINE))
    assert rows["Scenes"] == "5 of the set `train`, numbers 0 to 4"
    assert rows["Pairs"] == "5 starts, 4 of them with all their targets"
    assert rows["Episodes"].startswith("19; ")
    assert rows["Commanded by"] == "a script: 19"
    assert rows["Successes"] == "19 of 19"
    assert rows["Quality check"] == "19 of 19 episodes passed; 2 were replayed, state by state"
    assert f"({PICTURE_PATH.as_posix()})" in card.text
    assert (
        "More Information Needed"
        not in card.text.split("## Dataset Structure")[0].split("## Dataset Description")[1].split("- **Homepage")[0]
    )


def test_its_picture_shows_two_starts_with_all_their_targets(dataset, paired_dataset):
    write_card(dataset, replays=0)
    picture = np.asarray(Image.open(dataset / PICTURE_PATH))
    tiles = load(paired_dataset)[0]["observation.images.main"].shape[1:]
    assert picture.shape[:2] == (round(1024 / (4 * tiles[1]) * 2 * tiles[0]), 1024)
    columns = np.split(picture[: len(picture) // 2].astype(int), 4, axis=1)
    assert all(np.abs(a - b).max() > 50 for a, b in pairwise(columns))  # other targets


def test_a_picture_of_unequal_starts_has_white_places(paired_dataset):
    index = pd.read_parquet(paired_dataset / "meta" / "excav_pairs.parquet")
    few = index[(index["scene_id"] == 0) | ((index["scene_id"] == 1) & (index["target_id"] < 2))]
    picture = np.asarray(contact_sheet.contact_sheet(paired_dataset, few))
    low = picture[len(picture) // 2 + 2 :]
    assert (low[20:, low.shape[1] // 2 + 20 :] == 255).all()


def test_a_card_can_be_written_again_and_passes_the_check(dataset):
    write_card(dataset, replays=0)
    write_card(dataset, title="Another title", replays=0)
    assert "### Another title" in (dataset / CARD_PATH).read_text()
    assert check_dataset(dataset, replays=0).has_passed


def test_a_readme_of_somebody_else_stays(dataset):
    (dataset / CARD_PATH).write_text("Mine.")
    with pytest.raises(DatasetError, match=r"README\.md was not written by lerobot-excav card; move it away"):
        write_card(dataset)
    assert (dataset / CARD_PATH).read_text() == "Mine."
    assert not (dataset / PICTURE_PATH).exists()


def test_a_dataset_that_fails_its_check_gets_no_card(dataset):
    (dataset / "meta" / "stats.json").write_text("{}")
    with pytest.raises(DatasetError, match="does not pass the quality check"):
        write_card(dataset, replays=0)
    assert not (dataset / CARD_PATH).exists()


@pytest.mark.parametrize(
    ("numbers", "words"), [([0], "0"), ([3, 1, 2, 7], "1 to 3, 7"), ([0, 2, 4], "0, 2, 4"), ([5, 6], "5 to 6")]
)
def test_numbers_are_written_as_ranges(numbers, words):
    assert dataset_card._ranges(numbers) == words


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--push_to=digging"], r"--push_to=digging is not USER/NAME"),
        (["--push_to=some one/digging"], "is not USER/NAME"),
        (["--private=true"], "--private is of use with --push_to only"),
    ],
)
def test_the_command_refuses_what_has_no_effect(dataset, capsys, flags, words):
    assert main(["card", str(dataset), *flags]) == 2
    assert re.search(words, capsys.readouterr().err)
    assert not (dataset / CARD_PATH).exists()


@pytest.mark.slow
def test_a_dataset_is_uploaded_with_its_card_and_can_be_used_from_there(dataset, tmp_path):
    flags = ("--replays=0", "--title=Digging", "--push_to=someone/digging", "--private=true")
    # The Hub's library checks the head of a card at an address that cannot be set otherwise.
    program = "import sys, toy_reach.spec; from huggingface_hub.repocard import RepoCard; "
    program += "RepoCard.validate = lambda *given, **named: None; "
    program += "from lerobot_excav.scripts.main import main; sys.exit(main(sys.argv[1:]))"
    with hub() as server:
        environment = {"HF_ENDPOINT": server.address, "HF_TOKEN": "hf_stand_in", "HF_HUB_OFFLINE": "0"}
        done = subprocess.run(
            [sys.executable, "-c", program, "card", str(dataset), *flags],
            env=os.environ | environment | {"PYTHONPATH": os.pathsep.join([str(TOY), *sys.path])},
            capture_output=True, text=True, encoding="utf-8", check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr[-2000:]
    assert "uploaded to someone/digging" in done.stdout
    assert "private" in json.dumps(server.created)
    assert ("POST", "datasets/someone/digging/tag/main") in server.asked  # LeRobot finds a dataset by its version's tag
    received = tmp_path / "received"
    for name, content in server.files.items():
        (received / name).parent.mkdir(parents=True, exist_ok=True)
        (received / name).write_bytes(content)
    names = {path.relative_to(dataset) for path in dataset.rglob("*") if path.is_file()}
    assert {path.relative_to(received) for path in received.rglob("*") if path.is_file()} - names <= {
        Path(".gitattributes")
    }
    assert names <= {path.relative_to(received) for path in received.rglob("*")}
    assert "### Digging" in (received / CARD_PATH).read_text()
    assert check_dataset(received, replays=2).has_passed
    assert load(received).num_episodes == 19
