"""Functions that make changes of a stored dataset: each returns a function of its folder."""

import io
import json
import shutil
import struct
import zlib

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from PIL import Image

from .toy import MAIN

EPISODE = 2
"""The episode that is changed, of the four of `small_datasets`."""
DATA, META = "data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet"


# Files of frames


def data_file(root):
    return next(root.glob("data/*/*.parquet"))


def edit_table(change):
    """Return a change of the whole table of frames."""

    def apply(root):
        path = data_file(root)
        pq.write_table(change(pq.read_table(path)), path)

    return apply


def set_column(key, change, *, kind=None):
    """Return a change of a column: `change(values, rows)` edits a list; `rows` are those of the episode."""

    def edit(table):
        values = table[key].to_pylist()
        change(values, np.flatnonzero(table["episode_index"].to_numpy() == EPISODE).tolist())
        column = pa.array(values, kind or table.schema.field(key).type)
        return table.set_column(table.column_names.index(key), pa.field(key, column.type), column)

    return edit_table(edit)


def set_frames(key, value, frames=slice(None), *, kind=None):
    """Return a change that writes a value into frames of the episode."""

    def change(values, rows):
        for row in rows[frames]:
            values[row] = value

    return set_column(key, change, kind=kind)


def replace_all(key, change, *, kind=None):
    """Return a change that replaces the value of every frame of the dataset."""

    def edit(values, rows):
        values[:] = [change(value) for value in values]

    return set_column(key, edit, kind=kind)


def cast(key, kind):
    return set_column(key, lambda values, rows: None, kind=kind)


def drop_column(key):
    return edit_table(lambda table: table.drop([key]))


def swap_frames(table):
    order = np.arange(table.num_rows)
    rows = np.flatnonzero(table["episode_index"].to_numpy() == EPISODE)
    order[rows[[1, 2]]] = order[rows[[2, 1]]]
    return table.take(order)


def without_episode(table):
    return table.filter(table["episode_index"].to_numpy() != EPISODE)


# Pictures


def encoded(img, kind="PNG"):
    file = io.BytesIO()
    (img if isinstance(img, Image.Image) else Image.fromarray(img)).save(file, kind)
    return file.getvalue()


def bomb(side=20_000):
    """Return a PNG of a few hundred kilobytes that holds a black picture of 20,000 x 20,000 px."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    packer = zlib.compressobj(1)
    row = bytes(1 + 3 * side)
    data = b"".join(packer.compress(row) for _ in range(20)) + packer.flush()
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def set_picture(change, *, key=MAIN, frames=slice(1, 2)):
    """Return a change of stored pictures: `change(file)` gives another file."""

    def edit(values, rows):
        for row in rows[frames]:
            values[row] = {**values[row], "bytes": change(values[row]["bytes"])}

    return set_column(key, edit)


def flipped(file, place=0.6):
    data = bytearray(file)
    data[int(place * len(data))] ^= 1
    return bytes(data)


def converted(mode):
    return lambda file: encoded(Image.open(io.BytesIO(file)).convert(mode))


def black(file):
    return encoded(np.zeros_like(np.asarray(Image.open(io.BytesIO(file)))))


# JSON and tables of `meta`


def edit_json(path, change):
    def apply(root):
        content = json.loads((root / path).read_text())
        change(content)
        (root / path).write_text(json.dumps(content))

    return apply


def set_info(**values):
    return edit_json("meta/info.json", lambda info: info.update(values))


def drop_info(name):
    return edit_json("meta/info.json", lambda info: info.pop(name))


def set_feature(key, **values):
    return edit_json("meta/info.json", lambda info: info["features"][key].update(values))


def set_statistic(key, name, value):
    return edit_json("meta/stats.json", lambda stats: stats[key].update({name: value}))


def set_metadata(key, value):
    """Return a change of the episode's row in `meta/episodes`."""

    def apply(root):
        path = next(root.glob("meta/episodes/*/*.parquet"))
        table = pq.read_table(path)
        values = table[key].to_pylist()
        values[EPISODE] = value
        column = pa.array(values, table.schema.field(key).type)
        pq.write_table(table.set_column(table.column_names.index(key), key, column), path)

    return apply


def edit_tasks(change):
    def apply(root):
        path = root / "meta/tasks.parquet"
        change(pq.read_table(path).to_pandas()).to_parquet(path)

    return apply


# Any file


def write(path, data):
    def apply(root):
        for place in root.glob(path):
            place.write_bytes(data)

    return apply


def truncate(path, share=0.5):
    def apply(root):
        for place in sorted(root.glob(path))[:1]:
            data = place.read_bytes()
            place.write_bytes(data[: int(share * len(data))])

    return apply


def flip(path, share):
    def apply(root):
        for place in sorted(root.glob(path))[:1]:
            place.write_bytes(flipped(place.read_bytes(), share))

    return apply


def damage_page(path):
    """Change a bit at the head of the first page of a Parquet file's first column."""

    def apply(root):
        place = root / path
        head = pq.read_metadata(place).row_group(0).column(0).data_page_offset
        data = bytearray(place.read_bytes())
        data[head + 1] ^= 1
        place.write_bytes(bytes(data))

    return apply


def remove(path):
    def apply(root):
        for place in sorted(root.glob(path)):
            shutil.rmtree(place) if place.is_dir() else place.unlink()

    return apply


def add(path, data=b"\0\5\26\7" + bytes(60)):
    def apply(root):
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_bytes(data)

    return apply


def add_metadata_file(root):
    """Move the last episode's row to a file of its own, which has another column."""
    path = root / META
    table = pq.read_table(path)
    pq.write_table(table.slice(0, len(table) - 1), path)
    last = table.slice(len(table) - 1)
    pq.write_table(last.append_column("note", pa.array(["x"])), path.with_name("file-001.parquet"))
