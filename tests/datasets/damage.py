"""Changes of a stored dataset: harmful ones, each with what `qc` has to say, and harmless ones.

The labels come from what LeRobot 0.6.1 does with such a dataset, or from what the columns mean, and never from the
check. The dataset is that of `small_datasets`: four episodes in one file.
"""

import io
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from PIL import Image

from .changes import (
    DATA,
    META,
    add,
    add_metadata_file,
    black,
    bomb,
    cast,
    converted,
    damage_page,
    drop_column,
    drop_info,
    edit_json,
    edit_table,
    edit_tasks,
    encoded,
    flip,
    flipped,
    remove,
    replace_all,
    set_feature,
    set_frames,
    set_info,
    set_metadata,
    set_picture,
    set_statistic,
    swap_frames,
    truncate,
    without_episode,
    write,
)
from .toy import MAIN, MASK, STATE

NEAR = "observation.images.near"


def at_stage(stage):
    """Return a change of the episode's stage, in all columns that name it."""

    def apply(root):
        set_frames("excav.stage", stage)(root)
        set_frames("excav.pair_uid", f"toy_reach/train/1/{stage}/1")(root)

    return apply


@dataclass(frozen=True)
class Damage:
    """A change of a dataset; `told` is what the verdict on it has to hold, nothing for a harmless one."""

    apply: Callable[[Path], object]
    told: str = ""


FILES = {
    "a truncated file of frames": Damage(truncate(DATA), "file-000.parquet cannot be read"),
    "an empty file of frames": Damage(write(DATA, b""), "file-000.parquet cannot be read"),
    "no file of frames": Damage(remove("data"), "4 of them have no frames in data/"),
    "a damaged page": Damage(damage_page(DATA), "file-000.parquet"),
    "a Mac's file beside the frames": Damage(add("data/chunk-000/._file-000.parquet"), "._file-000.parquet"),
    "a Mac's file beside the episodes": Damage(add("meta/episodes/chunk-000/._file-000.parquet"), "._file-000.parquet"),
    "an empty file beside the frames": Damage(add("data/chunk-000/x.parquet", b""), "x.parquet cannot be read"),
    "the frames twice": Damage(
        lambda root: shutil.copy(root / DATA, root / "data/chunk-000/file-001.parquet"), "lie apart"
    ),
    "no info.json": Damage(remove("meta/info.json"), "has no meta/info.json"),
    "half an info.json": Damage(truncate("meta/info.json"), "meta/info.json: not JSON"),
    "an info.json of bytes": Damage(write("meta/info.json", b"\xff\xfe\0"), "meta/info.json"),
    "an info.json that is a list": Damage(write("meta/info.json", b"[]"), "meta/info.json"),
    "no stats.json": Damage(remove("meta/stats.json"), "meta/stats.json is missing"),
    "half a stats.json": Damage(truncate("meta/stats.json"), "meta/stats.json cannot be read"),
    "no tasks.parquet": Damage(remove("meta/tasks.parquet"), "meta/tasks.parquet is missing"),
    "half a tasks.parquet": Damage(truncate("meta/tasks.parquet"), "meta/tasks.parquet cannot be read"),
    "no meta/episodes": Damage(remove("meta/episodes"), "meta/episodes is missing"),
    "half a meta/episodes": Damage(truncate(META), "meta/episodes/chunk-000/file-000.parquet cannot be read"),
}

