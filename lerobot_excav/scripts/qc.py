"""Check a dataset: columns, values, masks, paired starts, and replays of some episodes.

Exit code 0 if every episode passes, 1 if one fails. The verdicts go into the index, and episodes that failed are not
chosen by `lerobot-excav index --select`.

Examples:
  lerobot-excav qc outputs/paired
      check every episode, replay 3 of them
  lerobot-excav qc outputs/paired --replays=20 --seed=1
      replay 20, other ones
  lerobot-excav qc outputs/merged --episodes=0,5,7 --replays=3
      check three episodes, and replay them all
"""

import argparse
from pathlib import Path

import pandas as pd

DEFAULT_REPLAYS = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("dataset", type=Path, help="folder of the dataset")
    parser.add_argument("--episodes", type=_numbers, help="episodes to check, as 0,5,7 (default: all)")
    parser.add_argument(
        "--replays",
        type=int,
        default=DEFAULT_REPLAYS,
        help=f"episodes to replay (default: {DEFAULT_REPLAYS})",
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the choice of replays (default: 0)")


def run(arguments: argparse.Namespace) -> int:
    """Check, and print the verdicts."""
    from lerobot_excav.datasets.check.quality_check import check_dataset
    from lerobot_excav.datasets.pairs.paired_index import FAILED

    rows = check_dataset(
        arguments.dataset,
        episodes=arguments.episodes,
        replays=arguments.replays,
        seed=arguments.seed,
    )
    failed = rows[rows["qc"] == FAILED]
    for line in failure_table(failed):
        print(line)
    print(
        f"{len(rows) - len(failed)} of {len(rows)} episodes passed; "
        f"{int(rows['replayed'].sum())} of them were replayed"
        if failed.empty
        else f"{len(failed)} of {len(rows)} episodes failed"
    )
    return 0 if failed.empty else 1


def failure_table(failed: pd.DataFrame) -> list[str]:
    """Lay out failed episodes as lines of a table."""
    if failed.empty:
        return []
    width = max(len(uid) for uid in failed["pair_uid"])
    rows = [f"{row.episode_index:7}  {row.pair_uid:{width}}  {row.qc_problem}" for row in failed.itertuples()]
    return [f"{'episode':>7}  {'pair':{width}}  problem", *rows]


def _numbers(text: str) -> list[int]:
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no list of numbers such as 0,5,7") from None
