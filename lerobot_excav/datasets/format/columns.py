"""Whether columns of a file of frames are as `meta/info.json` declares them.

LeRobot fills a column that a file lacks with nulls and casts what it can, so it may be a long time until a training
stops.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from lerobot_excav.datasets.format.schema import Feature

NUMBERING_KEYS = ("episode_index", "frame_index")
"""Columns that are read with any others: they say which rows are an episode."""


def schema_problems(found: pa.Schema, features: Mapping[str, Feature], keys: Sequence[str]) -> Iterator[str]:
    """Describe in plain words which columns a file lacks, or has in another type than declared."""
    for key in keys:
        if key not in found.names:
            yield f"lacks the column {key}"
        elif found.names.count(key) > 1:
            yield f"has the column {key} {found.names.count(key)} times"
        elif key not in features:
            yield f"has the column {key}, which meta/info.json does not declare"
        elif not _is_of(found.field(key).type, features[key]):
            kind, shape = features[key]["dtype"], features[key]["shape"]
            yield f"{key} is stored as {found.field(key).type}, declared are dtype={kind!r} and shape={list(shape)}"


def row_problems(rows: pa.Table, features: Mapping[str, Feature], keys: Sequence[str]) -> Iterator[str]:
    """Describe in plain words what is wrong with the rows of one episode, whose columns have the declared types."""
    frames = rows["frame_index"].to_numpy()
    if not np.array_equal(frames, np.arange(rows.num_rows)):
        yield f"frames are not numbered 0 to {rows.num_rows - 1}"
    for key in keys:
        if features[key]["dtype"] == "image":
            if rows[key].null_count:
                yield f"{key} is null at frame {_first(pc.is_null(rows[key]))}"
        else:
            yield from _value_problems(key, rows[key].combine_chunks(), features[key])


def _is_of(found: pa.DataType, feature: Feature) -> bool:
    """Tell whether a stored type holds what is declared; lists of a fixed length may be stored as lists of any."""
    if feature["dtype"] == "image":
        place = found.get_field_index("bytes") if pa.types.is_struct(found) else -1
        return place >= 0 and bool(pa.types.is_binary(found.field(place).type))
    for _ in feature["shape"] if feature["shape"] != (1,) else ():
        if not _is_list(found):
            return False
        found = found.value_type
    if feature["dtype"] == "string":
        return bool(pa.types.is_string(found) or pa.types.is_large_string(found))
    return bool(str(found) == _ARROW_NAMES.get(feature["dtype"], feature["dtype"]))


_ARROW_NAMES = {"float32": "float", "float64": "double", "float16": "halffloat"}


def _is_list(kind: pa.DataType) -> bool:
    return bool(pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind))


def _value_problems(key: str, values: pa.Array, feature: Feature) -> Iterator[str]:
    if values.null_count:
        yield f"{key} is null at frame {_first(pc.is_null(values))}"
        return
    for size in feature["shape"] if _is_list(values.type) else ():
        lengths = pc.list_value_length(values)
        wrong = pc.not_equal(lengths, size)
        if pc.any(wrong).as_py():
            frame = _first(wrong)
            yield f"{key} has {lengths[frame].as_py()} elements at frame {frame}, declared are {size}"
            return
        values = pc.list_flatten(values)
        if values.null_count:
            yield f"{key} has an element that is null"
            return
    if feature["dtype"].startswith("float") and not pc.all(pc.is_finite(values)).as_py():
        element = _first(pc.invert(pc.is_finite(values)))
        yield f"{key} is not finite at frame {element // int(np.prod(feature['shape']))}"


def _first(is_so: pa.Array) -> int:
    """Return the place of the first truth, of which there is one."""
    return int(pc.index(is_so, value=True).as_py())