INFO = {
    "fps 0": Damage(set_info(fps=0), "fps=0"),
    "fps null": Damage(set_info(fps=None), "fps=None"),
    "fps negative": Damage(set_info(fps=-10), "fps=-10"),
    "fps in quotes": Damage(set_info(fps="10"), "fps='10'"),
    "fps of no task": Damage(set_info(fps=7), "fps=7 is not possible"),
    "another fps": Damage(set_info(fps=5), "timestamp is 0.1 s at frame 1; 0.2 s are due"),
    "another format": Damage(set_info(codebase_version="v2.1"), "v2.1; this needs v3.0"),
    "no features": Damage(set_info(features={}), "features"),
    "features that are a list": Damage(set_info(features=[]), "features"),
    "another robot": Damage(set_info(robot_type="so100"), "robot_type='so100'"),
    "no robot": Damage(drop_info("robot_type"), "robot_type=None"),
    "more episodes": Damage(set_info(total_episodes=5), "counts 5"),
    "fewer episodes": Damage(set_info(total_episodes=3), "counts 3"),
    "very many episodes": Damage(set_info(total_episodes=10**15), "counts 1000000000000000"),
    "more frames": Damage(set_info(total_frames=10**6), "counts 1000000 frames"),
    "more tasks": Damage(set_info(total_tasks=2), "counts 2"),
    "no total": Damage(drop_info("total_episodes"), "lacks total_episodes"),
    "a pattern of paths that cannot be filled in": Damage(set_info(data_path="data/{name}.parquet"), "data_path="),
    "other names of a state": Damage(set_feature(STATE, names=["a.pos", "b.pos"]), f"{STATE}: names="),
    "another type of the state": Damage(set_feature(STATE, dtype="int64"), f"{STATE}: dtype='int64'"),
    "an unknown type": Damage(set_feature("excav.success", dtype="float33"), "excav.success: dtype='float33'"),
    "a shape that is a word": Damage(set_feature(STATE, shape="wide"), "shape"),
    "a picture of another size": Damage(set_feature(MAIN, shape=[64, 48, 3]), "declared are 64 x 48"),
    "a picture without colours": Damage(set_feature(MAIN, shape=[32, 48]), "not that of a picture"),
    "timestamps as words": Damage(set_feature("timestamp", dtype="string"), "timestamp: dtype='string'"),
    "a feature undeclared": Damage(
        edit_json("meta/info.json", lambda info: info["features"].pop(NEAR)),
        "the dataset lacks observation.images.near",
    ),
    "a number undeclared": Damage(
        edit_json("meta/info.json", lambda info: info["features"].pop("index")), "index: the dataset lacks it"
    ),
}

