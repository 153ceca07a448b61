"""The page about LeRobot's commands names every one of them, and tests that exist; commands that no other test runs."""

import ast
import logging
import re
import runpy
import shlex
import subprocess
import sys
from functools import partial
from importlib.metadata import distribution
from pathlib import Path

import draccus
import lerobot
import pytest
import toy_reach  # noqa: F401 - registers the task
from lerobot.configs.eval import EvalPipelineConfig
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.rollout.configs import RolloutStrategyConfig
from lerobot.scripts import (
    lerobot_calibrate,
    lerobot_edit_dataset,
    lerobot_eval,
    lerobot_imgtransform_viz,
    lerobot_info,
    lerobot_record,
    lerobot_setup_motors,
    lerobot_teleoperate,
)

import lerobot_excav.plugin  # noqa: F401
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.demonstrations import record_demonstrations
from lerobot_excav.envs.configs.fr5_grasp import FR5GraspEnvConfig
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.robots.recording_command import require_fitting_command

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/reference/lerobot_commands.md").read_text()
TEXTS = {str(path.relative_to(ROOT)): path.read_text() for path in [ROOT / "README.md", *ROOT.glob("docs/**/*.md")]}
ROWS = [
    [cell.strip() for cell in line.strip("| ").split(" | ")] for line in PAGE.splitlines() if line.startswith("| `")
]
CONFIGS = {"lerobot-record": lerobot_record.RecordConfig, "lerobot-teleoperate": lerobot_teleoperate.TeleoperateConfig}
CHECKPOINT = ROOT / "checkpoints/fr5_grasp_mask_act"
SMALL = ["--robot.type=fr5_sim", "--robot.observation_height=32", "--robot.observation_width=48"]


def test_every_command_strategy_and_operation_has_its_row():
    commands = {each.name for each in distribution("lerobot").entry_points if each.group == "console_scripts"}
    kinds = [RolloutStrategyConfig, lerobot_edit_dataset.OperationConfig]
    named = [name for kind in kinds for name in kind.get_known_choices()]
    first = [row[0] for row in ROWS]
    assert [name for name in [*sorted(commands), *named] if f"`{name}`" not in first] == []


def test_every_row_says_whether_it_works_and_which_existing_test_shows_it():
    for row in ROWS:
        tests = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", " ".join(row))
        works = [cell for cell in row if re.match(r"works", cell)]
        if row[0] not in ("`lerobot-rollout`", "`lerobot-edit-dataset`", "`lerobot-replay`"):
            assert tests or not works, row  # those have tables of their own, or a test that stands above
        for path, name in tests:
            functions = ast.walk(ast.parse((ROOT / path).read_text()))
            assert name in {each.name for each in functions if isinstance(each, ast.FunctionDef)}, f"{path}::{name}"


@pytest.mark.parametrize("name", TEXTS)
def test_commands_of_the_pages_that_drive_a_robot_are_accepted_by_it(name, tmp_path):
    shown = "\n".join(re.findall(r"^```bash\n(.*?)^```$", TEXTS[name], flags=re.DOTALL | re.MULTILINE))
    lines = shown.replace("\\\n", " ").splitlines()
    for line in lines:
        if not line.startswith((*CONFIGS, "lerobot-rollout")):
            continue
        program, *flags = shlex.split(line, comments=True)
        if program in CONFIGS:
            flags = [re.sub("mask_source=redness", "mask_source=oracle", flag) for flag in flags]
            config = draccus.parse(CONFIGS[program], args=flags)
            require_fitting_command(config.robot)
        elif any(f"--robot.type={robot}_sim" in flags for robot in ("excavator", "fr5")):
            assert {"--fps=10", "--dataset.fps=10", "--dataset.video=false"} <= set(flags)


@pytest.fixture
def run(monkeypatch):
    """Run a command of LeRobot's; it replaces the handlers of the root logger."""
    root = logging.getLogger()
    level, handlers = root.level, list(root.handlers)

    def _run(main, *flags):
        monkeypatch.setattr(sys, "argv", ["command", *flags])
        main()

    yield _run
    root.setLevel(level)
    root.handlers[:] = handlers


def folders(tmp_path, *kinds):
    return [f"--{kind}.calibration_dir={tmp_path}" for kind in kinds]


