"""Datasets that were changed at random, judged by `qc` and indexed by `index`."""

import json
import shutil

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.datasets.check import quality_check, readability

from ..datasets import changes
from ..datasets.damage import HARMFUL, HARMLESS, VIDEOS
from ..datasets.toy import MAIN, MASK, STATE, record_small
from .mutation import digests, harmful, harmless, inputs, require_kept, require_right, run

pytestmark = pytest.mark.slow

CAMERAS = (MAIN, MASK, "observation.images.near")
NUMBERS = ("index", "frame_index", "episode_index", "task_index", "excav.scene_id", "excav.stage")
VECTORS = (STATE, "action", "excav.task_state", "excav.outcome")
COLUMNS = (*NUMBERS, *VECTORS, *CAMERAS, "timestamp", "excav.success", "excav.pair_uid", "excav.target_id")
FILES = ("meta/info.json", "meta/stats.json", "meta/tasks.parquet", changes.META, changes.DATA)
INFO = ("fps", "total_episodes", "total_frames", "total_tasks", "features", "codebase_version", "robot_type")
DERIVED = ("meta/excav_pairs.parquet",)


@pytest.fixture(scope="session")
def stored(tmp_path_factory):
    """Two scenes with two targets, by storage. Not to be changed by tests."""
    return record_small(tmp_path_factory.mktemp("stored"))


def in_frame(number, change):
    """Return a change of one value of a column, in some frame of the dataset."""

    def edit(values, rows):
        place = number % len(values)
        values[place] = change(values[place])

    return edit


def with_element(number, value):
    """Return a vector with another element."""

    def change(vector):
        changed = list(vector)
        changed[number % len(changed)] = value
        return changed

    return change


@st.composite
def changed_values(draw):
    """Draw a change of one value in one frame."""
    frame, kind = draw(st.integers(0, 10_000)), draw(st.sampled_from(["null", "not finite", "number", "time", "flag"]))
    if kind == "null":
        key, change = draw(st.sampled_from(COLUMNS)), lambda value: None
    elif kind == "not finite":
        key, wrong = draw(st.sampled_from(VECTORS)), draw(st.sampled_from([np.nan, np.inf, -np.inf]))
        change = with_element(draw(st.integers(0, 9)), wrong)
    elif kind == "number":
        key, shift = draw(st.sampled_from(NUMBERS)), draw(st.integers(-50, 50).filter(bool))
        change = lambda value: value + shift  # noqa: E731
    elif kind == "time":
        key, shift = "timestamp", draw(st.sampled_from([-1.0, -0.05, 0.02, 0.1, 7.0]))
        change = lambda value: value + shift  # noqa: E731
    else:
        key, change = "excav.success", lambda value: not value
    return harmful(f"{key}: {kind} in frame {frame}", changes.set_column(key, in_frame(frame, change)))


@st.composite
def changed_pictures(draw):
    """Draw a change of one picture."""
    frame, key = draw(st.integers(0, 10_000)), draw(st.sampled_from(CAMERAS))
    kind = draw(st.sampled_from(["cut", "flipped", "garbage", "other size", "other mode", "written again"]))
    share = draw(st.floats(0.0, 0.9))
    file_change = {
        "cut": lambda file: file[: int(share * len(file))],
        "flipped": lambda file: changes.flipped(file, 0.5 + share / 4),
        "garbage": lambda file: bytes(50),
        "other size": lambda file: changes.encoded(np.full((16, 16, 3), 99, np.uint8)),
        "other mode": changes.converted(draw(st.sampled_from(["L", "RGBA", "P", "1"]))),
        "written again": lambda file: file,
    }[kind]
    label = harmless if kind == "written again" else harmful
    change = in_frame(frame, lambda value: {**value, "bytes": file_change(value["bytes"])})
    return label(f"{key}: {kind} ({share:.2f}) in frame {frame}", changes.set_column(key, change))


@st.composite
def changed_columns(draw):
    """Draw a column that is gone, renamed or of another type."""
    key, kind = draw(st.sampled_from(COLUMNS)), draw(st.sampled_from(["gone", "renamed", "as words"]))
    if kind == "gone":
        return harmful(f"{key} is gone", changes.drop_column(key))
    if kind == "as words":
        words = changes.replace_all(key, lambda value: "x", kind=pa.string())
        is_text = key == "excav.pair_uid"
        return harmful(f"{key} as words{' that name no pair' * is_text}", words)

    def rename(table):
        return table.rename_columns([f"x_{name}" if name == key else name for name in table.column_names])

    return harmful(f"{key} renamed", changes.edit_table(rename))


