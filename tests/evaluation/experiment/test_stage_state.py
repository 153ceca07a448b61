"""A chain of two stages, `train` and `test`, and what becomes of it when the file or a result changes."""

import json
import shutil

import pytest

from lerobot_excav.evaluation.experiment.runner import run_experiment
from lerobot_excav.evaluation.experiment.stage_record import record_path
from lerobot_excav.evaluation.experiment.stage_state import state

CHAIN = """
steps = 1
[environment]
SEED = "1"
[[stage]]
name = "train"
makes = "{tmp}/train"
command = "mkdir {makes} && echo {steps} > {makes}/weights"
[[stage]]
name = "test"
needs = ["train"]
makes = "{tmp}/test"
command = "cp -r {tmp}/train {makes}"
"""


def run(experiment, *only):
    said = []
    assert run_experiment(experiment, experiment.select(only), jobs=1, say=said.append)
    return "\n".join(said)


def states(experiment):
    return [state(experiment, stage) for stage in experiment.stages]


@pytest.fixture
def chain(experiment):
    finished = experiment(CHAIN)
    run(finished)
    return finished


def test_a_result_is_outdated_when_what_it_was_made_from_has_been_made_anew(chain, tmp_path):
    assert states(chain) == ["finished", "finished"]
    shutil.rmtree(tmp_path / "train")
    run(chain, "train")
    assert states(chain) == ["finished", "outdated"]
    assert "test is finished, but was made from a result that has been made anew since; remove it" in run(
        chain
    )
    shutil.rmtree(tmp_path / "test")
    run(chain)
    assert states(chain) == ["finished", "finished"]


def test_a_stage_that_works_on_a_changed_result_says_so(chain, experiment, tmp_path):
    changed = experiment(CHAIN, steps="2")
    shutil.rmtree(tmp_path / "test")
    said = run(changed, "test")
    assert f"! test: works on {tmp_path}/train, which was made by another command" in said


def test_a_result_of_another_environment_is_changed(chain, experiment):
    assert states(experiment(CHAIN.replace('SEED = "1"', 'SEED = "2"'))) == ["changed", "changed"]


@pytest.mark.parametrize("name", ["train", "test"])
def test_a_result_without_a_record_is_trusted(chain, tmp_path, name):
    record_path(tmp_path / name).unlink()
    assert states(chain) == ["finished", "finished"]


def test_a_record_from_before_needs_were_told_is_trusted(chain, tmp_path):
    path = record_path(tmp_path / "test")
    content = json.loads(path.read_text())
    del content["needs"], content["training"]
    path.write_text(json.dumps(content))
    assert states(chain) == ["finished", "finished"]
