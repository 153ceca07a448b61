"""Demonstrations recorded in shards and put together by LeRobot's own tool."""

import numpy as np
import pytest
from lerobot.datasets import merge_datasets

from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.pairs.paired_index import write_index

from .toy import load, record_toy

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("storage", ["image", "video"])
def test_shards_put_together_are_the_dataset_of_one_piece(tmp_path, storage):
    record_toy(tmp_path / "whole", scenes=3, storage=storage)
    parts = [(0, 1), (1, 2)]
    for first, scenes in parts:
        record_toy(tmp_path / f"shard_{first}", first_scene=first, scenes=scenes, storage=storage)
    shards = [load(tmp_path / f"shard_{first}") for first, _ in parts]
    merge_datasets(shards, "local/merged", tmp_path / "merged", concatenate_videos=False)
    merged, whole = load(tmp_path / "merged"), load(tmp_path / "whole")
    assert len(merged) == len(whole)
    for ours, theirs in zip(merged, whole, strict=True):
        assert set(ours) == set(theirs)
        for name, value in theirs.items():
            assert np.array_equal(ours[name], value), name
    for name in set(whole.meta.stats) - {"episode_index", "index"}:  # LeRobot leaves those of the parts, and reads none
        for kind in ("min", "max", "mean", "std", "count"):
            np.testing.assert_allclose(
                merged.meta.stats[name][kind], whole.meta.stats[name][kind], rtol=1e-5, atol=1e-6
            )
    indices = [write_index(tmp_path / name) for name in ("merged", "whole")]
    assert indices[0].drop(columns=["qc", "qc_problem"]).equals(indices[1].drop(columns=["qc", "qc_problem"]))
    assert check_dataset(tmp_path / "merged", replays=2).has_passed


def test_a_single_shard_can_be_put_together_too(tmp_path):
    record_toy(tmp_path / "only", scenes=1)
    merge_datasets([load(tmp_path / "only")], "local/merged", tmp_path / "merged", concatenate_videos=False)
    assert check_dataset(tmp_path / "merged", replays=1).has_passed
