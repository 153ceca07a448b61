import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import toy_reach.table
from lerobot.datasets import merge_datasets

from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.format.schema import MASK_SOURCE_KEY
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
    rows = check_dataset(root, **{"replays": 0, **options})
    return dict(rows[rows["qc"] == "failed"][["episode_index", "qc_problem"]].to_numpy().tolist())


def test_a_sound_dataset_passes_and_the_index_says_so(paired_dataset, tmp_path):
    shutil.copytree(paired_dataset, tmp_path / "d")
    assert check_dataset(tmp_path / "d", replays=19)["replayed"].all()
    assert build_index(tmp_path / "d")["qc"].tolist() == ["passed"] * 19


def test_only_the_episodes_asked_for_are_checked(paired_dataset, tmp_path):
    shutil.copytree(paired_dataset, tmp_path / "d")
    rows = check_dataset(tmp_path / "d", episodes=[2, 5], replays=1)
    assert rows["episode_index"].tolist() == [2, 5]
    assert rows["replayed"].sum() == 1
    assert build_index(tmp_path / "d")["qc"].value_counts().to_dict() == {"unchecked": 17, "passed": 2}
    with pytest.raises(ConfigurationError, match=r"--episodes names \[19\]"):
        check_dataset(tmp_path / "d", episodes=[19])


def set_element(episode, frame, element, value):
    def change(values, rows):
        values[rows[episode][frame]][element] = value

    return change


def copy_frames(episode, source, frames=slice(None)):
    """Show in an episode what another one showed first."""

    def change(values, rows):
        for row in rows[episode][frames]:
            values[row] = values[rows[source][0]]

    return change


@pytest.mark.parametrize(
    ("key", "change", "expected"),
    [
        (STATE, set_element(4, 2, 1, np.nan), {4: "observation.state is not finite at frame 2"}),
        ("action", set_element(4, 2, 1, -1.5), {4: "action y.vel reaches -1.5; allowed are -1 to 1"}),
        ("action", set_element(4, 2, 1, -1.1), {}),  # the environment clips it
        (
            MASK,
            copy_frames(4, 5, slice(3, 4)),
            {4: "the target mask changes between frames 0 and 5, though the command does not"},
        ),
        (
            "excav.target_id",
            lambda values, rows: values.__setitem__(rows[4][-1], 2),
            {4: "the command changes at frame 5, though the target mask does not"},
        ),
        (MASK, copy_frames(5, 6), {6: "target 2 has the mask of target 1"}),
        (STATE, set_element(5, 0, 0, 0.5), {5: "starts in another state than episode 4 of the same scene"}),
        (
            MAIN,
            copy_frames(5, 9, slice(1)),
            {5: "starts with another view than episode 4 of the same scene"},
        ),
    ],
)
def test_what_is_wrong_is_found(tampered, key, change, expected):
    assert problems(tampered(key, change)) == expected


def test_contradicting_columns_are_refused(tampered):
    def change(values, rows):
        values[rows[5][0]] = 9

    with pytest.raises(DatasetError, match=r"episode 5: excav.scene_id changes within the episode"):
        check_dataset(tampered("excav.scene_id", change))


def set_all(episode, value):
    def change(values, rows):
        for row in rows[episode]:
            values[row] = value

    return change


@pytest.mark.parametrize(
    ("key", "change", "message"),
    [
        (STATE, set_element(5, 3, 1, 7.0), "replay leaves the recorded state at frame 3"),
        ("excav.task_state", set_element(5, 3, 1, 7.0), "replay gives another frames_on_target (by up to 7)"),
        ("excav.success", set_all(5, value=False), "replay ends with success=True, recorded False"),
        ("excav.table", set_all(5, "ice"), "replay leaves the recorded state at frame 1"),
    ],
)
def test_a_replay_that_deviates_is_found(tampered, key, change, message):
    (problem,) = problems(tampered(key, change), episodes=[5], replays=1).values()
    assert problem.startswith(message)


def test_a_replay_by_another_simulation_is_found(paired_dataset, tmp_path, monkeypatch):
    shutil.copytree(paired_dataset, tmp_path / "d")
    monkeypatch.setattr(toy_reach.table, "SPEED_M_S", 1.1)
    found = problems(tmp_path / "d", episodes=[4], replays=1)
    assert found[4].startswith("replay leaves the recorded state at frame 1")


def test_every_episode_is_replayed_on_its_own_table(tmp_path):
    tables = ("wood", "ice")
    for table in tables:
        record_toy(tmp_path / table, scenes=1, targets=2, env={"table": table})
    merge_datasets([load(tmp_path / table) for table in tables], "local/m", output_dir=tmp_path / "m")
    rows = check_dataset(tmp_path / "m", replays=4)
    assert rows["qc_problem"].tolist() == [""] * 4
    assert rows["table"].tolist() == ["wood", "wood", "ice", "ice"]


@pytest.mark.parametrize(
    ("env", "words"),
    [
        ({"mask_condition": "zero"}, "oracle, zero"),
        ({"mask_condition": "mismatched"}, "oracle, mismatched"),
        ({"mask_noise": "dilate", "mask_noise_px": 40}, "oracle, dilate 40 px"),
        ({"target_overlay": True}, "oracle, as overlay"),
    ],
)
def test_sound_datasets_of_other_masks_pass(tmp_path, env, words):
    record_toy(tmp_path / "d", scenes=1, env=env)
    rows = check_dataset(tmp_path / "d", replays=1)
    assert rows["qc_problem"].tolist() == [""] * 4
    assert set(rows["mask_source"]) == {words}


def test_views_with_and_without_overlay_may_be_merged(tmp_path):
    for name in ("plain", "tinted"):
        record_toy(tmp_path / name, scenes=1, env={"target_overlay": name == "tinted"})
    merge_datasets([load(tmp_path / name) for name in ("tinted", "plain")], "local/m", output_dir=tmp_path / "m")
    assert problems(tmp_path / "m") == {}


def test_an_empty_mask_is_found_unless_it_is_named_zero(tmp_path):
    record_toy(tmp_path / "d", scenes=1, targets=1, env={"mask_condition": "zero"})
    (path,) = (tmp_path / "d").glob("data/*/*.parquet")
    table = pq.read_table(path)
    for words in ("oracle", "zero_shot"):
        column = pa.array([words] * len(table))
        pq.write_table(table.set_column(table.column_names.index(MASK_SOURCE_KEY), MASK_SOURCE_KEY, column), path)
        assert problems(tmp_path / "d") == {0: "the target mask is empty from frame 0 on"}
