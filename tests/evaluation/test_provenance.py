import json
import shutil
import sys

import pytest

from lerobot_excav.envs.configs.provenance import write_provenance
from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.provenance import EvaluationOrigin


@pytest.fixture
def evaluation(write_training, tmp_path, monkeypatch):
    """Evaluate the checkpoint `last` of 5000 steps; returns the metrics file."""
    last = write_training("mine", 5000).parent / "last"
    last.symlink_to("005000")
    monkeypatch.setattr(sys, "argv", ["/bin/lerobot-eval", f"--policy.path={last}/pretrained_model", "--x=a b"])
    write_provenance(tmp_path / "metrics.jsonl")
    return tmp_path / "metrics.jsonl"


def test_an_evaluation_keeps_its_command_and_the_training_that_its_policy_had(evaluation, write_training, tmp_path):
    newer = write_training("mine", 10000)
    (newer.parent / "last").unlink()
    (newer.parent / "last").symlink_to(newer.name)
    origin = EvaluationOrigin.read(evaluation)
    last = tmp_path / "train" / "mine" / "checkpoints" / "last"
    assert origin.command == f"lerobot-eval --policy.path={last}/pretrained_model '--x=a b'"
    assert origin.packages["lerobot"]
    assert origin.seconds >= 0.0
    assert origin.training.steps == 5000


def test_a_checkpoint_that_is_gone_leaves_the_training_open(evaluation, tmp_path):
    shutil.rmtree(tmp_path / "train")
    assert EvaluationOrigin.read(evaluation).training is None


def test_without_a_record_nothing_is_known(tmp_path):
    assert EvaluationOrigin.read(tmp_path / "m.jsonl") == EvaluationOrigin(command=None)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('{"command": "x"', "not JSON"),
        ('{"x": 1}', "lacks command"),
        ("3", "the whole=3: input should be an object"),
        ('{"command": "x", "training": {"speed": 3}}', r"training\.speed is not known; allowed: name, dataset"),
        ('{"command": "x", "seconds": "long"}', "seconds='long': input should be a valid number"),
    ],
)
def test_a_file_in_the_place_of_a_record_is_named(tmp_path, content, message):
    (tmp_path / "m.json").write_text(content)
    with pytest.raises(DatasetError, match=rf"m\.json: .*{message}"):
        EvaluationOrigin.read(tmp_path / "m.jsonl")


def test_a_record_grows_with_its_file(evaluation):
    before = json.loads(evaluation.with_suffix(".json").read_text())
    write_provenance(evaluation)
    after = json.loads(evaluation.with_suffix(".json").read_text())
    assert after["started"] == before["started"]
    assert after["seconds"] >= before["seconds"]


@pytest.mark.parametrize("content", ['{"mine": 1}', '{"packages": {}, "name": "of npm"}', "{", "3", "[]"])
def test_what_is_not_a_record_is_kept(tmp_path, caplog, content):
    (tmp_path / "m.json").write_text(content)
    write_provenance(tmp_path / "m.jsonl")
    assert (tmp_path / "m.json").read_text() == content
    assert "m.json is not written" in caplog.text


def test_a_record_that_cannot_be_written_stops_nothing(tmp_path, caplog):
    write_provenance(tmp_path / "none" / "m.jsonl")
    assert "m.json is not written" in caplog.text
