"""Run an experiment: the stages of a TOML file that are not finished, in order.

A stage is one command, printed as it is run, that can be copied and run by hand. Its result appears under its name only
when it is complete; what exists is not made again. After an interruption the same command goes on: trainings from
their last checkpoint, evaluations from the start.

Examples:
  lerobot-excav experiment experiments/fr5_grasp/stages.toml --list
      all stages, and how far they are
  lerobot-excav experiment experiments/fr5_grasp/stages.toml --dry-run
      the commands still to be run, as a shell script
  lerobot-excav experiment experiments/fr5_grasp/stages.toml --jobs=2
      run them, two at a time
  lerobot-excav experiment experiments/fr5_grasp/stages.toml --only 'data-*' --set out=outputs/trial paired_scenes=5
      some of them, with other values of settings, in a folder of their own
"""

import argparse
import shlex
import signal
from collections.abc import Sequence
from pathlib import Path
from types import FrameType

from lerobot_excav.errors import require
from lerobot_excav.evaluation.experiment.experiment import Experiment, read_experiment
from lerobot_excav.evaluation.experiment.runner import run_experiment
from lerobot_excav.evaluation.experiment.stage import Stage
from lerobot_excav.evaluation.experiment.stage_record import read_record
from lerobot_excav.evaluation.experiment.stage_state import state


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("file", type=Path, help="TOML file of the experiment")
    parser.add_argument(
        "--only", nargs="+", metavar="STAGE", default=[], help="stages, or patterns like 'train-*'"
    )
    parser.add_argument(
        "--set", nargs="+", metavar="NAME=VALUE", default=[], help="settings in place of the file's"
    )
    parser.add_argument("--jobs", type=int, default=1, help="how many stages may run at a time (default: 1)")
    show = parser.add_mutually_exclusive_group()
    show.add_argument("--list", action="store_true", help="list the stages and run nothing")
    show.add_argument("--dry-run", action="store_true", help="print what would be run, as a shell script")


def run(arguments: argparse.Namespace) -> int:
    """List, print or run."""
    experiment = read_experiment(arguments.file, _settings(arguments.set))
    stages = experiment.select(arguments.only)
    if arguments.list:
        print("\n".join(_line(experiment, stage) for stage in stages))
        return 0
    if arguments.dry_run:
        print("\n".join(_script(experiment, stages)))
        return 0
    _end_stages_on(signal.SIGTERM, signal.SIGHUP)
    succeeded = run_experiment(experiment, stages, jobs=arguments.jobs, say=_say)
    return 0 if succeeded else 1


def _say(line: str) -> None:
    print(line, flush=True)


def _end_stages_on(*numbers: signal.Signals) -> None:
    """Let `kill` and a closed terminal end the stages as Ctrl-C does; what is ignored, as under `nohup`, stays so."""
    for number in numbers:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _settings(pairs: Sequence[str]) -> dict[str, str]:
    settings = {}
    for pair in pairs:
        name, separator, value = pair.partition("=")
        require(bool(separator), f"--set={pair!r} lacks its value; give NAME=VALUE")
        settings[name] = value
    return settings


def _line(experiment: Experiment, stage: Stage) -> str:
    record = read_record(stage.makes) if stage.makes is not None and stage.is_finished else None
    wall = f"{record.wall_s / 60:7.1f} min" if record else " " * 11
    return f"{state(experiment, stage):12}{wall}  {stage.name:32}  {stage.makes or ''}"


def _script(experiment: Experiment, stages: Sequence[Stage]) -> list[str]:
    lines = [
        "set -euo pipefail",
        *(f"export {k}={shlex.quote(v)}" for k, v in experiment.environment.items()),
    ]
    for stage in stages:
        if not stage.is_finished:
            lines += ["", f"# {stage.name}", *stage.shell_lines()]
    return lines
