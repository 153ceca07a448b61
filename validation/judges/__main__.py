"""Let two public judges look at small datasets of both machines, recorded by script, gamepad and page.

A finding is mended, or declared with its reason in validation/judges/declared.toml. The command ends with 1 if a judge
finds what is not declared, if a declaration covers nothing any more, or if a judge misses the defect that is planted at
the end. `make judge-data` installs the judges and runs this.

Examples:
  python -m validation.judges --programs=.venv/judges/bin
      record what is missing in outputs/judged (six minutes), and judge all
  python -m validation.judges --programs=.venv/judges/bin outputs/paired
      judge a dataset of one's own
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from validation.judges.damage import with_stopped_clock
from validation.judges.declarations import Declaration, read_declarations, undeclared, unused
from validation.judges.judge import JUDGES, Finding
from validation.judges.recordings import record_missing

FOLDER = Path("outputs", "judged")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        "python -m validation.judges",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("datasets", type=Path, nargs="*", help="datasets to judge (default: record all kinds)")
    parser.add_argument("--programs", type=Path, required=True, help="folder with lerobot-doctor and robovet")
    parser.add_argument("--out", type=Path, default=FOLDER, help=f"where recordings go (default: {FOLDER})")
    given = parser.parse_args(arguments)
    declarations = read_declarations()
    if given.datasets:
        found = judge_all({str(path): path for path in given.datasets}, given.programs, declarations)
        return int(bool(undeclared(found, declarations)))
    datasets = record_missing(given.out, lambda words: print(words, flush=True))
    found = judge_all(datasets, given.programs, declarations)
    stale = unused(found, declarations)
    for each in stale:
        print(f"declared, and not found any more: {each.judge}, {each.check}, {each.pattern}")
    blind = blind_judges(next(iter(datasets.values())), given.out / "stopped_clock", given.programs, declarations)
    for judge in blind:
        print(f"{judge} has missed the planted defect")
    return int(bool(undeclared(found, declarations) or stale or blind))


def judge_all(datasets: dict[str, Path], programs: Path, declarations: Sequence[Declaration]) -> list[Finding]:
    """Judge datasets, print a line for each verdict, and return all findings."""
    print(f"{'dataset':28}{'judge':18}{'declared':>9}{'undeclared':>12}")
    found = []
    for name, path in datasets.items():
        for judge, look in JUDGES.items():
            findings = look(programs, path)
            bad = undeclared(findings, declarations)
            print(f"{name:28}{judge:18}{len(findings) - len(bad):9}{len(bad):12}", flush=True)
            for finding in bad:
                print(f"    {finding.check}: {finding.text}")
            found += findings
    return found


def blind_judges(dataset: Path, damaged: Path, programs: Path, declarations: Sequence[Declaration]) -> list[str]:
    """Return the judges that find nothing in a copy of a dataset whose clock stands still."""
    path = with_stopped_clock(dataset, damaged)
    return [judge for judge, look in JUDGES.items() if not undeclared(look(programs, path), declarations)]


if __name__ == "__main__":
    sys.exit(main())
