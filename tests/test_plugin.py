"""Every command of LeRobot that discovers plugins knows our types, and loads no simulator to do so."""

import json
import os
import subprocess
import sys

import pytest
from lerobot.policies.factory import get_policy_class
from lerobot.robots import RobotConfig, make_robot_from_config
from lerobot.teleoperators import TeleoperatorConfig, make_teleoperator_from_config

from lerobot_excav import plugin
from lerobot_excav.policies.mask_act.modeling_mask_act import MaskACTPolicy

ROBOT = ["--robot.type=excavator_sim", "--robot.fps=7"]
ENV = ["--env.type=excavator", "--env.fps=7"]
BAD_FPS = "fps=7 is not possible"

# A setting of ours that cannot work: the command stops at it, and only if it knows the type.
COMMANDS = {
    "record": ([*ROBOT, "--dataset.repo_id=a/b", "--dataset.single_task=dig"], BAD_FPS),
    "replay": ([*ROBOT, "--dataset.repo_id=a/b", "--dataset.episode=0"], BAD_FPS),
    "teleoperate": (
        ["--robot.type=excavator_sim", "--teleop.type=excavator_joystick", "--teleop.pattern=crane"],
        "teleop.pattern='crane' is not possible",
    ),
    "train": (["--dataset.repo_id=a/b", "--policy.type=mask_act", *ENV], BAD_FPS),
    "eval": (["--policy.type=mask_act", *ENV], BAD_FPS),
    "rollout": (["--strategy.type=base", "--policy.type=mask_act", *ROBOT], BAD_FPS),
    "calibrate": (["--teleop.type=excavator_operator", "--teleop.seed=-1"], "teleop.seed=-1"),
}

# Importing LeRobot takes far longer than parsing a command line, so the commands are forked from one process
# that has imported LeRobot but not the plugin: each discovers it for itself.
PROBE = """
import importlib, json, os, sys, traceback
commands = json.loads(sys.argv[1])
mains = {name: importlib.import_module(f"lerobot.scripts.lerobot_{name}").main for name in commands}
assert not [name for name in sys.modules if "excav" in name]
before = set(sys.modules)
for name, (arguments, _) in commands.items():
    child = os.fork()
    if child == 0:
        sys.stdout = sys.stderr = open(f"{name}.txt", "w")
        sys.argv = [f"lerobot-{name}", *arguments]
        try:
            mains[name]()
        except BaseException:
            traceback.print_exc()
        print("loaded:", *sorted({each.split(".")[0] for each in set(sys.modules) - before}))
        print("modules:", *sorted(each for each in sys.modules if each.startswith("lerobot_excav")))
        sys.stdout.flush()
        os._exit(0)
    os.waitpid(child, 0)
"""


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    """Run every command; return what each printed."""
    folder = tmp_path_factory.mktemp("commands")
    environment = os.environ | {"HF_HUB_OFFLINE": "1", "HF_LEROBOT_HOME": str(folder), "HF_HOME": str(folder)}
    probe = [sys.executable, "-c", PROBE, json.dumps(COMMANDS)]
    subprocess.run(probe, check=True, capture_output=True, cwd=folder, env=environment)
    return {name: (folder / f"{name}.txt").read_text() for name in COMMANDS}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_discovers_the_plugin_and_loads_no_simulator(outputs, command):
    assert COMMANDS[command][1] in outputs[command]
    loaded, modules = (line.split()[1:] for line in outputs[command].splitlines()[-2:])
    assert "lerobot_env_excav" in loaded
    assert not {"mujoco", "numba", "pygame", "mink"} & set(loaded)
    # The environments' lists of names and numbers are light; what simulates is not among them.
    assert not [name for name in modules if name.endswith((".env", ".machine", ".workcell", ".operator"))]


CONFIGS = [getattr(plugin, name) for name in plugin.__all__]


@pytest.mark.parametrize("config", [c for c in CONFIGS if issubclass(c, RobotConfig | TeleoperatorConfig)])
def test_lerobot_finds_the_class_of_a_device(config, tmp_path):
    make = make_robot_from_config if issubclass(config, RobotConfig) else make_teleoperator_from_config
    made = make(config(calibration_dir=tmp_path))
    assert f"{type(made).__name__}Config" == config.__name__
    assert made.name == made.config.type


def test_lerobot_finds_the_class_of_the_policy():
    assert get_policy_class("mask_act") is MaskACTPolicy


def test_the_list_is_complete():
    registered = {config.get_choice_name(config) for config in CONFIGS}
    excavator = {
        "excavator",
        "excavator_sim",
        "excavator_testbed",
        "excavator_joystick",
        "excavator_operator",
        "excavator_web",
        "excavator_keyboard",
    }
    arm, cameras = {"fr5_grasp", "fr5_sim", "fr5_operator", "fr5_web"}, {"mask", "shared", "stream"}
    assert registered == {*excavator, *arm, *cameras, "mask_act"}
