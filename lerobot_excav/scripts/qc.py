"""Check a dataset: files, columns, pictures, facts, paired starts, statistics, and replays of some episodes.

Exit code 0 if nothing is found, 1 if an episode or the dataset as a whole fails. The verdicts go into the index, and
episodes that failed are not chosen by `lerobot-excav index --select`. A recording of the test bed that `lerobot-excav
alignment` has completed has no scene: its numbers, its masks, and the ages of what was seen are checked.

Examples:
  lerobot-excav qc outputs/paired
      check every episode, replay 3 of them
  lerobot-excav qc outputs/paired --replays=20 --seed=1
      replay 20, other ones
  lerobot-excav qc outputs/merged --episodes=[0,5,7] --replays=3
      check three episodes, and replay them all
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, cast

from lerobot_excav.scripts.arguments import Arguments
from lerobot_excav.setting import setting

if TYPE_CHECKING:
    import pandas as pd


@dataclass(kw_only=True)
class DatasetArguments(Arguments):
    """A dataset."""

    POSITIONAL: ClassVar[str] = "dataset"

    dataset: Path | None = setting("Folder of the dataset", default=None)

    @property
    def root(self) -> Path:
        """The folder of the dataset.

        Raises:
            ConfigurationError: None was given.
        """
        return cast(Path, self.given("dataset", "its folder before all options"))


@dataclass(kw_only=True)
class QcArguments(DatasetArguments):
    """Arguments of `lerobot-excav qc`."""

    episodes: list[int] | None = setting("Episodes to check, as [0,5,7]; left out: all", default=None, low=0)
    replays: int = setting("How many of them to replay", default=3, low=0)
    seed: int = setting("Seed of the choice of replays", default=0, low=0)


def run(arguments: QcArguments) -> int:
    """Check, and print the verdicts."""
    from lerobot_excav.datasets.check.quality_check import check_dataset, note_verdicts
    from lerobot_excav.datasets.pairs.paired_index import FAILED
    from lerobot_excav.errors import DatasetError

    report = check_dataset(
        arguments.root,
        episodes=arguments.episodes,
        replays=arguments.replays,
        seed=arguments.seed,
        show_progress=True,
    )
    rows = report.episodes
    failed = rows[rows["qc"] == FAILED]
    for problem in report.problems:
        print(f"dataset: {problem}")
    if not failed.empty:
        print("\n".join(failure_table(failed)))
        print(f"{len(failed)} of {len(rows)} episodes failed")
    elif report.problems:
        print(f"the dataset failed; in its {len(rows)} episodes that can be read by themselves nothing was found")
    else:
        replayed = int(rows["replayed"].sum())
        print(f"{len(rows)} of {len(rows)} episodes passed; {replayed} of them were replayed")
    try:
        if report.has_pairs:
            note_verdicts(arguments.root, report)
    except (DatasetError, OSError) as error:  # as of a dataset that may not be written to
        print(f"lerobot-excav qc: the verdicts are not noted in the index: {error}", file=sys.stderr)
    return 0 if report.has_passed else 1


def failure_table(failed: "pd.DataFrame") -> list[str]:
    """Lay out failed episodes as lines of a table."""
    width = max(len(uid) for uid in failed["pair_uid"])
    rows = [f"{row.episode_index:7}  {row.pair_uid:{width}}  {row.qc_problem}" for row in failed.itertuples()]
    return [f"{'episode':>7}  {'pair':{width}}  problem", *rows]


ARGUMENTS = QcArguments
