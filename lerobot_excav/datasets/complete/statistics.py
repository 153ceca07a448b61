"""Statistics of columns that were added to a dataset, as LeRobot computes them for columns that it records."""

from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
from lerobot.datasets.compute_stats import aggregate_stats, compute_episode_stats
from lerobot.datasets.io_utils import load_stats, write_stats

from lerobot_excav.datasets.format.episode_table import iterate_episodes
from lerobot_excav.datasets.format.schema import Feature


def write_statistics(root: Path, features: Mapping[str, Feature]) -> None:
    """Add the statistics of columns, by key, to those of the dataset and of each of its episodes; texts have none."""
    numeric = {key: feature for key, feature in features.items() if feature["dtype"] != "string"}
    episodes = {
        episode.index: compute_episode_stats({key: episode.array(key) for key in numeric}, numeric)
        for episode in iterate_episodes(root, list(numeric))
    }
    stale = tuple(f"stats/{key}/" for key in numeric)
    for path in sorted(root.glob("meta/episodes/*/*.parquet")):
        table = pq.read_table(path)
        rows = [episodes[index] for index in table["episode_index"].to_pylist()]
        # Columns that were removed from a dataset leave theirs behind.
        table = table.drop_columns([name for name in table.column_names if name.startswith(stale)])
        for key in numeric:
            for name in rows[0][key]:
                values = pa.array([row[key][name].tolist() for row in rows])
                table = table.append_column(f"stats/{key}/{name}", values)
        pq.write_table(table, path)
    write_stats((load_stats(root) or {}) | aggregate_stats(list(episodes.values())), root)