COLUMNS = {
    "no near": Damage(drop_column(NEAR), f"lacks the column {NEAR}"),
    "no table": Damage(drop_column("excav.table"), "lacks the column excav.table"),
    "no episode_index": Damage(drop_column("episode_index"), "lacks the column episode_index"),
    "an undeclared column": Damage(
        edit_table(lambda table: table.append_column("extra", pa.array([1] * len(table)))), "extra"
    ),
    "success null": Damage(set_frames("excav.success", None), "excav.success is null at frame 0"),
    "success null once": Damage(set_frames("excav.success", None, slice(3, 4)), "excav.success is null at frame 3"),
    "success that changes": Damage(set_frames("excav.success", value=False, frames=slice(1)), "excav.success changes"),
    "pair_uid null": Damage(set_frames("excav.pair_uid", None), "excav.pair_uid is null"),
    "pair_uid of another form": Damage(set_frames("excav.pair_uid", "toy_reach/train"), "is not of the form"),
    "pair_uid of endless digits": Damage(
        set_frames("excav.pair_uid", f"toy_reach/train/{'9' * 5000}/0"), "is not of the form"
    ),
    "pair_uid of another set": Damage(
        replace_all("excav.pair_uid", lambda uid: uid.replace("train", "exam")),
        "unknown scene set",
    ),
    "pair_uid of another scene": Damage(set_frames("excav.pair_uid", "toy_reach/train/0/0/0"), "contradict"),
    "another stage": Damage(set_frames("excav.stage", 4), "contradict"),
    "a stage that the task lacks": Damage(at_stage(4), "excav.stage=4 is not possible; the last stage is 0"),
    "an unknown operator": Damage(set_frames("excav.operator", "robot"), "excav.operator='robot' is not known"),
    "operator that changes": Damage(set_frames("excav.operator", "person", slice(1)), "excav.operator changes"),
    "a takeover without policy": Damage(
        set_frames("excav.intervention", value=True, frames=slice(2, 3)), "excav.intervention is true at frame 2"
    ),
    "outcome that changes": Damage(set_frames("excav.outcome", [1.0, 1.0], slice(1)), "excav.outcome changes"),
    "a rest of a task without": Damage(set_frames("excav.rest_frames", 3), "excav.rest_frames=3 is not possible"),
    "pair_uid of another robot": Damage(set_frames("excav.pair_uid", "excavator/train/1/0/0"), "is of 'excavator'"),
    "another target": Damage(set_frames("excav.target_id", 9, slice(1, None)), "excav.target_id=9 is not possible"),
    "a negative target": Damage(set_frames("excav.target_id", -1, slice(1, None)), "excav.target_id=-1 is not"),
    "a task of another robot": Damage(set_frames("excav.task", "Scoop-v0"), "excav.task='Scoop-v0' is not a task of"),
    "no task": Damage(set_frames("excav.task", None), "excav.task is null"),
    "a command of the future": Damage(set_frames("excav.command_frame", 3), "excav.command_frame=3 at frame 0"),
    "an unknown table": Damage(set_frames("excav.table", "mud"), "excav.table='mud'"),
    "version 99": Damage(set_frames("excav.simulation_version", 99), "excav.simulation_version=99 is not known"),
    "version 0": Damage(set_frames("excav.simulation_version", 0), "excav.simulation_version=0 is not known"),
    "words of no mask": Damage(set_frames("excav.mask_source", "oracle, blurred"), "excav.mask_source="),
    "no words of the mask": Damage(set_frames("excav.mask_source", ""), "excav.mask_source="),
    "task_index 7": Damage(set_frames("task_index", 7), "task_index=7 is not in meta/tasks.parquet"),
    "task_index -1": Damage(set_frames("task_index", -1), "task_index=-1 is not in meta/tasks.parquet"),
    "timestamps of 0": Damage(replace_all("timestamp", lambda _: 0.0), "timestamp is 0 s at frame 1"),
    "a timestamp that is late": Damage(set_frames("timestamp", 0.25, slice(2, 3)), "timestamp is 0.25 s at frame 2"),
    "timestamps that are not finite": Damage(set_frames("timestamp", float("nan")), "timestamp is not finite"),
    "index of 0": Damage(replace_all("index", lambda _: 0), "index is 0 at frame"),
    "frame_index of 0": Damage(replace_all("frame_index", lambda _: 0), "frames are not numbered 0 to"),
    "episode_index of 0": Damage(replace_all("episode_index", lambda _: 0), "3 of them have no frames"),
    "episode_index null": Damage(set_frames("episode_index", None), "episode_index is null"),
    "episode_index 99": Damage(set_frames("episode_index", 99), "has an episode 99"),
    "frames out of order": Damage(edit_table(swap_frames), "frames are not numbered 0 to"),
    "an episode left out": Damage(edit_table(without_episode), "1 of them have no frames"),
    "the last frame left out": Damage(edit_table(lambda table: table.slice(0, len(table) - 1)), "frames, but meta/epi"),
    "no frames": Damage(edit_table(lambda table: table.slice(0, 0)), "4 of them have no frames"),
    "a state of length 7": Damage(
        replace_all(STATE, lambda state: [0.0] * 7, kind=pa.list_(pa.float32())),
        f"{STATE} has 7 elements",
    ),
    "a state of a fixed length 7": Damage(
        replace_all(STATE, lambda state: [0.0] * 7, kind=pa.list_(pa.float32(), 7)),
        f"{STATE} has 7 elements",
    ),
    "ragged states": Damage(set_frames(STATE, [0.0], slice(1, 2), kind=pa.list_(pa.float32())), "has 1 elements"),
    "a state null": Damage(set_frames(STATE, None, slice(2, 3)), f"{STATE} is null at frame 2"),
    "half a state null": Damage(set_frames(STATE, [0.0, None], slice(2, 3)), "an element that is null"),
    "a state not finite": Damage(set_frames(STATE, [0.0, np.inf], slice(2, 3)), f"{STATE} is not finite at frame 2"),
    "an action not finite": Damage(set_frames("action", [float("nan"), 0.0], slice(2, 3)), "action is not finite"),
    "a task state not finite": Damage(
        set_frames("excav.task_state", [float("nan"), 0.0], slice(2, 3)), "excav.task_state is not finite at frame 2"
    ),
    "states as numbers": Damage(replace_all(STATE, lambda state: 0.0, kind=pa.float32()), "is stored as float"),
    "scenes as words": Damage(
        replace_all("excav.scene_id", str, kind=pa.string()),
        "excav.scene_id is stored as string",
    ),
    "wide states": Damage(cast(STATE, pa.list_(pa.float64())), f"{STATE} is stored as list<element: double>"),
    "pictures as words": Damage(
        replace_all(MAIN, lambda picture: "x", kind=pa.string()),
        f"{MAIN} is stored as string",
    ),
}  # fmt: skip

