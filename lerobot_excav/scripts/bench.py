"""Measure this machine, let the scripted operator play many scenes, or put the soil to the test.

Alone, `bench` times soil, environment, writing, recording and policies. `bench operator` writes a metrics file like
that of lerobot-eval, to which `lerobot-excav report --operator=FILE` relates policies. `bench soil` repeats published
experiments and tells which gates they pass; `bench fuzz` looks for impossible states after random actions.

Examples:
  lerobot-excav bench --quick --json=outputs/machine.json
  lerobot-excav bench --only=soil,environment
  lerobot-excav bench operator --scene-set=test --scenes=100 --metrics=outputs/operator.jsonl
      100 test scenes with 4 targets each
  lerobot-excav bench operator --first-scene=1000 --scenes=40 --targets=1 --metrics=outputs/operator.jsonl
      what lerobot-eval --env.scene_set=test --eval.n_episodes=40 shows with its default seed of 1000
  lerobot-excav bench operator --env=fr5_grasp --scenes=100 --metrics=outputs/fr5_operator.jsonl
      the arm's operator
  lerobot-excav bench soil --report
      docs/soil_validation.md and its plots; `bench soil --help` explains the experiments
  lerobot-excav bench fuzz --steps=200000
      random actions; `bench fuzz --help` tells what is checked
"""

import argparse
import json
import os
import platform
from pathlib import Path

from lerobot_excav.errors import require, require_choice
from lerobot_excav.scripts import bench_fuzz, bench_soil
from lerobot_excav.scripts.demonstration_arguments import DEFAULT_WORKERS, add_settings, settings_from

MEASURES = ("soil", "environment", "writing", "demos", "policy")

_PARTS = {
    "soil": (bench_soil, "hold the soil to published experiments"),
    "fuzz": (bench_fuzz, "look for impossible states after random actions"),
}
"""Parts of `bench` with a module of their own, and what they do."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("--quick", action="store_true", help="fewer repetitions")
    parser.add_argument(
        "--only",
        help=f"what to time, out of {','.join(MEASURES)} (default: all)",
    )
    parser.add_argument(
        "--workers",
        dest="recording_workers",
        type=int,
        help=f"processes that record (default: {DEFAULT_WORKERS})",
    )
    parser.add_argument("--json", type=Path, help="also write the numbers to this file")
    parts = parser.add_subparsers(dest="what", metavar="operator, soil, fuzz")
    operator = parts.add_parser(
        "operator",
        help="let the scripted operator play scenes, without pictures",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    operator.add_argument("--metrics", type=Path, required=True, help="metrics file to write; must not exist")
    operator.add_argument("--resume", action="store_true", help="continue an interrupted run, or start one")
    add_settings(operator, scene_set="test", scenes=100)
    for name, (command, help_text) in _PARTS.items():
        part = parts.add_parser(
            name,
            help=help_text,
            description=command.__doc__,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.add_arguments(part)


def run(arguments: argparse.Namespace) -> int:
    """Measure, and print what was measured."""
    if arguments.what is None:
        return _machine(arguments)
    _require_no_machine_options(arguments)
    return _operator(arguments) if arguments.what == "operator" else _PARTS[arguments.what][0].run(arguments)


def _machine(arguments: argparse.Namespace) -> int:
    from lerobot_excav.evaluation.speed import measures

    names = list(MEASURES) if arguments.only is None else arguments.only.split(",")
    for name in names:
        require_choice("--only", name, MEASURES)
    workers = arguments.recording_workers
    tasks = measures(workers=DEFAULT_WORKERS if workers is None else workers)
    print(f"{platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    results = []
    for name in names:
        for result in tasks[name](arguments.quick):
            print(f"{result.name:42} {result.value:10.2f} {result.unit}", flush=True)
            results.append(result.as_dict())
    if arguments.json is not None:
        arguments.json.parent.mkdir(parents=True, exist_ok=True)
        machine = {"machine": platform.machine(), "cores": os.cpu_count(), "load": os.getloadavg()[0]}
        arguments.json.write_text(json.dumps({**machine, "measurements": results}, indent=1) + "\n")
    return 0


def _operator(arguments: argparse.Namespace) -> int:
    from lerobot_excav.evaluation.metrics import read_evaluation
    from lerobot_excav.evaluation.operator_run import evaluate_operator
    from lerobot_excav.evaluation.report import make_report
    from lerobot_excav.evaluation.report_text import report_text
    from lerobot_excav.evaluation.run import Run

    evaluate_operator(
        settings_from(arguments), arguments.metrics, workers=arguments.workers, resume=arguments.resume
    )
    operator = Run(label="operator", evaluations=(read_evaluation(arguments.metrics),))
    print(report_text(make_report([operator])))
    print(f"written: {arguments.metrics}")
    return 0


def _require_no_machine_options(arguments: argparse.Namespace) -> None:
    """Refuse options that stand before the name of a part and would be lost there."""
    given = {
        "--quick": arguments.quick,
        "--only": arguments.only is not None,
        "--json": arguments.json is not None,
        "--workers": arguments.recording_workers is not None,
    }
    for option, is_given in given.items():
        require(
            not is_given,
            f"{option} before `{arguments.what}` has no effect on it; if it knows the option, write it behind, "
            "otherwise leave it out",
        )