@st.composite
def changed_files(draw):
    """Draw a file that is cut off, gone or something else, or one more."""
    path, kind = draw(st.sampled_from(FILES)), draw(st.sampled_from(["cut off", "gone", "garbage", "one more"]))
    share = draw(st.floats(0.0, 0.95))
    if kind == "cut off":
        return harmful(f"{path} cut off at {share:.2f}", changes.truncate(path, share))
    if kind == "gone":
        return harmful(f"{path} is gone", changes.remove(path))
    if kind == "garbage":
        return harmful(f"{path} is garbage", changes.write(path, draw(st.binary(max_size=64))))
    name = draw(st.sampled_from(["notes.txt", "meta/notes.md", "data/x.bin", "videos.zip"]))
    return harmless(f"{name} beside it", changes.add(name))


@st.composite
def changed_info(draw):
    """Draw an `info.json` in which something needed is missing or of another kind."""
    name = draw(st.sampled_from(INFO))
    value = draw(st.sampled_from([None, [], {}, "x", -1, 0.5, True, 10**15]))
    if draw(st.booleans()):
        return harmful(f"info.json lacks {name}", changes.drop_info(name))
    return harmful(f"info.json: {name}={value!r}", changes.set_info(**{name: value}))


def named(table, label):
    """Draw one of the changes that the tests of `qc` know by name."""
    return st.sampled_from(sorted(table)).map(lambda name: label(name, table[name].apply))


IMAGE_CHANGES = st.one_of(
    *(changed_values(), changed_pictures(), changed_columns(), changed_files(), changed_info()),
    *(named(HARMFUL, harmful), named(HARMLESS, harmless)),
)


def judge(change, root, folder, monkeypatch=None):
    """Check and index a changed dataset, beside the files of somebody else."""
    shutil.copytree(root, folder / "d")
    change.apply(folder / "d")
    (folder / "d" / "thesis.md").write_text("three years of work")
    before = digests(folder, own=DERIVED)
    if monkeypatch is not None and change.is_harmful:
        # To open what is left takes most of the time; what LeRobot alone objects to has a test of its own.
        monkeypatch.setattr(readability, "opening_problem", lambda *_, **__: "")
    require_right(change, run("qc", folder / "d", "--replays=0"))
    indexed = run("index", folder / "d")
    assert indexed.code in (0, 2)
    assert indexed.text.strip()
    require_kept(before, digests(folder))


@inputs(few=12)
@given(change=IMAGE_CHANGES, opens=st.sampled_from([False, False, False, True]))
def test_a_changed_dataset_is_judged_in_words(tmp_path_factory, stored, change, opens):
    with pytest.MonkeyPatch.context() as patch:
        judge(change, stored["image"], tmp_path_factory.mktemp("d"), None if opens else patch)


@inputs(few=3, many=100)
@given(change=named(VIDEOS, harmful))
def test_a_changed_dataset_with_videos_is_judged_in_words(tmp_path_factory, stored, change):
    with pytest.MonkeyPatch.context() as patch:
        judge(change, stored["video"], tmp_path_factory.mktemp("d"), patch)


def test_a_check_that_believes_every_picture_is_found_out(tmp_path, stored, monkeypatch):
    monkeypatch.setattr(quality_check, "picture_problems", lambda episode: [])
    with pytest.raises(AssertionError, match="accepted in silence"):
        judge(harmful("half a picture", HARMFUL["a truncated picture"].apply), stored["image"], tmp_path, monkeypatch)


def test_a_check_that_breaks_is_found_out(tmp_path, stored, monkeypatch):
    monkeypatch.setattr(quality_check, "read_tasks", lambda *_: json.loads("{"))
    with pytest.raises(json.JSONDecodeError):
        judge(harmless("nothing", lambda root: None), stored["image"], tmp_path)


def test_an_index_that_removes_a_file_is_found_out(tmp_path, stored, monkeypatch):
    monkeypatch.setattr(quality_check, "store_index", lambda root, index: (root / "thesis.md").unlink())
    with pytest.raises(AssertionError, match=r"lost or changed: .*thesis\.md"):
        judge(harmless("nothing", lambda root: None), stored["image"], tmp_path)
