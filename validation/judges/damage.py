"""A dataset with a known defect, to see that the judges can find one."""

import shutil
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq


def with_stopped_clock(dataset: Path, out: Path) -> Path:
    """Copy a dataset, and let the clock of its first episode stand still in the copy."""
    if out.exists():
        shutil.rmtree(out)
    shutil.copytree(dataset, out)
    path = min(out.glob("data/*/*.parquet"))
    table = pq.read_table(path)
    episodes, times = table["episode_index"].to_pylist(), table["timestamp"].to_pylist()
    stopped = [0.0 if episode == episodes[0] else time_s for episode, time_s in zip(episodes, times, strict=True)]
    number = table.column_names.index("timestamp")
    field = table.schema.field("timestamp")
    pq.write_table(table.set_column(number, field, pa.array(stopped, field.type)), path)
    return out
