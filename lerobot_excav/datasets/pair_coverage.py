"""Which scenes are shown with all their targets, and which are not."""

from dataclasses import dataclass

import pandas as pd

SCENE_COLUMNS = ["env", "scene_set", "scene_id"]
"""What numbers a scene."""

PILE_COLUMNS = [*SCENE_COLUMNS, "soil"]
"""What determines a starting situation: the same scene is another pile on another soil."""


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
    """Examine an index.

    Args:
        index: A paired-scene index.

    Returns:
        Counts, missing targets and duplicates.
    """
    targets = set(index["target_id"])
    on_soil = " on {}" if index["soil"].nunique() > 1 else ""
    scenes = {
        f"{env}/{scene_set}/{scene_id}{on_soil.format(soil)}": set(rows["target_id"])
        for (env, scene_set, scene_id, soil), rows in index.groupby(PILE_COLUMNS)
    }
    missing = {scene: sorted(targets - shown) for scene, shown in scenes.items() if shown != targets}
    pair = ["pair_uid", "soil"]
    repeated = index[index.duplicated(pair, keep=False)].groupby(pair)["episode_index"]
    return PairCoverage(
        scenes=len(scenes),
        targets=len(targets),
        missing=missing,
        duplicates={
            f"{uid}{on_soil.format(soil)}": [int(i) for i in episodes] for (uid, soil), episodes in repeated
        },
    )
