import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import toy_reach.spec
import toy_reach.table
from lerobot.datasets import merge_datasets

from lerobot_excav.datasets.check.quality_check import check_dataset, note_verdicts
from lerobot_excav.datasets.format.schema import SUCCESS_KEY, TARGET_KEY, TASK_STATE_KEY
from lerobot_excav.datasets.pairs.paired_index import build_index
from lerobot_excav.errors import ConfigurationError, DatasetError

from ..toy import MAIN, MASK, STATE, load, record_toy


@pytest.fixture
def tampered(paired_dataset, tmp_path):
    """Copy the dataset with a column changed: `change(values, rows)` edits a list; `rows[e]` are of an episode."""

    def tamper(key, change):
        root = tmp_path / "tampered"
        shutil.copytree(paired_dataset, root)
        (path,) = root.glob("data/*/*.parquet")
        table = pq.read_table(path)
        values = table[key].to_pylist()
        episodes = np.array(table["episode_index"].to_pylist())
        change(values, [np.flatnonzero(episodes == episode).tolist() for episode in range(19)])
        field = table.schema.field(key)
        pq.write_table(table.set_column(table.column_names.index(key), field, pa.array(values, field.type)), path)
        return root

    return tamper


def problems(root, **options):
    rows = check_dataset(root, **{"replays": 0, **options}).episodes
    return dict(rows[rows["qc"] == "failed"][["episode_index", "qc_problem"]].to_numpy().tolist())


def test_the_episodes_asked_for_are_checked_and_the_index_says_so(paired_dataset, tmp_path):
    shutil.copytree(paired_dataset, tmp_path / "d")
    report = check_dataset(tmp_path / "d", episodes=[2, 5], replays=1)
    assert report.episodes["episode_index"].tolist() == [2, 5]
    assert report.episodes["replayed"].sum() == 1
    note_verdicts(tmp_path / "d", report)
    assert build_index(tmp_path / "d")["qc"].value_counts().to_dict() == {"unchecked": 17, "passed": 2}
    with pytest.raises(ConfigurationError, match=r"--episodes names \[19\]"):
        check_dataset(tmp_path / "d", episodes=[19])
    with pytest.raises(ConfigurationError, match="names no episode"):
        check_dataset(tmp_path / "d", episodes=[])
    report = check_dataset(tmp_path / "d", replays=19)
    assert report.has_passed
    assert report.episodes["replayed"].all()
    note_verdicts(tmp_path / "d", report)
    assert build_index(tmp_path / "d")["qc"].tolist() == ["passed"] * 19


def set_element(episode, frame, element, value):
    def change(values, rows):
        values[rows[episode][frame]][element] = value

    return change


def set_frames(value, frames=slice(None)):
    """Write a value into frames of episode 5."""
    return lambda values, rows: [values.__setitem__(row, value) for row in rows[5][frames]]


def copy_frames(episode, source, frames=slice(None)):
    """Show in an episode what another one showed first."""
    return lambda values, rows: [values.__setitem__(row, values[rows[source][0]]) for row in rows[episode][frames]]


@pytest.mark.parametrize(
    ("key", "change", "expected"),
    [
        (STATE, set_element(4, 2, 1, np.nan), {4: "observation.state is not finite at frame 2"}),
        ("action", set_element(4, 2, 1, -1.5), {4: "action y.vel reaches -1.5; allowed are -1 to 1"}),
        ("action", set_element(4, 2, 1, -1.1), {4: "replay leaves"}),  # the environment clips such actions
        (MASK, copy_frames(5, 6), {6: "target 2 has the mask of target 1"}),
        (MASK, copy_frames(4, 5, slice(3, 4)), {4: "the target mask changes between frames 0 and 5, though the comm"}),
        (TARGET_KEY, set_frames(2, slice(-1, None)), {5: "excav.target_id changes at frame 7, though by excav.comm"}),
        ("excav.command_frame", set_frames(2), {5: "excav.command_frame=2 at frame 0, where a command begins; it has"}),
        (STATE, set_element(5, 0, 0, 0.5), {5: "starts in another state than episode 4 of the same scene"}),
        (MAIN, copy_frames(5, 9, slice(1)), {5: "starts with another view than episode 4 of the same scene"}),
        (STATE, set_element(5, 3, 1, 7.0), {5: "replay leaves the recorded state at frame 3"}),
        (TASK_STATE_KEY, set_element(5, 3, 1, 7.0), {5: "replay gives another frames_on_target (by up to 7)"}),
        ("excav.outcome", set_frames([0.0, 9.0]), {5: "replay gives another frames_on_target"}),
        (SUCCESS_KEY, set_frames(value=False), {5: "replay ends with success=True, recorded False"}),
        ("excav.table", set_frames("ice"), {5: "replay leaves the recorded state at frame 1"}),
    ],
)
def test_what_is_wrong_is_found(tampered, key, change, expected):
    found = problems(tampered(key, change), episodes=range(3, 11), replays=8)
    assert found.keys() == expected.keys()
    assert all(found[episode].startswith(problem) for episode, problem in expected.items())