def test_a_robot_is_teleoperated(run, tmp_path, capsys):
    flags = [*SMALL, "--teleop.type=fr5_operator", *folders(tmp_path, "robot", "teleop")]
    run(lerobot_teleoperate.main, *flags, "--fps=50", "--teleop_time_s=0.1")
    assert "Teleop loop time" in capsys.readouterr().out


@pytest.mark.parametrize("flags", [SMALL, ["--teleop.type=excavator_operator"]])
def test_calibration_has_nothing_to_do(run, tmp_path, flags):
    kind = "robot" if flags is SMALL else "teleop"
    run(lerobot_calibrate.main, *flags, *folders(tmp_path / "calibration", kind))
    assert list((tmp_path / "calibration").iterdir()) == []


def test_a_simulation_has_no_motors_to_set_up(run, tmp_path):
    with pytest.raises(NotImplementedError, match="'fr5_sim' does not support motor setup"):
        run(lerobot_setup_motors.main, *SMALL, *folders(tmp_path, "robot"))


def test_the_system_is_described(run, capsys):
    run(lerobot_info.main)
    assert "lerobot scripts" in capsys.readouterr().out


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """A scene of the example task with its 4 targets."""
    settings = DemonstrationSettings.of("toy_reach", {"observation_height": 32, "observation_width": 48}, scenes=1)
    root = tmp_path_factory.mktemp("commands") / "data"
    record_demonstrations(settings, root, workers=0, show_progress=False)
    return root


def test_image_transforms_are_shown(run, dataset, tmp_path, monkeypatch):
    opened = partial(LeRobotDataset, root=dataset)  # the command itself looks into HF_LEROBOT_HOME only
    monkeypatch.setattr(lerobot_imgtransform_viz, "LeRobotDataset", opened)
    monkeypatch.chdir(tmp_path)
    run(lerobot_imgtransform_viz.main, "--repo_id=local/data", "--image_transforms.enable=true")
    assert len(list(tmp_path.rglob("*.png"))) > 10


@pytest.mark.slow
def test_a_dataset_is_visualised(dataset, tmp_path):
    pytest.importorskip("rerun", reason="the extra viz")
    flags = ["--repo-id=local/data", f"--root={dataset}", "--episode-index=0", "--save=1", f"--output-dir={tmp_path}"]
    # In a process of its own: the recording that it opens cannot be closed.
    command = [sys.executable, "-m", "lerobot.scripts.lerobot_dataset_viz", *flags]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert list(tmp_path.glob("*.rrd"))


def eval_flags(tmp_path, *flags):
    policy = [f"--policy.path={CHECKPOINT}", "--policy.device=cpu", f"--output_dir={tmp_path / 'out'}"]
    return [*policy, "--env.type=fr5_grasp", *flags]


def test_parallel_tasks_are_refused(run, tmp_path, capsys):
    with pytest.raises(SystemExit):
        run(lerobot_eval.main, *eval_flags(tmp_path, "--env.max_parallel_tasks=2"))
    assert "env.max_parallel_tasks=2 is not possible; give one of 1" in capsys.readouterr().err


@pytest.mark.parametrize(("episodes", "refused"), [(1, False), (2, True)])
def test_the_recording_of_several_batches_is_refused(monkeypatch, tmp_path, episodes, refused):
    flags = ["--eval.recording=true", f"--eval.n_episodes={episodes}", "--eval.batch_size=1"]
    flags = eval_flags(tmp_path, *flags)
    monkeypatch.setattr(sys, "argv", ["lerobot-eval", *flags])  # LeRobot looks for --policy.path there
    rest = [flag for flag in flags if not flag.startswith("--policy.")]
    config = draccus.parse(EvalPipelineConfig, args=rest)
    assert isinstance(config.env, FR5GraspEnvConfig)
    if refused:
        with pytest.raises(ConfigurationError, match=r"--eval\.recording=true records one batch only.*n_episodes=2"):
            config.env.create_envs(1)
    else:
        config.env.create_envs(1)["fr5_grasp"][0].close()


def test_the_policy_server_has_a_list_without_our_policy():
    # Its package needs grpc, which this one does not.
    constants = runpy.run_path(str(Path(lerobot.__file__).parent / "async_inference/constants.py"))
    assert "act" in constants["SUPPORTED_POLICIES"]
    assert "mask_act" not in constants["SUPPORTED_POLICIES"]
