"""Which starts are shown with all their targets, and which are not."""

from dataclasses import dataclass

import pandas as pd

from lerobot_excav.envs.tasks.registry import env_types

SCENE_COLUMNS = ["env", "scene_set", "scene_id"]
"""What numbers a scene."""

START_COLUMNS = [*SCENE_COLUMNS, "stage"]
"""What numbers a start."""


def start_settings(index: pd.DataFrame) -> list[str]:
    """Return the settings that make the same scene another start, such as the soil: another soil is another pile."""
    return list(env_types()[index["env"].iloc[0]].settings.start_columns()) if len(index) else []


def start_columns(index: pd.DataFrame) -> list[str]:
    """Return the columns that determine a starting situation: the same scene is another pile on another soil."""
    return [*START_COLUMNS, *start_settings(index)]


def pair_columns(index: pd.DataFrame) -> list[str]:
    """Return the columns that name a start shown with a target."""
    return ["pair_uid", *start_settings(index)]


@dataclass(frozen=True, kw_only=True)
class PairCoverage:
    """How completely an index pairs its starts.

    Attributes:
        scenes: Number of scenes.
        starts: Number of starts: a scene at another stage, or on another soil, is another start.
        targets: Number of different targets in the index.
        missing: By start (`env/scene_set/scene_id/stage`, and its soil if there are several), the targets it lacks. A
            start at a later stage may have fewer regions, and they are numbered without gaps: above the greatest
            number that it is shown with, it lacks none.
        duplicates: By `pair_uid` (and its soil if there are several), the episodes that show it, if more than one.
    """

    scenes: int
    starts: int
    targets: int
    missing: dict[str, list[int]]
    duplicates: dict[str, list[int]]

    @property
    def complete_starts(self) -> int:
        """Number of starts shown with every target that they are known to have."""
        return self.starts - len(self.missing)


def pair_coverage(index: pd.DataFrame) -> PairCoverage:
    """Count the starts of a paired-scene index, and find missing targets and duplicates."""
    targets = set(index["target_id"])
    varied = [name for name in start_settings(index) if index[name].nunique() > 1]
    named = index.assign(
        start=_joined(index, START_COLUMNS, "/") + _suffix(index, varied),
        pair=index["pair_uid"] + _suffix(index, varied),
    )
    starts = {str(start): rows for start, rows in named.groupby("start")}
    missing = {start: lacking for start, rows in starts.items() if (lacking := _lacking(rows, targets))}
    repeated = named[named.duplicated("pair", keep=False)].groupby("pair")["episode_index"]
    return PairCoverage(
        scenes=len(index[SCENE_COLUMNS].drop_duplicates()),
        starts=len(starts),
        targets=len(targets),
        missing=missing,
        duplicates={str(pair): [int(i) for i in episodes] for pair, episodes in repeated},
    )


def _lacking(rows: pd.DataFrame, targets: set[int]) -> list[int]:
    """Return the targets that the rows of a start lack."""
    shown = set(rows["target_id"])
    is_later = rows["stage"].iloc[0] > 0
    return sorted(target for target in targets - shown if not is_later or target < max(shown))


def _suffix(index: pd.DataFrame, varied: list[str]) -> pd.Series:
    """Name the settings that tell starts apart."""
    return " on " + _joined(index, varied, ", ") if varied else pd.Series("", index=index.index)


def _joined(index: pd.DataFrame, columns: list[str], separator: str) -> pd.Series:
    return index[columns].astype(str).agg(separator.join, axis=1)