def test_contradicting_columns_are_a_verdict_and_no_index_is_made(tampered):
    root = tampered("excav.scene_id", set_frames(9, slice(1)))
    report = check_dataset(root)
    assert report.episodes["qc_problem"][5].startswith("excav.scene_id changes within the episode")
    assert not report.has_passed
    with pytest.raises(DatasetError, match=r"episode 5: excav\.scene_id changes within the episode"):
        note_verdicts(root, report)


def test_a_replay_by_another_simulation_is_found(paired_dataset, tmp_path, monkeypatch):
    shutil.copytree(paired_dataset, tmp_path / "d")
    monkeypatch.setattr(toy_reach.table, "SPEED_M_S", 1.1)
    found = problems(tmp_path / "d", episodes=[4], replays=1)
    assert found[4].startswith("replay leaves the recorded state at frame 1")


@pytest.mark.slow
def test_sound_episodes_of_other_masks_and_tables_pass_also_together(tmp_path):
    others = {
        "oracle": {"table": "ice"},
        "oracle, zero": {"mask_condition": "zero"},
        "oracle, mismatched": {"mask_condition": "mismatched"},
        "oracle, dilate 40 px": {"mask_noise": "dilate", "mask_noise_px": 40},
        "oracle, shift 1 px, snapped": {"mask_noise": "shift", "mask_noise_px": 1, "mask_snap": True},
        "oracle, as overlay": {"target_overlay": True},
    }
    for words, env in others.items():
        record_toy(tmp_path / words, scenes=1, env=env)
    merge_datasets([load(tmp_path / words) for words in others], "local/m", output_dir=tmp_path / "m")
    report = check_dataset(tmp_path / "m", replays=20)
    assert report.problems == []
    assert report.episodes["qc_problem"].tolist() == [""] * 24
    rows = build_index(tmp_path / "m")
    assert rows["table"].tolist() == ["ice"] * 4 + ["wood"] * 20
    assert rows["mask_source"].tolist() == [words for words in others for _ in range(4)]


@pytest.mark.parametrize("words", ["oracle", "zero_shot"])
def test_an_empty_mask_is_found_unless_it_was_asked_for(tmp_path, monkeypatch, words):
    monkeypatch.setattr(toy_reach.spec.ReachSettings, "mask_words", words)
    record_toy(tmp_path / "d", scenes=1, targets=1, env={"mask_condition": "zero"})
    assert problems(tmp_path / "d") == {0: "the target mask is empty from frame 0 on"}


@pytest.mark.parametrize(
    ("env", "problem"),
    [
        ({"mask_noise": "flicker", "mask_noise_px": 2}, "the target mask changes between frames"),
        ({"mask_condition": "zero"}, "the target mask is empty in every frame"),
    ],
)
def test_a_mask_that_drops_out_is_the_same_otherwise_and_not_always_gone(tmp_path, monkeypatch, env, problem):
    monkeypatch.setattr(toy_reach.spec.ReachSettings, "mask_words", "oracle, dropout 50 %")
    record_toy(tmp_path / "d", scenes=1, targets=1, env=env)
    assert problems(tmp_path / "d")[0].startswith(problem)


@pytest.mark.parametrize("env", [{"mask_noise": "flicker", "mask_noise_px": 2}, {"mask_dropout": 0.5}])
def test_masks_that_flicker_or_drop_out_pass_where_the_dataset_says_so(tmp_path, env):
    root = tmp_path / "unsteady"
    record_toy(root, scenes=1, targets=2, env=env)
    assert problems(root, replays=2) == {}
    masks = [frame[MASK].numpy() for frame in load(root)]
    assert len({mask.tobytes() for mask in masks}) > (2 if "mask_dropout" in env else len(masks) // 2)
    assert any(not mask.any() for mask in masks) == ("mask_dropout" in env)
