"""The commands of every experiment are ones that their programs would accept."""

import re
import shlex
from importlib import import_module
from pathlib import Path

import draccus
import pytest
from lerobot.configs.eval import EvalPipelineConfig
from lerobot.configs.train import TrainPipelineConfig

import lerobot_excav.plugin  # noqa: F401 - registers what the commands name
from lerobot_excav.evaluation.experiment.experiment import read_experiment
from lerobot_excav.evaluation.result_page.contents import read_contents
from lerobot_excav.scripts.main import command_parser

ROOT = Path(__file__).parents[1]
FILES = sorted((ROOT / "experiments").glob("*/stages.toml"))
STAGES = [(path, stage) for path in FILES for stage in read_experiment(path).stages]
EPISODE_FLAGS = "--dataset.episodes=[0,1,2,3] --dataset.eval_split=0.25"


def commands(stage):
    """Cut the command of a stage into the commands that it runs, as words."""
    text = re.sub(r"flags=\$\((.*?)\)", r"\1", stage.command).replace("$flags", EPISODE_FLAGS)
    return [shlex.split(part) for part in text.split("&&")]


def parse(words):
    program, *options = words
    if program == "lerobot-excav":
        name, *options = options
        module = import_module(f"lerobot_excav.scripts.{name}")
        return command_parser(name, module).parse_args(options)
    if program == "lerobot-train":
        return draccus.parse(TrainPipelineConfig, args=options)
    assert program == "lerobot-eval"
    # LeRobot itself reads --policy.* from the checkpoint, which is not there yet.
    assert any(option.startswith("--policy.path=") for option in options)
    options = [option for option in options if not option.startswith("--policy.")]
    return draccus.parse(EvalPipelineConfig, args=options)


@pytest.mark.parametrize(("path", "stage"), STAGES, ids=[f"{p.parent.name}-{s.name}" for p, s in STAGES])
def test_commands_are_accepted_by_their_programs(path, stage, monkeypatch):
    monkeypatch.setattr("sys.argv", ["test"])  # LeRobot looks there, too
    for words in commands(stage):
        parse(words)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.parent.name)
def test_no_stage_trains_on_test_scenes_or_evaluates_on_training_scenes(path):
    for stage in read_experiment(path).stages:
        for words in commands(stage):
            if words[0] == "lerobot-eval":
                (scene_set,) = [word for word in words if word.startswith("--env.scene_set=")]
                assert scene_set.split("=")[1] == stage.name.split("-")[0]
            else:
                assert not any(word.startswith("--scene-set") for word in words)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.parent.name)
def test_the_page_shows_what_the_stages_make(path):
    made = {str(stage.makes) for stage in read_experiment(path).stages}
    contents = read_contents(path.with_name("rows.toml"))
    for row in contents.rows:
        assert f"{contents.metrics}/{row.label}" in made
    for curve in contents.curve:
        assert any(folder.startswith(f"{curve.folder}/") for folder in made)
    shown = {curve.folder for curve in contents.curve} | {f"{contents.metrics}"}
    evaluated = {str(Path(folder).parent) for folder in made if "/val/" in folder or "/test/" in folder}
    assert evaluated <= shown


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.parent.name)
def test_another_output_folder_is_the_pages_as_well(path):
    experiment = read_experiment(path, {"out": "elsewhere"})
    options = parse(shlex.split(experiment.stage("report").command))
    contents = read_contents(options.rows, metrics=options.metrics)
    assert contents.metrics == "elsewhere/test"
    assert all(curve.folder.startswith("elsewhere/") for curve in contents.curve)


def test_the_examples_page_can_be_read():
    assert read_contents(ROOT / "examples" / "demo_fr5_rows.toml").rows
