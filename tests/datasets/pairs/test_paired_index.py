import shutil

import pandas as pd
import pytest
from lerobot.datasets import delete_episodes, merge_datasets, split_dataset

from lerobot_excav.datasets.pairs.pair_coverage import pair_coverage
from lerobot_excav.datasets.pairs.paired_index import INDEX_PATH, build_index, store_index, write_index
from lerobot_excav.errors import DatasetError

from ..toy import load


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
    expected = {
        "pair_uid": "toy_reach/train/1/0/2",
        "scene_set": "train",
        "scene_id": 1,
        "stage": 0,
        "target_id": 2,
        "final_target_id": 2,
        "commands": 1,
        "simulation_version": 1,
        "table": "wood",
        "mask_source": "oracle",
        "success": True,
        "operator": "scripted",
        "intervention_frames": 0,
        "qc": "unchecked",
    }
    assert row[list(expected)].to_dict() == expected
    assert row["length"] == len(load(paired_dataset, [6]))
    # The task's own outcome, from its task states.
    assert 0.0 < row["final_distance_m"] < 0.12


def test_missing_and_duplicate_targets_are_found(paired_dataset):
    index = build_index(paired_dataset)
    coverage = pair_coverage(index)
    assert (coverage.scenes, coverage.starts, coverage.targets, coverage.complete_starts) == (5, 5, 4, 4)
    assert coverage.missing == {"toy_reach/train/3/0": [1]}
    assert coverage.duplicates == {}
    twice = pd.concat([index, index.iloc[[2]].assign(episode_index=19)])
    assert pair_coverage(twice).duplicates == {"toy_reach/train/0/0/2": [2, 19]}


def test_verdicts_follow_their_episode_when_episodes_are_deleted(paired_dataset, tmp_path):
    delete_episodes(load(paired_dataset), [0, 7], output_dir=tmp_path / "d", repo_id="local/d")
    original = build_index(paired_dataset)
    original.loc[original["episode_index"] == 4, ["qc", "qc_problem"]] = ["failed", "odd"]
    store_index(tmp_path / "d", original)
    edited = write_index(tmp_path / "d")
    assert edited["episode_index"].tolist() == list(range(17))
    assert same_episodes(edited, original[~original["episode_index"].isin([0, 7])])
    failed = edited[edited["qc"] == "failed"]
    assert failed[["episode_index", "qc_problem"]].to_numpy().tolist() == [[3, "odd"]]


@pytest.mark.slow
@pytest.mark.parametrize("fixture", ["paired_dataset", "changing_datasets"])
def test_the_index_survives_splitting_and_merging(request, fixture, tmp_path):
    dataset = request.getfixturevalue(fixture)
    dataset = dataset["image"] if isinstance(dataset, dict) else dataset
    parts = split_dataset(load(dataset), {"a": [0, 3, 5], "b": [1, 2, 6]}, output_dir=tmp_path)
    merged = merge_datasets([parts["b"], parts["a"]], "local/m", output_dir=tmp_path / "m")
    original = build_index(dataset)
    index = write_index(merged.root)
    assert same_episodes(index, original[original["episode_index"].isin([0, 3, 5, 1, 2, 6])])
    assert index["pair_uid"].tolist()[:3] == original["pair_uid"][[1, 2, 6]].tolist()


def test_the_stored_index_is_the_one_that_the_columns_give_and_a_stale_one_is_not_trusted(paired_dataset, tmp_path):
    expected = build_index(paired_dataset)
    pd.testing.assert_frame_equal(pd.read_parquet(paired_dataset / INDEX_PATH), expected)
    shutil.copytree(paired_dataset, tmp_path / "d")
    store_index(tmp_path / "d", expected.iloc[:3])
    assert len(build_index(tmp_path / "d")) == 19
    (tmp_path / "d" / INDEX_PATH).unlink()
    assert len(build_index(tmp_path / "d")) == 19


def test_a_folder_without_dataset_is_refused(tmp_path):
    with pytest.raises(DatasetError, match="not a LeRobot dataset"):
        build_index(tmp_path)
