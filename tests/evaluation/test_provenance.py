import json
import shutil

import pytest

from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.experiment.stage import Stage
from lerobot_excav.evaluation.experiment.stage_record import record_path
from lerobot_excav.evaluation.experiment.stage_run import StageRun, lock_log
from lerobot_excav.evaluation.provenance import read_provenance


@pytest.fixture
def training(tmp_path):
    """A training that can be continued: `training(STEP)` saves a checkpoint."""

    def save(step):
        checkpoint = tmp_path / "train" / "checkpoints" / str(step)
        (checkpoint / "pretrained_model").mkdir(parents=True)
        (checkpoint / "training_state").mkdir()
        (checkpoint / "training_state" / "training_step.json").write_text(json.dumps({"step": step}))
        config = {"dataset": {"repo_id": "local/x", "root": None}, "batch_size": 4, "seed": 1}
        (checkpoint / "pretrained_model" / "train_config.json").write_text(json.dumps(config))
        last = checkpoint.with_name("last")
        last.unlink(missing_ok=True)
        last.symlink_to(str(step))

    return save


@pytest.fixture
def evaluation(training, tmp_path):
    """Evaluate the checkpoint `last` of 5000 steps; returns the metrics file."""
    training(5000)
    makes = tmp_path / "test"
    path = tmp_path / "train" / "checkpoints" / "last" / "pretrained_model"
    command = f"mkdir {makes}.partial && touch {makes}.partial/metrics.jsonl && : --policy.path={path}"
    stage = Stage(name="test", command=command, makes=makes)
    assert StageRun(stage, {}, lock_log(tmp_path / "test.log", "test"), needs={}).finish()
    return makes / "metrics.jsonl"


def test_an_evaluation_keeps_the_training_that_its_policy_had(evaluation, training, tmp_path):
    training(10000)
    assert read_provenance(evaluation).training.steps == 5000
    shutil.rmtree(tmp_path / "train")
    assert read_provenance(evaluation).training.steps == 5000


def test_a_record_without_a_training_looks_where_its_command_found_the_policy(evaluation, training):
    path = record_path(evaluation.parent)
    content = json.loads(path.read_text())
    del content["training"], content["needs"]
    path.write_text(json.dumps(content))
    training(10000)
    assert read_provenance(evaluation).training.steps == 10000


def test_a_training_of_another_version_is_named(evaluation):
    path = record_path(evaluation.parent)
    content = json.loads(path.read_text())
    content["training"]["speed"] = 3
    path.write_text(json.dumps(content))
    with pytest.raises(DatasetError, match=r"test\.json: its `training` has other entries .*: speed; remove"):
        read_provenance(evaluation)
