"""The paired-scene index: one row per episode, `meta/excav_pairs.parquet`.

The index is derived from the per-frame columns and can be rebuilt at any time; edits with LeRobot's tools drop it or
leave it stale. Only the verdicts of the quality check are remembered in it: they follow an episode by the fingerprint
of its state and action traces, not by its number.
"""

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
from numpy.typing import NDArray

from lerobot_excav.datasets.format import schema
from lerobot_excav.datasets.format.dataset_info import read_info
from lerobot_excav.datasets.format.episode_table import EpisodeTable, iterate_episodes
from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import DatasetError
from lerobot_excav.whole_file import whole_file

INDEX_PATH = Path("meta/excav_pairs.parquet")

VERDICTS = UNCHECKED, PASSED, FAILED = "unchecked", "passed", "failed"


def index_keys(spec: TaskSpec) -> list[str]:
    """Return the columns of a dataset that its index is derived from."""
    return [schema.STATE_KEY, schema.ACTION_KEY, schema.MASK_KEY, *schema.excav_features(spec)]


def build_index(root: Path) -> pd.DataFrame:
    """Derive the index of a dataset from its columns.

    Returns:
        One row per episode, ordered by `episode_index`; columns as in `docs/reference/schema.md`. Verdicts come from
        the stored index, if there is one, for episodes whose traces are unchanged.

    Raises:
        DatasetError: A column is missing, or contradicts another.
    """
    info = read_info(root)
    schema.require_columns(info.spec, info.features)
    rows = [_row(episode) for episode in iterate_episodes(root, index_keys(info.spec))]
    if not rows:
        raise DatasetError(f"{root} has no episodes")
    index = pd.DataFrame(rows).sort_values("episode_index", ignore_index=True)
    return _with_verdicts(index, root / INDEX_PATH)


def write_index(root: Path) -> pd.DataFrame:
    """Rebuild the stored index of a dataset and return it."""
    index = build_index(root)
    store_index(root, index)
    return index


def store_index(root: Path, index: pd.DataFrame) -> None:
    """Write an index beside its dataset; readers see the old one or the new one, never half of one."""
    with whole_file(root / INDEX_PATH) as temporary:
        index.to_parquet(temporary, index=False)


def _row(episode: EpisodeTable) -> dict[str, Any]:
    pair = episode.pair
    return {
        "pair_uid": pair.uid,
        "episode_index": episode.index,
        **pair._asdict(),
        "final_target_id": int(episode.target_id[-1]),
        "commands": 1 + len(episode.schedule),
        "simulation_version": episode.simulation_version,
        **episode.settings,
        "mask_source": episode.mask_words,
        "length": episode.length,
        "success": episode.success,
        **_mask_summary(episode.image(schema.MASK_KEY, 0)),
        **episode.spec.measures.outcome(np.vstack([episode.task_state, episode.outcome])),
        "operator": episode.operator,
        "intervention_frames": int(episode.intervention.sum()),
        "fingerprint": fingerprint(episode),
    }


def _mask_summary(mask_img: NDArray[Any]) -> dict[str, float]:
    """Return area and centroid of a mask (H, W, 3); the centroid of an empty mask is NaN."""
    rows, columns = np.nonzero(mask_img[..., 0] > 127)
    empty = rows.size == 0
    return {
        "mask_area_px": rows.size,
        "mask_centroid_row_px": float("nan") if empty else float(rows.mean()),
        "mask_centroid_column_px": float("nan") if empty else float(columns.mean()),
    }


def fingerprint(episode: EpisodeTable) -> str:
    """Return a digest of what was seen of the joints and commanded, which an edit of the dataset does not change."""
    digest = hashlib.sha256(episode.columns[schema.PAIR_KEY][0].as_py().encode())
    digest.update(repr(episode.schedule).encode())
    for trace in (episode.state, episode.action):
        digest.update(np.ascontiguousarray(trace, dtype=np.float32).tobytes())
    return digest.hexdigest()[:16]


def _with_verdicts(index: pd.DataFrame, path: Path) -> pd.DataFrame:
    """Add the verdicts that a stored index holds; what cannot be one is forgotten, as the index is only derived."""
    known = _stored_verdicts(path)
    verdicts = [known.get(trace, (UNCHECKED, "")) for trace in index["fingerprint"]]
    return index.assign(qc=[verdict for verdict, _ in verdicts], qc_problem=[problem for _, problem in verdicts])


def _stored_verdicts(path: Path) -> dict[str, tuple[str, str]]:
    """Return verdict and problem by fingerprint."""
    try:
        with reading(path):
            rows = pq.read_table(path, columns=["fingerprint", "qc", "qc_problem"]).to_pylist()
    except DatasetError:
        return {}
    verdicts: dict[str, tuple[str, str]] = {}
    for row in rows:
        trace, verdict, problem = row["fingerprint"], row["qc"], row["qc_problem"]
        is_verdict = isinstance(trace, str) and verdict in VERDICTS and isinstance(problem, str)
        # A failure has a reason, and nothing else has one.
        if is_verdict and (verdict == FAILED) == bool(problem):
            verdicts.setdefault(trace, (verdict, problem))
    return verdicts
