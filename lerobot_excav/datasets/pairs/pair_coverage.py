"""Which scenes are shown with all their targets, and which are not."""

from dataclasses import dataclass

import pandas as pd

from lerobot_excav.envs.tasks.registry import env_types

SCENE_COLUMNS = ["env", "scene_set", "scene_id"]
"""What numbers a scene."""


def start_settings(index: pd.DataFrame) -> list[str]:
    """Return the settings that make the same scene another start, such as the soil: another soil is another pile."""
    return list(env_types()[index["env"].iloc[0]].settings.start_columns()) if len(index) else []


def start_columns(index: pd.DataFrame) -> list[str]:
    """Return the columns that determine a starting situation: the same scene is another pile on another soil."""
    return [*SCENE_COLUMNS, *start_settings(index)]


def pair_columns(index: pd.DataFrame) -> list[str]:
    """Return the columns that name a start shown with a target."""
    return ["pair_uid", *start_settings(index)]


@dataclass(frozen=True, kw_only=True)
class PairCoverage:
    """How completely an index pairs its scenes.

    Attributes:
        scenes: Number of scenes.
        targets: Number of different targets in the index.
        missing: By scene (`env/scene_set/scene_id`, and its soil if there are several), the targets it lacks.
        duplicates: By `pair_uid` (and its soil if there are several), the episodes that show it, if more than one.
    """

    scenes: int
    targets: int
    missing: dict[str, list[int]]
    duplicates: dict[str, list[int]]

    @property
    def complete_scenes(self) -> int:
        """Number of scenes shown with every target."""
        return self.scenes - len(self.missing)


def pair_coverage(index: pd.DataFrame) -> PairCoverage:
    """Count the scenes of a paired-scene index, and find missing targets and duplicates."""
    targets = set(index["target_id"])
    varied = [name for name in start_settings(index) if index[name].nunique() > 1]
    named = index.assign(
        scene=_joined(index, SCENE_COLUMNS, "/") + _suffix(index, varied),
        pair=index["pair_uid"] + _suffix(index, varied),
    )
    scenes = {str(scene): set(rows["target_id"]) for scene, rows in named.groupby("scene")}
    missing = {scene: sorted(targets - shown) for scene, shown in scenes.items() if shown != targets}
    repeated = named[named.duplicated("pair", keep=False)].groupby("pair")["episode_index"]
    return PairCoverage(
        scenes=len(scenes),
        targets=len(targets),
        missing=missing,
        duplicates={str(pair): [int(i) for i in episodes] for pair, episodes in repeated},
    )


def _suffix(index: pd.DataFrame, varied: list[str]) -> pd.Series:
    """Name the settings that tell starts apart."""
    return " on " + _joined(index, varied, ", ") if varied else pd.Series("", index=index.index)


def _joined(index: pd.DataFrame, columns: list[str], separator: str) -> pd.Series:
    return index[columns].astype(str).agg(separator.join, axis=1)
