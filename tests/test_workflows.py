"""The workflows plan their stages, and their commands are ones that the programs would accept."""

import ast
import json
import re
import shlex
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import draccus
import pytest
from lerobot.configs.eval import EvalPipelineConfig
from lerobot.configs.train import TrainPipelineConfig
from lerobot.scripts.lerobot_edit_dataset import EditDatasetConfig

import lerobot_excav.plugin  # noqa: F401 - registers what the commands name
from lerobot_excav.datasets.format.schema import COMMAND_KEY, excav_features
from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from lerobot_excav.evaluation.report_folder import LIST, ReportFolder
from lerobot_excav.evaluation.result_page.contents import read_contents
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.scripts.arguments import parse_arguments

ROOT = Path(__file__).parents[1]
SNAKEFILE = ROOT / "workflows" / "fr5_grasp" / "Snakefile"
EXCAVATOR = ROOT / "workflows" / "excavator" / "Snakefile"
EPISODE_FLAGS = "--dataset.episodes=[0,1,2,3] --dataset.eval_split=0.25"
PROGRAM = re.compile(r"(?:lerobot-excav|lerobot-train|lerobot-eval|lerobot-edit-dataset) .*")


def dry_run(snakefile, folder, *options):
    """Return what a dry run says it would do in a folder."""
    command = [sys.executable, "-m", "snakemake", "-s", str(snakefile), "--cores", "2", "-n", "-p"]
    done = subprocess.run([*command, "--config", *options], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    """The plan of the arm's workflow, in a folder where nothing has been done."""
    options = ("out=elsewhere", "results=elsewhere/page", "steps=2000")
    return dry_run(SNAKEFILE, tmp_path_factory.mktemp("plan"), *options)


@pytest.fixture(scope="module")
def dig_plan(tmp_path_factory):
    """The plan of the excavator's workflow, in a folder where nothing has been done."""
    return dry_run(EXCAVATOR, tmp_path_factory.mktemp("dig_plan"), "out=elsewhere", "results=page", "steps=2000")


def counts(plan):
    """Return how many jobs of every rule are planned."""
    return {name: int(number) for name, number in re.findall(r"^(\w+) +(\d+)$", plan, re.MULTILINE)}


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
    elif program == "lerobot-edit-dataset":
        draccus.parse(EditDatasetConfig, args=options)
    else:
        # LeRobot itself reads the policy from the checkpoint, which is not there yet.
        assert any(option.startswith("--policy.path=") for option in options)
        draccus.parse(EvalPipelineConfig, args=[o for o in options if not o.startswith("--policy.")])
        of_policy = [o.removeprefix("--policy.") for o in options if o.startswith("--policy.")]
        draccus.parse(MaskACTConfig, args=[f"--{o}" for o in of_policy if not o.startswith("path=")])


def test_every_stage_is_planned(plan):
    stages = {"data_shard": 7, "data": 7, "train": 13, "best": 1, "val": 4, "point": 4, "play_shard": 49, "test": 49}
    stages |= {"checkpoint": 1, "audit": 1, "report": 1, "all": 1}
    assert counts(plan) == {**stages, "total": sum(stages.values())}


def test_every_stage_of_the_excavator_is_planned(dig_plan):
    stages = {"data_shard": 9, "data": 9, "slim": 9, "train": 25, "checkpoint": 25, "operator": 9}
    stages |= {"play_shard": 534, "play": 89, "audit": 2, "report": 1, "all": 1}
    assert counts(dig_plan) == {**stages, "total": sum(stages.values())}


def test_only_what_the_page_of_the_arm_shows_is_drawn(plan):
    drawn = [
        " ".join(words)
        for words in commands(plan)
        if words[0] == "lerobot-eval" and "--env.render_every=1000" not in words
    ]
    clips = tomllib.loads(SNAKEFILE.with_name("rows.toml").read_text(encoding="utf-8"))["clips"]
    assert len(drawn) == len(clips)
    assert all(any(f"/{clip['label']}/" in command for command in drawn) for clip in clips)


NAMES_OF_PARTS = ("out", "workers", "output_dir", "env.metrics_path", "env.render_every")  # differ from part to part


def played(plan, command, first, number):
    """Return the scenes of every recording or evaluation, by what it is of."""
    scenes = {}
    for words in commands(plan):
        if words[: len(command)] == command:
            options = dict(word.lstrip("-").split("=", 1) for word in words[len(command) :])
            kind = tuple(value for name, value in options.items() if name not in (first, number, *NAMES_OF_PARTS))
            start = int(options[first])
            scenes.setdefault(kind, []).extend(range(start, start + int(options[number])))
    return {kind: sorted(numbers) for kind, numbers in scenes.items()}


@pytest.mark.parametrize(("name", "shards"), [("plan", (49, 4 * 49)), ("dig_plan", (63, 4 * 89))])
def test_shards_play_the_scenes_of_one_piece(name, shards, request, tmp_path):
    snakefile, page = {"plan": (SNAKEFILE, "elsewhere/page"), "dig_plan": (EXCAVATOR, "page")}[name]
    whole = request.getfixturevalue(name)
    options = ("out=elsewhere", f"results={page}", "steps=2000", "data_shards=7", "play_shards=4")
    sharded = dry_run(snakefile, tmp_path, *options)
    assert (counts(sharded)["data_shard"], counts(sharded)["play_shard"]) == shards
    for ways in ((["lerobot-excav", "demos"], "first_scene", "scenes"), (["lerobot-eval"], "seed", "eval.n_episodes")):
        assert played(sharded, *ways) == played(whole, *ways)
    assert all(len(scenes) == len(set(scenes)) for scenes in played(sharded, *ways).values())


@pytest.mark.parametrize("losses", [{1000: 0.31, 2000: 0.29, 3000: 0.3}, {}])
def test_the_best_checkpoint_is_that_of_the_smallest_loss_on_held_out_episodes(tmp_path, losses):
    checkpoints = tmp_path / "out" / "train" / "paper_channel" / "checkpoints"
    for step in (1000, 2000, 3000):
        (checkpoints / f"{step:06d}").mkdir(parents=True)
    (tmp_path / "out" / ".fr5_grasp_workflow").touch()
    log = "".join(f"INFO 2026 train.py:673 step {step}: eval_loss={loss:.4f}\n" for step, loss in losses.items())
    (tmp_path / "out" / "train" / "paper_channel.log").write_text(log)
    (tmp_path / "out" / "train" / "paper_channel.done").touch()
    command = [sys.executable, "-m", "snakemake", "-s", str(SNAKEFILE), "--cores", "1", "--config", "out=out"]
    command += ["--", "out/train/paper_channel.best"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    if losses:
        assert (checkpoints / "best").resolve().name == "002000", done.stderr
    else:
        assert done.returncode != 0
        assert "tells no loss on held-out episodes" in done.stdout + done.stderr
        assert not (tmp_path / "out" / "train" / "paper_channel.best").exists()


def test_what_has_landed_is_not_planned_again(tmp_path):
    """A row needs neither its data nor its training any more, and a checkpoint not its training."""
    for policy, seed, tasks in (("paired_token", 1000, ("scoop", "clear")), ("no_condition", 1002, ("scoop",))):
        (tmp_path / "page" / "checkpoints" / f"{policy}-{seed}").mkdir(parents=True)
        (tmp_path / "page" / "metrics").mkdir(exist_ok=True)
        for task in tasks:
            (tmp_path / "page" / "metrics" / f"{task}_{policy}-{seed}.jsonl").touch()
    plan = dry_run(EXCAVATOR, tmp_path, "out=elsewhere", "results=page")
    assert {name: counts(plan)[name] for name in ("train", "checkpoint", "play")} == {
        **{"train": 23, "checkpoint": 23, "play": 86},
    }


def test_rows_of_the_arm_that_have_landed_need_no_training(tmp_path):
    """The trainings of the others are planned, and the points of curves that are missing."""
    metrics = tmp_path / "page" / "metrics"
    (metrics / "curves" / "paired_channel").mkdir(parents=True)
    (metrics / "curves" / "paired_channel" / "001000.jsonl").touch()
    for policy in ("box_token", "no_condition", "nearest_token"):
        (metrics / f"{policy}.jsonl").touch()
    (tmp_path / "page" / "audit").mkdir()
    (tmp_path / "page" / "audit" / "audit.json").touch()
    plan = dry_run(SNAKEFILE, tmp_path, "out=elsewhere", "results=page")
    planned = {"train": 10, "val": 9, "point": 9, "test": 46}
    assert {name: counts(plan)[name] for name in planned} == planned
    assert not {"audit", "checkpoint"} & set(counts(plan))


def test_all_methods_of_the_excavator_are_trained_alike(dig_plan):
    """But for their data, their masks and their seed; three kinds of data differ in the number of demonstrations.

    The many changes of mind are trained for twice as many steps.
    """
    own = ("--seed=", "--dataset.", "--output_dir=", "--policy.target_token=", "--policy.withhold_mask=")
    lengths = {"--steps=2000", "--steps=4000"}
    trainings = [words for words in commands(dig_plan) if words[0] == "lerobot-train" and lengths & set(words)]
    shared = {tuple(word for word in words if not word.startswith((*own, "--steps="))) for words in trainings}
    assert (len(trainings), len(shared)) == (25, 1)
    longer = [Path(words[-1]).name for words in trainings if "--steps=4000" in words]
    often = [f"changing_often_token-{seed}" for seed in (1000, 1001, 1002)]
    assert sorted(longer) == ["changing_late_token-1000", *often]
    recordings = [words for words in commands(dig_plan) if words[:2] == ["lerobot-excav", "demos"]]
    options = [dict(word.lstrip("-").split("=", 1) for word in words[2:]) for words in recordings]
    recorded = {Path(each["out"]).parent.name: 2 * int(each["scenes"]) * int(each["targets"]) for each in options}
    others = {name: number for name, number in recorded.items() if number != 240}
    assert others == {"half": 120, "double": 480, "changing_often": 480, "changing_late": 480}
    assert len({each["stages"] for each in options}) == 1


def test_the_slim_copy_leaves_out_every_column_that_no_policy_reads(dig_plan):
    """A policy reads where commands change, if they do."""
    copies = [words for words in commands(dig_plan) if "--operation.type=remove_feature" in words]
    assert len(copies) == 9
    for words in copies:
        options = dict(word.lstrip("-").split("=", 1) for word in words[1:])
        read = {COMMAND_KEY} if options["repo_id"].startswith("local/excavator_changing") else set()
        assert sorted(ast.literal_eval(options["operation.feature_names"])) == sorted(set(excav_features(SCOOP)) - read)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plan", "dig_plan"])
def test_commands_are_accepted_by_their_programs(name, request, monkeypatch):
    monkeypatch.setattr("sys.argv", ["test"])  # LeRobot looks there, too
    found = commands(request.getfixturevalue(name))
    assert {words[0] for words in found} >= {"lerobot-excav", "lerobot-train", "lerobot-eval"}
    # Commands of one program with the same options differ in names and seeds only; reading one takes half a second.
    kinds = {(words[0], *(word.split("=")[0] for word in words[1:])): words for words in found}
    for words in kinds.values():
        parse(words)


def test_test_scenes_are_for_the_table_and_training_scenes_for_training(plan):
    for words in commands(plan):
        sets = [word.partition("=")[2] for word in words if word.startswith("--env.scene_set=")]
        folder = next((word for word in words if word.startswith("--output_dir=")), "")
        if words[0] == "lerobot-eval":
            assert sets == [{"play": "test"}.get(name := Path(folder.partition("=")[2]).parts[1], name)]
        else:
            assert not sets


def test_the_page_shows_what_the_stages_make(plan):
    metrics = Path("elsewhere/page/metrics")
    contents = read_contents(SNAKEFILE.with_name("rows.toml"), metrics=metrics)
    made = {Path(path) for path in re.findall(rf"output: ({metrics}/\S+\.jsonl)", plan)}
    rows = {metrics / f"{row.label}.jsonl" for row in contents.rows}
    assert rows <= made
    assert {curve.folder for curve in contents.curve} == {str(path.parent) for path in made - rows}


def test_the_page_of_the_excavator_shows_what_the_stages_make(dig_plan):
    contents = read_contents(EXCAVATOR.with_name("rows.toml"), metrics=Path("page/metrics"))
    made = {Path(path).stem for path in re.findall(r"output: (page/metrics/\S+\.jsonl)", dig_plan)}
    assert made == {name for row in contents.rows for name in row.names}


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
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    of_others = ("audit/", "metrics/")
    assert {path for path in there if not path.startswith(of_others)} - {LIST} <= set(ReportFolder(folder).own) <= there
    contents = read_contents(SNAKEFILE.with_name("rows.toml"), metrics=folder / "metrics")
    landed = {path for row in contents.rows for path in contents.metrics_paths(row).values()}
    assert landed == set((folder / "metrics").glob("*.jsonl"))
    rows = [json.loads(line) for line in (folder / "rows.jsonl").read_text().splitlines()]
    assert {name for row in rows for name in row["origins"]} == {path.stem for path in landed}
    assert all(list(Path(curve.folder).glob("*.jsonl")) for curve in contents.curve)


def test_the_page_of_the_excavator_has_a_row_for_all_metrics_that_have_landed():
    folder = ROOT / "results" / "excavator"
    contents = read_contents(EXCAVATOR.with_name("rows.toml"), metrics=folder / "metrics")
    landed = {path for row in contents.rows for path in contents.metrics_paths(row).values()}
    assert landed == set((folder / "metrics").glob("*.jsonl"))
    for path in landed:
        policy = json.loads(path.with_suffix(".json").read_text())["policy"]
        assert policy is None or (not Path(policy).is_absolute() and (ROOT / policy).is_dir())
    rows = [json.loads(line) for line in (folder / "rows.jsonl").read_text().splitlines()]
    assert {name for row in rows for name in row["origins"]} == {path.stem for path in landed}


TRAINED_LONGER = ("changing_often_token", "changing_late_token")


def test_the_checkpoints_that_have_landed_were_trained_as_the_table_says():
    defaults = dict(re.findall(r'config\.get\("(steps|batch_size)", (\d+)\)', EXCAVATOR.read_text()))
    folders = list((ROOT / "results" / "excavator" / "checkpoints").iterdir())
    assert folders
    for folder in folders:
        training = json.loads((folder / "training.json").read_text())
        policy, _, seed = folder.name.rpartition("-")
        longer = {"steps": str(2 * int(defaults["steps"]))} if policy in TRAINED_LONGER else {}
        asked = {**defaults, **longer, "seed": seed}
        assert {name: str(training[name]) for name in asked} == asked
        number = ({"half_token": 120} | dict.fromkeys(("double_token", *TRAINED_LONGER), 480)).get(policy, 240)
        assert training["demonstrations"] == number
        assert training["name"] == folder.name
        weighs = sum(path.stat().st_size for path in folder.iterdir())
        assert weighs < 6_000_000
