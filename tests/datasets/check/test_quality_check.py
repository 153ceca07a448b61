import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from lerobot.datasets import LeRobotDataset, merge_datasets

from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.pairs.paired_index import build_index
from lerobot_excav.errors import ConfigurationError, DatasetError


@pytest.fixture
def tampered(paired_dataset, tmp_path):
    """Copy the dataset with some values of one column changed: `change(values, episode_index)` edits a list."""

    def tamper(key, change):
        root = tmp_path / "tampered"
        shutil.copytree(paired_dataset, root)
        (path,) = root.glob("data/*/*.parquet")
        table = pq.read_table(path)
        column = table.column_names.index(key)
        values = table[key].to_pylist()
        change(values, np.array(table["episode_index"].to_pylist()))
        changed = table.set_column(
            column, table.schema.field(key), pa.array(values, table.schema.field(key).type)
        )
        pq.write_table(changed, path)
        return root

    return tamper


def frames_of(episode, index):
    return np.flatnonzero(index == episode)


def problems(root, toy_rig, **options):
    rows = check_dataset(root, rig=toy_rig(), **{"replays": 0, **options})
    return dict(rows[rows["qc"] == "failed"][["episode_index", "qc_problem"]].to_numpy().tolist())


def test_a_sound_dataset_passes_and_the_index_says_so(paired_dataset, toy_rig, tmp_path):
    shutil.copytree(paired_dataset, tmp_path / "d")
    rows = check_dataset(tmp_path / "d", replays=19, rig=toy_rig())
    assert rows["replayed"].all()
    assert build_index(tmp_path / "d")["qc"].tolist() == ["passed"] * 19


def test_only_the_episodes_asked_for_are_checked(paired_dataset, toy_rig, tmp_path):
    shutil.copytree(paired_dataset, tmp_path / "d")
    rows = check_dataset(tmp_path / "d", episodes=[2, 5], replays=1, rig=toy_rig())
    assert rows["episode_index"].tolist() == [2, 5]
    assert rows["replayed"].sum() == 1
    assert build_index(tmp_path / "d")["qc"].value_counts().to_dict() == {"unchecked": 17, "passed": 2}
    with pytest.raises(ConfigurationError, match=r"--episodes names \[19\]"):
        check_dataset(tmp_path / "d", episodes=[19], rig=toy_rig())


def test_values_that_are_not_finite_are_found(tampered, toy_rig):
    def change(values, index):
        values[frames_of(4, index)[2]][1] = float("nan")

    assert problems(tampered("observation.state", change), toy_rig) == {
        4: "observation.state is not finite at frame 2"
    }


def test_actions_out_of_range_are_found(tampered, toy_rig):
    def change(values, index):
        values[frames_of(4, index)[2]][1] = -1.5

    assert problems(tampered("action", change), toy_rig) == {
        4: "action boom.vel reaches -1.5; allowed are -1 to 1"
    }


def test_actions_that_the_environment_clips_are_accepted(tampered, toy_rig):
    def change(values, index):
        values[frames_of(4, index)[2]][1] = -1.1

    found = problems(tampered("action", change), toy_rig)
    assert not any("action" in problem for problem in found.values())


def test_a_mask_that_changes_is_found(tampered, toy_rig):
    def change(values, index):
        values[frames_of(4, index)[3]] = values[frames_of(5, index)[0]]

    found = problems(tampered("observation.images.target_mask", change), toy_rig)
    assert found == {4: "the target mask changes within the episode"}


def test_a_mask_that_is_a_photograph_is_found(tampered, paired_dataset, toy_rig):
    main = pq.read_table(next(paired_dataset.glob("data/*/*.parquet")))["observation.images.main"].to_pylist()

    def change(values, index):
        for frame in frames_of(4, index):
            values[frame] = main[0]

    (problem,) = problems(tampered("observation.images.target_mask", change), toy_rig).values()
    assert problem.startswith("the target mask is not binary")


def test_the_mask_of_another_target_is_found(tampered, toy_rig):
    def change(values, index):
        for frame in frames_of(5, index):
            values[frame] = values[frames_of(6, index)[0]]

    found = problems(tampered("observation.images.target_mask", change), toy_rig)
    assert found == {6: "target 2 has the mask of target 1"}


def test_paired_episodes_that_start_differently_are_found(tampered, toy_rig):
    def change(values, index):
        values[frames_of(5, index)[0]][0] += 0.5

    found = problems(tampered("observation.state", change), toy_rig)
    assert found == {5: "starts in another state than episode 4 of the same scene"}


def test_paired_episodes_with_another_first_view_are_found(tampered, toy_rig):
    def change(values, index):
        values[frames_of(5, index)[0]] = values[frames_of(9, index)[0]]

    found = problems(tampered("observation.images.main", change), toy_rig)
    assert found == {5: "starts with another view than episode 4 of the same scene"}


def test_contradicting_columns_are_refused(tampered, toy_rig):
    def change(values, index):
        values[frames_of(5, index)[0]] = 9

    with pytest.raises(DatasetError, match=r"episode 5: excav.scene_id changes within the episode"):
        check_dataset(tampered("excav.scene_id", change), rig=toy_rig())


@pytest.mark.parametrize(
    ("key", "element", "message"),
    [
        ("observation.state", 2, "replay leaves the recorded state at frame 3"),
        ("excav.task_state", 0, "replay gives another bucket_mass_kg (by up to 7)"),
    ],
)
def test_a_replay_that_deviates_is_found(tampered, toy_rig, key, element, message):
    def change(values, index):
        values[frames_of(5, index)[3]][element] += 7

    (problem,) = problems(tampered(key, change), toy_rig, episodes=[5], replays=1).values()
    assert problem.startswith(message)


def test_a_wrong_outcome_is_found(tampered, toy_rig):
    def change(values, index):
        for frame in frames_of(5, index):
            values[frame] = False

    found = problems(tampered("excav.success", change), toy_rig, episodes=[5], replays=1)
    assert found == {5: "replay ends with success=True, recorded False"}


def test_every_episode_is_replayed_on_its_own_soil(record_toy, toy_rig, tmp_path, monkeypatch):
    for soil in ("gravel", "dirt"):
        record_toy(tmp_path / soil, scenes=1, targets=1, soil=soil, fidelity="fast")
    parts = [LeRobotDataset("local/p", root=tmp_path / s, video_backend="pyav") for s in ("gravel", "dirt")]
    merge_datasets(parts, "local/m", output_dir=tmp_path / "m")
    made, make = [], toy_rig.environment
    monkeypatch.setattr(
        toy_rig, "environment", lambda self, settings: (made.append(settings), make(self, settings))[1]
    )
    assert set(check_dataset(tmp_path / "m", replays=2, rig=toy_rig())["qc"]) == {"passed"}
    assert [(settings.soil, settings.fidelity) for settings in made] == [("gravel", "fast"), ("dirt", "fast")]
