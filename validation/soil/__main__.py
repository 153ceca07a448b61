"""Hold the soil to published experiments: columns that collapse, heaps, blades, ledgers.

Prints every measured value beside its gate. With --report it also writes the report with its plots. The exit code
is 1 if a gate is missed; times, which depend on the machine, do not count for it.

Examples:
  lerobot-excav bench soil --quick --only=T3,T12
      a heap of sand and the mass ledger, in half a minute
  lerobot-excav bench soil --fidelity=fine --soil=gravel --json=outputs/soil.json
      everything; experiments made with one kind of sand keep to it
  lerobot-excav bench soil --report
      everything, and docs/soil_validation.md with docs/images/soil/*.png
  lerobot-excav bench soil --quick --only=T1 --report --out=outputs/columns.md
      the report of a part, with its plots in outputs/images/soil
  lerobot-excav bench soil --video=outputs/dig.mp4
      a dig in slow motion instead of the experiments

Experiments:
  T1  collapse of a column       T11 free fall and dump   T15 stall and energy
  T3  heap and repose            T12 mass ledger          T16 force against depth
  T5  force on a blade           T13 determinism
  T6  factors of earthmoving     T14 speed
  T8  an operator's cycle
"""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from lerobot_excav.envs.tasks.settings import FIDELITIES, SOILS
from lerobot_excav.errors import ConfigurationError, require

if TYPE_CHECKING:
    from validation.soil.experiment import Conditions
    from validation.soil.report import Outcome

REPORT = Path("docs", "soil_validation.md")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "--only", dest="experiments", metavar="T1,T3", help="codes of experiments (default: all)"
    )
    parser.add_argument("--soil", dest="preset", choices=SOILS, help="soil preset (default: sand)")
    parser.add_argument("--fidelity", choices=FIDELITIES, help="numerical effort (default: standard)")
    parser.add_argument("--seeds", help="seeds of random arrangements (default: 0,1,2)")
    parser.add_argument(
        "--quick", dest="is_quick", action="store_true", help="fewer repetitions, the same gates"
    )
    parser.add_argument("--report", action="store_true", help="write the report with its plots")
    parser.add_argument(
        "--out", type=Path, help=f"where to write the report (default: {REPORT}, for the whole of it only)"
    )
    parser.add_argument("--json", dest="values", type=Path, help="also write the values to this file")
    parser.add_argument(
        "--video", type=Path, help="film a dig in slow motion into this mp4 file, and nothing else"
    )


def run(arguments: argparse.Namespace) -> int:
    """Run the experiments, or film a dig."""
    require(arguments.out is None or arguments.report, "--out names the report; add --report")
    if arguments.video is not None:
        return _film(arguments)
    _require_whole_report(arguments)
    for path in (arguments.values, arguments.out):
        _require_file(path)
    from validation.soil.catalogue import chosen
    from validation.soil.experiment import Conditions
    from validation.soil.report import summary_text, write_report

    seeds = None if arguments.seeds is None else _seeds(arguments.seeds)
    chosen_fields = {"preset": arguments.preset, "fidelity": arguments.fidelity, "seeds": seeds}
    given = {name: value for name, value in chosen_fields.items() if value is not None}
    conditions = Conditions(quick=arguments.is_quick, **given)
    outcomes: list[Outcome] = []
    for experiment in chosen(arguments.experiments):
        outcomes.append((experiment, experiment.run(conditions)))
        print(summary_text(outcomes[-1:]), flush=True)
    if arguments.values is not None:
        _write_values(arguments.values, conditions, outcomes)
    if arguments.report:
        path = arguments.out or REPORT
        write_report(outcomes, conditions, path)
        print(f"written: {path}")
    return int(any(not result.passed for experiment, result in outcomes if not experiment.is_timed))


def _film(arguments: argparse.Namespace) -> int:
    """Film a dig; everything that an experiment would need has no effect on it."""
    given = {
        "--only": arguments.experiments,
        "--soil": arguments.preset,
        "--fidelity": arguments.fidelity,
        "--seeds": arguments.seeds,
        "--quick": arguments.is_quick or None,
        "--report": arguments.report or None,
        "--json": arguments.values,
    }
    for option, value in given.items():
        require(value is None, f"{option} has no effect on `bench soil --video`; leave it out")
    require(arguments.video.suffix == ".mp4", f"--video={arguments.video} must end in .mp4")
    _require_file(arguments.video)
    from bench.dig_film import write_video

    write_video(arguments.video)
    print(f"written: {arguments.video}")
    return 0


def _require_whole_report(arguments: argparse.Namespace) -> None:
    """Let nothing but all experiments, at their default settings, replace the report of the repository."""
    if not arguments.report or arguments.out is not None:
        return
    given = {
        "--only": arguments.experiments,
        "--soil": arguments.preset,
        "--fidelity": arguments.fidelity,
        "--seeds": arguments.seeds,
        "--quick": arguments.is_quick or None,
    }
    for option, value in given.items():
        require(
            value is None, f"{option} with --report would replace {REPORT} by another report; add --out=FILE"
        )


def _require_file(path: Path | None) -> None:
    """Refuse a file that cannot be written before the experiments run, not after."""
    if path is not None:
        require(not path.is_dir(), f"{path} is a folder; name a file in it")
        path.parent.mkdir(parents=True, exist_ok=True)


def _seeds(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise ConfigurationError(f"--seeds={text!r}; give whole numbers, as in --seeds=0,1,2") from None


def _write_values(path: Path, conditions: "Conditions", outcomes: "list[Outcome]") -> None:
    values = {
        "soil": conditions.preset,
        "fidelity": conditions.fidelity,
        "seeds": conditions.seeds,
        "quick": conditions.quick,
        "experiments": {experiment.code: result.as_dict() for experiment, result in outcomes},
    }
    path.write_text(json.dumps(values, indent=1, ensure_ascii=False) + "\n")
