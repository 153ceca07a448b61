import shutil

import pandas as pd
import pytest
from lerobot.datasets import LeRobotDataset, delete_episodes, merge_datasets, split_dataset

from lerobot_excav.datasets.pairs.pair_coverage import pair_coverage
from lerobot_excav.datasets.pairs.paired_index import INDEX_PATH, build_index, store_index, write_index
from lerobot_excav.errors import DatasetError


def load(root):
    return LeRobotDataset(f"local/{root.name}", root=root, video_backend="pyav")


def same_episodes(edited: pd.DataFrame, original: pd.DataFrame) -> bool:
    """Tell whether rows agree in everything but their numbers and verdicts."""
    columns = [c for c in original.columns if c not in ("episode_index", "qc", "qc_problem")]
    key = ["pair_uid", "fingerprint"]
    return (
        edited[columns]
        .sort_values(key, ignore_index=True)
        .equals(original[columns].sort_values(key, ignore_index=True))
    )


def test_the_index_describes_every_episode(paired_dataset):
    index = build_index(paired_dataset)
    assert index["episode_index"].tolist() == list(range(19))
    row = index.iloc[6]
    assert row["pair_uid"] == "excavator/train/1/2"
    assert (row["scene_set"], row["scene_id"], row["target_id"], row["length"]) == ("train", 1, 2, 6)
    # The toy mask of target 2 covers rows 12-15 and columns 8-15.
    assert (row["mask_area_px"], row["mask_centroid_row_px"], row["mask_centroid_column_px"]) == (
        32,
        13.5,
        11.5,
    )
    assert row["success"]
    assert row["retained_mass_kg"] == 500.0
    assert row["qc"] == "unchecked"


def test_missing_and_duplicate_targets_are_found(paired_dataset, tmp_path):
    index = build_index(paired_dataset)
    coverage = pair_coverage(index)
    assert (coverage.scenes, coverage.targets, coverage.complete_scenes) == (5, 4, 4)
    assert coverage.missing == {"excavator/train/3": [1]}
    assert coverage.duplicates == {}
    twice = pd.concat([index, index.iloc[[2]].assign(episode_index=19)])
    assert pair_coverage(twice).duplicates == {"excavator/train/0/2": [2, 19]}


def test_the_index_survives_deleting_episodes(paired_dataset, tmp_path):
    delete_episodes(load(paired_dataset), [0, 7], output_dir=tmp_path / "d", repo_id="local/d")
    edited = write_index(tmp_path / "d")
    original = build_index(paired_dataset)
    assert edited["episode_index"].tolist() == list(range(17))
    assert same_episodes(edited, original[~original["episode_index"].isin([0, 7])])


def test_the_index_survives_splitting_and_merging(paired_dataset, tmp_path):
    parts = split_dataset(load(paired_dataset), {"a": [0, 3, 5], "b": [1, 2, 18]}, output_dir=tmp_path)
    merged = merge_datasets([parts["b"], parts["a"]], "local/m", output_dir=tmp_path / "m")
    original = build_index(paired_dataset)
    index = write_index(merged.root)
    assert same_episodes(index, original[original["episode_index"].isin([0, 3, 5, 1, 2, 18])])
    assert index["pair_uid"].tolist()[:3] == original["pair_uid"][[1, 2, 18]].tolist()


def test_verdicts_follow_their_episode_when_episodes_are_renumbered(paired_dataset, tmp_path):
    delete_episodes(load(paired_dataset), [0], output_dir=tmp_path / "d", repo_id="local/d")
    index = build_index(paired_dataset)
    index.loc[index["episode_index"] == 4, ["qc", "qc_problem"]] = ["failed", "odd"]
    store_index(tmp_path / "d", index)
    rebuilt = write_index(tmp_path / "d")
    assert rebuilt[rebuilt["qc"] == "failed"][["episode_index", "qc_problem"]].to_numpy().tolist() == [
        [3, "odd"]
    ]


def test_the_stored_index_is_the_one_that_the_columns_give(paired_dataset):
    stored = pd.read_parquet(paired_dataset / INDEX_PATH)
    pd.testing.assert_frame_equal(stored, build_index(paired_dataset))


def test_a_stale_index_is_not_trusted(paired_dataset, tmp_path):
    shutil.copytree(paired_dataset, tmp_path / "d")
    store_index(tmp_path / "d", build_index(paired_dataset).iloc[:3])
    assert len(build_index(tmp_path / "d")) == 19
    (tmp_path / "d" / INDEX_PATH).unlink()
    assert len(build_index(tmp_path / "d")) == 19


def test_a_folder_without_dataset_is_refused(tmp_path):
    with pytest.raises(DatasetError, match="not a LeRobot dataset"):
        build_index(tmp_path)
