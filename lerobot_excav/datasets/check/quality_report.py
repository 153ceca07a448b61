"""What a quality check finds, and its verdicts."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from lerobot_excav.datasets.pairs.paired_index import FAILED, PASSED
from lerobot_excav.errors import DatasetError


@dataclass(kw_only=True)
class QualityReport:
    """What is wrong with a dataset.

    Attributes:
        problems: What concerns all of it, each naming a file and what is wrong with it.
        episodes: A row per checked episode: `episode_index`, `pair_uid` (empty if unknown), `qc` (`passed` or
            `failed`), `qc_problem`, `replayed`.
        has_pairs: Whether the episodes are of scenes, which an index of pairs can name; a real machine has none.
    """

    problems: list[str]
    episodes: pd.DataFrame
    has_pairs: bool = True

    @property
    def has_passed(self) -> bool:
        """Whether nothing is wrong."""
        return not self.problems and bool((self.episodes["qc"] == PASSED).all())


@dataclass(kw_only=True)
class Findings:
    """What a check has found so far.

    Attributes:
        dataset: What concerns the whole dataset.
        episodes: What is wrong with each episode that was looked at, by index; nothing if it is sound.
        uids: Their pairs, of those that can be read, as all that follows.
        lengths: Numbers of frames.
        versions: Versions of the simulation, of sound ones.
        replayed: Episodes that were replayed.
    """

    dataset: list[str] = field(default_factory=list)
    episodes: dict[int, list[str]] = field(default_factory=dict)
    uids: dict[int, str] = field(default_factory=dict)
    lengths: dict[int, int] = field(default_factory=dict)
    versions: dict[int, int] = field(default_factory=dict)
    replayed: list[int] = field(default_factory=list)

    def note(self, damage: DatasetError) -> None:
        """Note what concerns the whole dataset."""
        self.dataset.append(str(damage))

    def attempt[Result](self, read: Callable[..., Result], *arguments: Any) -> Result | None:
        """Read something, or note why it cannot be read."""
        try:
            return read(*arguments)
        except DatasetError as damage:
            self.note(damage)
            return None

    def sound(self) -> list[int]:
        """Return the episodes in which nothing was found."""
        return sorted(index for index, problems in self.episodes.items() if not problems)

    def report(self, *, has_pairs: bool = True) -> QualityReport:
        """Return the verdicts."""
        rows = [
            {
                "episode_index": index,
                "pair_uid": self.uids.get(index, ""),
                "qc": FAILED if problems else PASSED,
                "qc_problem": "; ".join(problems),
                "replayed": index in self.replayed,
            }
            for index, problems in sorted(self.episodes.items())
        ]
        columns = ["episode_index", "pair_uid", "qc", "qc_problem", "replayed"]
        return QualityReport(problems=self.dataset, episodes=pd.DataFrame(rows, columns=columns), has_pairs=has_pairs)
