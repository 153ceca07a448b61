"""Which scenes are shown with all their targets, and which are not."""

from dataclasses import dataclass

import pandas as pd

SCENE_COLUMNS = ["env", "scene_set", "scene_id"]


@dataclass(frozen=True, kw_only=True)
class PairCoverage:
    """How completely an index pairs its scenes.

    Attributes:
        scenes: Number of scenes.
        targets: Number of different targets in the index.
        missing: By scene (`env/scene_set/scene_id`), the targets it lacks.
        duplicates: By `pair_uid`, the episodes that show it, where there is more than one.
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
    scenes = {
        f"{env}/{scene_set}/{scene_id}": set(rows["target_id"])
        for (env, scene_set, scene_id), rows in index.groupby(SCENE_COLUMNS)
    }
    missing = {scene: sorted(targets - shown) for scene, shown in scenes.items() if shown != targets}
    repeated = index[index.duplicated("pair_uid", keep=False)].groupby("pair_uid")["episode_index"]
    return PairCoverage(
        scenes=len(scenes),
        targets=len(targets),
        missing=missing,
        duplicates={str(uid): [int(i) for i in episodes] for uid, episodes in repeated},
    )
