"""The workflows plan their stages, and their commands are ones that the programs would accept."""

import re
import shlex
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import draccus
import pytest
from lerobot.configs.eval import EvalPipelineConfig
from lerobot.configs.train import TrainPipelineConfig

import lerobot_excav.plugin  # noqa: F401 - registers what the commands name
from lerobot_excav.evaluation.report_folder import LIST, ReportFolder
from lerobot_excav.evaluation.result_page.contents import read_contents
from lerobot_excav.scripts.arguments import parse_arguments

ROOT = Path(__file__).parents[1]
SNAKEFILE = ROOT / "workflows" / "fr5_grasp" / "Snakefile"
EPISODE_FLAGS = "--dataset.episodes=[0,1,2,3] --dataset.eval_split=0.25"
PROGRAM = re.compile(r"(?:lerobot-excav|lerobot-train|lerobot-eval) .*")


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    """What a dry run says it would do, in a folder where nothing has been done."""
    folder = tmp_path_factory.mktemp("plan")
    command = [sys.executable, "-m", "snakemake", "-s", str(SNAKEFILE), "--cores", "2", "-n", "-p"]
    options = ["--config", "out=elsewhere", "results=elsewhere/page", "steps=2000"]
    done = subprocess.run([*command, *options], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def commands(plan):
    """Return the planned commands, as words, without what a log is told of them."""
    found = set()
    for line in PROGRAM.findall(re.sub(r"^ *said=.*", "", plan, flags=re.MULTILINE)):
        line = re.sub(r"\)? *>>? .*", "", line).replace("$flags", EPISODE_FLAGS).replace("$config", "c.json")
        found |= set(line.replace(") && ", " && ").split(" && "))
    return [shlex.split(command) for command in sorted(found)]


def parse(words):
    program, *options = words
    if program == "lerobot-excav":
        name, *options = options
        module = import_module(f"lerobot_excav.scripts.{name}")
        parse_arguments(module.ARGUMENTS, options, command=name, description="")
    elif program == "lerobot-train":
        # A training that continues finds its dataset in its file, which is not there yet.
        options = ["--dataset.repo_id=a/b" if o.startswith("--config_path=") else o for o in options]
        draccus.parse(TrainPipelineConfig, args=options)
    else:
        # LeRobot itself reads --policy.* from the checkpoint, which is not there yet.
        assert any(option.startswith("--policy.path=") for option in options)
        draccus.parse(EvalPipelineConfig, args=[o for o in options if not o.startswith("--policy.")])


def test_every_stage_is_planned(plan):
    counts = {name: int(number) for name, number in re.findall(r"^(\w+) +(\d+)$", plan, re.MULTILINE)}
    stages = {"data": 3, "train": 5, "val": 4, "test": 22, "checkpoint": 1, "report": 1, "all": 1}
    assert counts == {**stages, "total": sum(stages.values())}


@pytest.mark.slow
def test_commands_are_accepted_by_their_programs(plan, monkeypatch):
    monkeypatch.setattr("sys.argv", ["test"])  # LeRobot looks there, too
    found = commands(plan)
    assert {words[0] for words in found} == {"lerobot-excav", "lerobot-train", "lerobot-eval"}
    for words in found:
        parse(words)


def test_test_scenes_are_for_the_table_and_training_scenes_for_training(plan):
    for words in commands(plan):
        sets = [word.partition("=")[2] for word in words if word.startswith("--env.scene_set=")]
        folder = next((word for word in words if word.startswith("--output_dir=")), "")
        if words[0] == "lerobot-eval":
            assert sets == [Path(folder.partition("=")[2]).parts[1]]
        else:
            assert not sets


def test_the_page_shows_what_the_stages_make(plan):
    contents = read_contents(SNAKEFILE.with_name("rows.toml"), metrics=Path("elsewhere/test"))
    made = {Path(path).parent for path in re.findall(r"output: (\S+/metrics\.jsonl)", plan)}
    rows = {Path("elsewhere/test") / row.label for row in contents.rows}
    curves = {folder for folder in made if str(folder.parent) in {curve.folder for curve in contents.curve}}
    assert rows <= made
    assert rows | curves == made
    assert {curve.folder for curve in contents.curve} == {str(folder.parent) for folder in curves}


@pytest.mark.slow
def test_the_workflow_stays_out_of_a_folder_that_it_has_not_made(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("years of work")
    command = [sys.executable, "-m", "snakemake", "-s", str(SNAKEFILE), "--cores", "1", "--config", "out=out"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "out=out holds something that this workflow has not made" in done.stdout + done.stderr
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize("script", ["demo.sh", "demo_fr5.sh", "tutorial.sh"])
def test_a_demo_stays_out_of_a_folder_that_it_has_not_made(tmp_path, script):
    mine = [tmp_path / "out" / name / "thesis.tex" for name in ("train", "eval", "play", "correct", "mismatched")]
    for path in mine:
        path.parent.mkdir(parents=True)
        path.write_text("years of work")
    command = ["bash", str(ROOT / "examples" / script), str(tmp_path / "out")]
    # Without a search path nothing of ours can start.
    done = subprocess.run(command, cwd=ROOT, env={"PATH": "/usr/bin:/bin"}, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "holds something that this script has not made" in done.stderr
    assert all(path.exists() for path in mine)


def test_the_page_of_the_demo_can_be_read():
    assert read_contents(ROOT / "examples" / "demo_fr5_rows.toml").rows


def test_the_landed_page_is_made_of_what_lies_beside_it():
    folder = ROOT / "results" / "fr5_grasp"
    listed = set(ReportFolder(folder).own)
    assert listed == {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()} - {LIST}
    contents = read_contents(SNAKEFILE.with_name("rows.toml"), metrics=folder / "metrics")
    assert all(contents.metrics_path(row.label).is_file() for row in contents.rows)
    assert all(list(Path(curve.folder).glob("*.jsonl")) for curve in contents.curve)
