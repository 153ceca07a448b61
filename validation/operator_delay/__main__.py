"""Drive the scripted operator at several frame rates through added delays, and write the curves.

Every condition plays the same scoops of `val`: scenes 0, 1, 2 ..., one target each. Finished scoops are kept in
FILE, and the same command goes on after an interruption. Run it from the repository's root.

Examples:
  python -m validation.operator_delay
      40 scoops per condition (half an hour on two cores), then docs/explanation/rate_and_delay.md
  python -m validation.operator_delay --scoops=2 --rates=10 --delays=0,200 --file=outputs/d.jsonl --page=outputs/d.md
      a quick look
"""

import argparse
import json
import sys
from collections.abc import Sequence
from concurrent.futures import as_completed
from pathlib import Path
from typing import Any

from tqdm import tqdm

from lerobot_excav.datasets.record.workers import worker_pool
from validation.finished_plays import read_finished
from validation.operator_delay.drive import Condition, drive
from validation.operator_delay.page import write_page
from validation.whole_numbers import whole_numbers

FILE = Path("results", "scoop", "operator_delay.jsonl")
PAGE = Path("docs", "explanation", "rate_and_delay.md")
RATES_HZ, DELAYS_MS = (10, 25, 50), (0, 20, 40, 60, 100, 140, 200)
SCENE_SET, SEED = "val", 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        "python -m validation.operator_delay",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--scoops", type=int, default=40, help="scoops per condition (default: 40)")
    parser.add_argument("--rates", type=whole_numbers, default=RATES_HZ, help="of commands [1/s] (default: 10,25,50)")
    parser.add_argument("--delays", type=whole_numbers, default=DELAYS_MS, help=f"[ms] (default: {DELAYS_MS})")
    parser.add_argument("--workers", type=int, default=2, help="processes (default: 2)")
    parser.add_argument("--file", type=Path, default=FILE, help=f"finished scoops (default: {FILE})")
    parser.add_argument("--page", type=Path, default=PAGE, help=f"page to write (default: {PAGE})")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    given = _parser().parse_args(arguments)
    if given.scoops < 1:
        _parser().error(f"--scoops={given.scoops}; allowed: 1 and above")
    if not (given.rates and given.delays):
        _parser().error("--rates and --delays; allowed: one number at least")
    conditions = [Condition(rate_hz=rate, delay_ms=delay) for rate in given.rates for delay in given.delays]
    wanted = [(condition, scoop) for scoop in range(given.scoops) for condition in conditions]
    given.file.parent.mkdir(parents=True, exist_ok=True)
    done = {_key(line) for line in read_finished(given.file)}
    missing = [(c, s) for c, s in wanted if (c.rate_hz, c.delay_ms, s) not in done]
    with worker_pool(given.workers) as pool, given.file.open("a", encoding="utf-8") as file:
        jobs = [
            pool.submit(drive, condition, scene_set=SCENE_SET, scene_id=scoop, target_id=scoop % 4, seed=SEED)
            for condition, scoop in missing
        ]
        for job in tqdm(as_completed(jobs), total=len(jobs), desc="scoops", disable=None):
            file.write(json.dumps(job.result()) + "\n")
            file.flush()
    keys = {(c.rate_hz, c.delay_ms, s) for c, s in wanted}
    write_page([line for line in read_finished(given.file) if _key(line) in keys], given.page)
    print(f"written: {given.page}")
    return 0


def _key(scoop: dict[str, Any]) -> tuple[int, int, int]:
    return scoop["rate_hz"], scoop["delay_ms"], scoop["scene_id"]


if __name__ == "__main__":
    sys.exit(main())
