import json

import pytest

from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.training import read_training
from lerobot_excav.evaluation.training_log import read_training_log

START = "INFO 2026-01-01 {} ot_train.py:597 Start offline training on a fixed dataset, with effective batch size: 16\n"
SAVED = "Training:  72%|##| 9/9 [1:00<2:00]INFO 2026-01-01 {} ot_train.py:687 Checkpoint policy after step {}\n"
BEGUN, AGAIN = START.format("12:00:00"), START.format("15:00:00")
FIRST = BEGUN + SAVED.format("12:10:00", 900)
LOST = FIRST + SAVED.format("12:20:00", 1800)
LOGS = {
    "nothing saved yet": (BEGUN, {}),
    "from the first step": ("INFO 2026-01-01 11:00:00 x Creating dataset\n" + FIRST, {900: 10.0}),
    "to each checkpoint": (FIRST + SAVED.format("12:20:30", 1800), {900: 10.0, 1800: 20.5}),
    "continued": (FIRST + "\nKilled\n" + AGAIN + SAVED.format("15:05:00", 1800), {900: 10.0, 1800: 15.0}),
    "what was lost costs no time": (LOST + AGAIN + SAVED.format("15:11:00", 1800), {900: 10.0, 1800: 21.0}),
    "begun again from nothing": (LOST + AGAIN + SAVED.format("15:11:00", 900), {900: 11.0, 1800: 20.0}),
}


@pytest.mark.parametrize(("text", "minutes"), LOGS.values(), ids=LOGS)
def test_minutes_count_what_led_to_a_checkpoint(tmp_path, text, minutes):
    (tmp_path / "t.log").write_text(text)
    assert read_training_log(tmp_path / "t.log").minutes == minutes


def test_a_log_tells_the_command_and_the_commit_that_began_it(tmp_path):
    (tmp_path / "t.log").write_text(f"# commit 0123abc\n$ lerobot-train --x=1\n{FIRST}$ lerobot-train --resume=true\n")
    log = read_training_log(tmp_path / "t.log")
    assert (log.command, log.commit) == ("lerobot-train --x=1", "0123abc")


@pytest.fixture
def checkpoint(tmp_path, write_training):
    """A checkpoint of 50 steps, with a dataset of 7 episodes beside it, and no log."""
    folder = write_training("mine", 50, dataset={"episodes": None, "eval_split": 0.0})
    (tmp_path / "train" / "mine.log").unlink()
    (tmp_path / "data" / "pairs" / "meta").mkdir(parents=True)
    (tmp_path / "data" / "pairs" / "meta" / "info.json").write_text('{"total_episodes": 7}')
    return folder / "pretrained_model"


def test_a_checkpoint_tells_how_it_was_trained(checkpoint):
    training = read_training(checkpoint)
    assert (training.name, training.dataset, training.demonstrations) == ("mine", "pairs", 7)
    assert (training.steps, training.samples, training.seed, training.held_out) == (50, 800, 1000, 0)
    assert (training.minutes, training.command, training.commit) == (None, None, None)


def test_chosen_episodes_count_as_demonstrations_held_out_ones_among_them(checkpoint):
    path = checkpoint / "train_config.json"
    config = json.loads(path.read_text())
    config["dataset"] |= {"episodes": [1, 2, 3, 4, 5], "eval_split": 0.3}
    path.write_text(json.dumps(config))
    training = read_training(checkpoint)
    assert (training.demonstrations, training.held_out) == (5, 2)


def test_what_is_not_a_checkpoint_tells_nothing(tmp_path):
    assert read_training(tmp_path) is None


def test_a_damaged_checkpoint_is_named(checkpoint):
    (checkpoint / "train_config.json").write_text('{"batch_size": 4}')
    with pytest.raises(DatasetError, match=r"train_config\.json: lacks dataset"):
        read_training(checkpoint)
