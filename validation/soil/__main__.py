"""Hold the soil to published experiments: columns that collapse, heaps, blades, ledgers.

Prints every measured value beside its gate. With --report it also writes the report with its plots. The exit code
is 1 if a gate is missed; times, which depend on the machine, do not count for it. Run it from the repository's root.

Examples:
  python -m validation.soil --quick --only=heap,ledger
      a heap of sand and the mass ledger, in half a minute
  python -m validation.soil --fidelity=fine --soil=gravel --json=outputs/soil.json
      everything; experiments made with one kind of sand keep to it
  python -m validation.soil --report
      everything, and docs/explanation/soil_validation.md with docs/explanation/images/soil/*.png
  python -m validation.soil --quick --only=column_collapse --report=outputs/columns.md
      the report of a part, with its plots in outputs/images/soil
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pydantic_core import to_json

from lerobot_excav.envs.soil import FIDELITIES, PRESETS
from lerobot_excav.errors import ConfigurationError, require
from lerobot_excav.whole_file import write_whole
from validation.soil import catalogue
from validation.soil.experiment import Conditions
from validation.soil.report import IMAGE_FOLDER, Outcome, is_report, summary_text, write_report

REPORT = Path("docs", "explanation", "soil_validation.md")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        "python -m validation.soil",
        description=__doc__,
        epilog="\n".join(["experiments:", *(f"  {one.name:20} {one.title}" for one in catalogue.EXPERIMENTS)]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--only", metavar="heap,ledger", help="names of experiments (default: all)")
    parser.add_argument("--soil", choices=PRESETS, default="sand", help="soil preset (default: sand)")
    parser.add_argument("--fidelity", choices=FIDELITIES, default="standard", help="default: standard")
    parser.add_argument("--seeds", type=_seeds, default=(0, 1, 2), help="of random arrangements (default: 0,1,2)")
    parser.add_argument("--quick", action="store_true", help="fewer repetitions, the same gates")
    parser.add_argument(
        "--report", nargs="?", const=REPORT, type=Path, metavar="FILE", help=f"write the report (default: {REPORT})"
    )
    parser.add_argument("--json", type=Path, help="also write the values to this file")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = _parser()
    given = parser.parse_args(arguments)
    try:
        _check_files(given)
        conditions = Conditions(preset=given.soil, fidelity=given.fidelity, seeds=given.seeds, quick=given.quick)
        experiments = catalogue.chosen(given.only)
    except ConfigurationError as error:
        parser.error(str(error))
    outcomes: list[Outcome] = []
    for experiment in experiments:
        outcomes.append((experiment, experiment.run(conditions)))
        print(summary_text(*outcomes[-1]), flush=True)
    if given.json is not None:
        values = {name: getattr(given, name) for name in ("soil", "fidelity", "seeds", "quick")}
        values["experiments"] = {experiment.name: result.as_dict() for experiment, result in outcomes}
        write_whole(given.json, to_json(values, indent=1, inf_nan_mode="null") + b"\n")
    if given.report is not None:
        write_report(outcomes, conditions, given.report)
        print(f"written: {given.report}")
    return int(any(result.missed for experiment, result in outcomes if not experiment.is_timed))


def _check_files(given: argparse.Namespace) -> None:
    """Refuse what cannot be written before the experiments run, not after; a part must not replace the report."""
    for name in ("only", "soil", "fidelity", "seeds", "quick"):
        require(
            given.report != REPORT or getattr(given, name) == _parser().get_default(name),
            f"--{name} would replace {REPORT} by another report; name a file, as in --report=outputs/report.md",
        )
    for path in (given.json, given.report):
        if path is not None:
            require(not path.is_dir(), f"{path} is a folder; name a file in it")
            require(
                not path.exists() or (path == given.report and is_report(path)),
                f"{path} exists, and is not a report of this command; choose another file, or remove it first",
            )
            path.parent.mkdir(parents=True, exist_ok=True)
    if given.report is not None and not given.report.exists():
        images = given.report.parent / IMAGE_FOLDER
        require(
            not images.exists() or not any(images.iterdir()),
            f"{images} holds pictures, and {given.report} would replace them; choose another folder",
        )


def _seeds(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}; give whole numbers, as in --seeds=0,1,2") from None


if __name__ == "__main__":
    sys.exit(main())
