import json

import pytest

from lerobot_excav.evaluation.training import read_training
from lerobot_excav.evaluation.training_log import training_minutes

START = "INFO 2026-01-01 {} ot_train.py:597 Start offline training on a fixed dataset, with effective batch size: 16\n"
SAVED = (
    "Training:  72%|##| 9/9 [1:00<2:00]INFO 2026-01-01 {} ot_train.py:687 Checkpoint policy after step {}\n"
)


def test_minutes_count_from_the_first_step(tmp_path):
    log = tmp_path / "t.log"
    log.write_text("INFO 2026-01-01 11:00:00 x Creating dataset\n" + START.format("12:00:00"))
    assert training_minutes(log) == {}
    with log.open("a") as file:
        file.write(SAVED.format("12:10:00", 900) + SAVED.format("12:20:30", 1800))
    assert training_minutes(log) == {900: 10.0, 1800: 20.5}


def test_a_continued_training_goes_on_from_its_last_checkpoint(tmp_path):
    log = tmp_path / "t.log"
    log.write_text(
        START.format("12:00:00")
        + SAVED.format("12:10:00", 900)
        + "\nKilled\n"
        + START.format("15:00:00")
        + SAVED.format("15:05:00", 1800)
    )
    assert training_minutes(log) == {900: 10.0, 1800: 15.0}


def test_a_checkpoint_that_was_lost_while_it_was_saved_costs_no_time(tmp_path):
    log = tmp_path / "t.log"
    first = START.format("12:00:00") + SAVED.format("12:10:00", 900) + SAVED.format("12:20:00", 1800)
    log.write_text(first + START.format("15:00:00") + SAVED.format("15:11:00", 1800))
    assert training_minutes(log) == {900: 10.0, 1800: 21.0}


def test_a_training_that_began_anew_owes_nothing_to_the_one_before(tmp_path):
    log = tmp_path / "t.log"
    discarded = START.format("12:00:00") + SAVED.format("12:10:00", 900) + SAVED.format("12:20:00", 1800)
    log.write_text(discarded + START.format("15:00:00") + SAVED.format("15:11:00", 900))
    assert training_minutes(log)[900] == 11.0


def test_without_a_log_nothing_is_known(tmp_path):
    assert training_minutes(tmp_path / "none.log") == {}


@pytest.fixture
def checkpoint(tmp_path):
    """A checkpoint of 50 steps, with a dataset of 7 episodes beside it."""
    folder = tmp_path / "mine" / "checkpoints" / "000050"
    (folder / "pretrained_model").mkdir(parents=True)
    (folder / "training_state").mkdir()
    (folder / "training_state" / "training_step.json").write_text('{"step": 50, "batch_size": 4}')
    (tmp_path / "data" / "meta").mkdir(parents=True)
    (tmp_path / "data" / "meta" / "info.json").write_text('{"total_episodes": 7}')
    dataset = {"repo_id": "local/data", "root": str(tmp_path / "data"), "episodes": None, "eval_split": 0.0}
    config = {"dataset": dataset, "batch_size": 4, "seed": 3}
    (folder / "pretrained_model" / "train_config.json").write_text(json.dumps(config))
    (tmp_path / "mine" / "checkpoints" / "last").symlink_to("000050")
    return folder


def test_a_checkpoint_tells_how_it_was_trained(checkpoint, tmp_path):
    training = read_training(checkpoint.parent / "last" / "pretrained_model")
    assert (training.name, training.dataset, training.demonstrations) == ("mine", "data", 7)
    assert (training.steps, training.samples, training.seed, training.held_out) == (50, 200, 3, 0)
    assert (training.minutes, training.command, training.commit) == (None, None, None)


def test_chosen_episodes_count_as_demonstrations_held_out_ones_among_them(checkpoint):
    path = checkpoint / "pretrained_model" / "train_config.json"
    config = json.loads(path.read_text())
    config["dataset"] |= {"episodes": [1, 2, 3, 4, 5], "eval_split": 0.3}
    path.write_text(json.dumps(config))
    training = read_training(checkpoint / "pretrained_model")
    assert (training.demonstrations, training.held_out) == (5, 2)


def test_what_is_no_checkpoint_tells_nothing(tmp_path):
    assert read_training(tmp_path) is None