PICTURES = {
    "a truncated picture": Damage(set_picture(lambda file: file[: len(file) // 2]), f"{MAIN}: the picture of frame 1"),
    "an empty picture": Damage(set_picture(lambda file: b""), f"{MAIN}: the picture of frame 1 cannot be read"),
    "no picture": Damage(set_picture(lambda file: None), f"{MAIN}: frame 1 holds no picture"),
    "no pictures": Damage(set_picture(lambda file: None, frames=slice(None)), f"{MAIN}: frame 0 holds no picture"),
    "a picture null": Damage(set_frames(MAIN, None, slice(1, 2)), f"{MAIN} is null at frame 1"),
    "a picture with a flipped bit": Damage(set_picture(flipped), f"{MAIN}: the picture of frame 1 cannot be read"),
    "black pictures": Damage(set_picture(black, frames=slice(None)), f"{MAIN}: the picture of frame 0 shows nothing"),
    "one black picture": Damage(set_picture(black), f"{MAIN}: the picture of frame 1 shows nothing"),
    "a huge picture": Damage(set_picture(lambda file: bomb()), f"{MAIN}: the picture of frame 1"),
    "a large picture": Damage(set_picture(lambda file: bomb(9000)), "has 9000 x 9000 px, declared are 32 x 48"),
    "a smaller picture": Damage(
        set_picture(lambda file: encoded(Image.open(io.BytesIO(file)).resize((24, 16)))), "has 16 x 24 px"
    ),
    "a picture without colours": Damage(set_picture(converted("L")), "has the mode 'L' instead of 'RGB'"),
    "a picture with opacity": Damage(set_picture(converted("RGBA")), "has the mode 'RGBA' instead of 'RGB'"),
    "a picture of another kind": Damage(
        set_picture(lambda file: encoded(Image.open(io.BytesIO(file)), "BMP")), f"{MAIN}: the picture of frame 1 cannot"
    ),
    "a damaged mask": Damage(set_picture(flipped, key=MASK), f"{MASK}: the picture of frame 1 cannot be read"),
    "an empty mask": Damage(set_picture(black, key=MASK, frames=slice(None)), "the target mask is empty"),
}

METADATA = {
    "another length": Damage(set_metadata("length", 99), "meta/episodes gives it the length 99"),
    "length null": Damage(set_metadata("length", None), "length=None"),
    "another first row": Damage(set_metadata("dataset_from_index", 3), "dataset_from_index=3"),
    "another last row": Damage(set_metadata("dataset_to_index", 3), "dataset_to_index=3"),
    "another number": Damage(set_metadata("episode_index", 9), "episode_index=9 in the row of episode 2"),
    "another file": Damage(set_metadata("data/file_index", 9), "file-009.parquet is missing"),
    "a camera of depths": Damage(set_feature(MAIN, info={"is_depth_map": True}), f"{MAIN}: is_depth_map=True"),
    "another task": Damage(set_metadata("tasks", ["Dance."]), "gives it the tasks ['Dance.']"),
    "no task": Damage(set_metadata("tasks", []), "tasks"),
    "tasks without numbers": Damage(
        edit_tasks(lambda tasks: tasks.rename(columns={"task_index": "number"})), "meta/tasks.parquet cannot be read"
    ),
    "tasks with other numbers": Damage(edit_tasks(lambda tasks: tasks + 3), "tasks with the numbers [3]"),
    "a task without words": Damage(edit_tasks(lambda tasks: tasks.set_index(np.array([5]))), "names no task"),
    "no statistics of the state": Damage(
        edit_json("meta/stats.json", lambda stats: stats.pop(STATE)), f"meta/stats.json: {STATE} lacks min"
    ),
    "no statistics of a camera": Damage(
        edit_json("meta/stats.json", lambda stats: stats.pop(NEAR)), f"{NEAR} lacks min"
    ),
    "no mean": Damage(edit_json("meta/stats.json", lambda stats: stats[STATE].pop("mean")), f"{STATE} lacks mean"),
    "a mean null": Damage(set_statistic(STATE, "mean", [None, None]), f"{STATE} has a mean that is not finite"),
    "a mean of words": Damage(set_statistic(STATE, "mean", ["a", "b"]), f"{STATE} has mean="),
    "a mean of one": Damage(set_statistic(STATE, "mean", [0.0]), f"{STATE} has mean of shape (1,)"),
    "a mean beyond": Damage(set_statistic("action", "mean", [7.0, 7.0]), "action has a mean outside of min and max"),
    "another mean": Damage(set_statistic("action", "mean", [0.01, 0.01]), "action has mean=0.01 of element 0"),
    "another std": Damage(set_statistic("action", "std", [9.0, 9.0]), "action has std=9 of element 0"),
    "a std below 0": Damage(set_statistic(STATE, "std", [-1.0, 1.0]), "a std below 0"),
    "a min above the max": Damage(set_statistic(STATE, "min", [9.0, 9.0]), "a min above its max"),
    "nothing counted": Damage(set_statistic(STATE, "count", [0]), "a count below 1"),
}

VIDEO = "videos/observation.images.main/chunk-000/file-002.mp4"
MASK_VIDEO = "videos/observation.images.target_mask/chunk-000/file-002.mp4"

VIDEOS = {
    "no video": Damage(remove(VIDEO), f"{VIDEO} is missing"),
    "an empty video": Damage(write(VIDEO, b""), f"{VIDEO} cannot be read"),
    "a truncated video": Damage(truncate(VIDEO), f"{VIDEO} cannot be read"),
    "a video with a flipped bit in its pictures": Damage(flip(VIDEO, 0.3), f"{VIDEO} cannot be read"),
    "a video of another place": Damage(
        lambda root: shutil.copy(root / VIDEO, root / MASK_VIDEO), "the target mask is not binary"
    ),
    "a video that begins later": Damage(
        set_metadata(f"videos/{MAIN}/from_timestamp", 0.35), "lacks the picture at 0.350"
    ),
    "a video of no file": Damage(set_metadata(f"videos/{MAIN}/file_index", 9), "file-009.mp4 is missing"),
    "a video that begins at no time": Damage(
        set_metadata(f"videos/{MAIN}/from_timestamp", None), "from_timestamp=None"
    ),
    "no meta/episodes": Damage(remove("meta/episodes"), "its videos cannot be found without meta/episodes"),
    "no pattern of paths": Damage(drop_info("video_path"), "is missing"),
    "a mask with losses": Damage(
        edit_json("meta/info.json", lambda info: info["features"][MASK]["info"].update({"video.crf": 30})),
        "blurs the mask",
    ),
}
"""Of a dataset with videos."""


SEEN_BY_LEROBOT_ALONE = Damage(add_metadata_file, "opened by LeRobot as for training, cannot be read")

HARMFUL = {**FILES, **INFO, **COLUMNS, **PICTURES, **METADATA}

HARMLESS = {
    "nothing": Damage(lambda root: None),
    "a Mac's files where LeRobot does not look": Damage(
        lambda root: [
            add(path)(root) for path in ("._meta", "meta/._info.json", "meta/.DS_Store", "data/._chunk-000",
                                         "data/chunk-000/.DS_Store", "data/x.parquet")
        ]
    ),
    "a junk index of pairs": Damage(write("meta/excav_pairs.parquet", b"junk")),
    "an index of pairs without verdicts": Damage(
        lambda root: pq.write_table(pa.table({"fingerprint": [["a"], None]}), root / "meta/excav_pairs.parquet")
    ),
    "an index of pairs with other verdicts": Damage(
        lambda root: pq.write_table(
            pa.table({"fingerprint": [["a"]], "qc": [3], "qc_problem": [None]}), root / "meta/excav_pairs.parquet"
        )
    ),
    "no index of pairs": Damage(remove("meta/excav_pairs.parquet")),
    "no settings of the recording": Damage(remove("meta/excav_demonstrations.json")),
    "columns in another order": Damage(edit_table(lambda table: table.select(table.column_names[::-1]))),
    "no description in the table": Damage(edit_table(lambda table: table.replace_schema_metadata(None))),
    "states as lists of any length": Damage(cast(STATE, pa.list_(pa.float32()))),
    "another declared column": Damage(
        lambda root: [
            edit_table(lambda table: table.append_column("note", pa.array(["x"] * len(table))))(root),
            edit_json(
                "meta/info.json",
                lambda info: info["features"].update(note={"dtype": "string", "shape": [1], "names": None}),
            )(root),
        ]
    ),
    "small row groups": Damage(
        lambda root: pq.write_table(pq.read_table(root / DATA), root / DATA, row_group_size=5)
    ),
    "unknown fields of info.json": Damage(set_info(total_videos=0, note="mine")),
    "statistics of more columns": Damage(edit_json("meta/stats.json", lambda stats: stats.update(note={"count": [1]}))),
    "other statistics of numbers": Damage(edit_json("meta/stats.json", lambda stats: stats.pop("index"))),
}  # fmt: skip
