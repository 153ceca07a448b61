from collections import Counter

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.datasets.pairs.pair_coverage import pair_coverage
from lerobot_excav.datasets.pairs.selection import COMPOSITIONS, select, usable
from lerobot_excav.datasets.pairs.split import split
from lerobot_excav.errors import ConfigurationError, DatasetError


def index_of(pairs: list[tuple[int, int]], **columns: object) -> pd.DataFrame:
    """Make the columns of an index that selecting needs."""
    rows = [
        {
            "episode_index": number,
            "pair_uid": f"excavator/train/{scene}/0/{target}",
            "env": "excavator",
            "scene_set": "train",
            "task": "Reach-v0",
            "keep_out": "none",
            "density": "usual",
            "pile": "heaps",
            "scene_id": scene,
            "stage": 0,
            "target_id": target,
            "soil": "sand",
            "success": True,
            "qc": "unchecked",
        }
        for number, (scene, target) in enumerate(pairs)
    ]
    return pd.DataFrame(rows).assign(**columns)


pair_sets = st.sets(st.tuples(st.integers(0, 12), st.integers(0, 3)), min_size=1).map(sorted)


@given(pairs=pair_sets, composition=st.sampled_from(COMPOSITIONS), seed=st.integers(0, 5))
def test_a_selection_has_the_composition_it_names(pairs, composition, seed):
    index = index_of(pairs)
    if composition == "paired" and max(Counter(scene for scene, _ in pairs).values()) < len(
        {target for _, target in pairs}
    ):
        with pytest.raises(DatasetError, match="nothing paired to choose"):
            select(index, composition, seed=seed)
        return
    chosen = select(index, composition, seed=seed)
    assert set(chosen["episode_index"]) <= set(index["episode_index"])
    assert chosen["episode_index"].is_monotonic_increasing
    assert chosen["episode_index"].is_unique
    per_scene = Counter(chosen["scene_id"])
    per_target = Counter(chosen["target_id"])
    targets = index["target_id"].nunique()
    if composition == "paired":
        assert set(per_scene.values()) == {targets}
    if composition == "non-paired":
        assert set(per_scene) == set(index["scene_id"])
        assert set(per_scene.values()) == {1}
    if composition == "balanced":
        assert set(per_target.values()) == {Counter(index["target_id"]).most_common()[-1][1]}


@given(scenes=st.integers(1, 12), wanted=st.integers(1, 12), seed=st.integers(0, 5))
def test_non_paired_targets_are_equally_frequent_where_all_scenes_have_all(scenes, wanted, seed):
    index = index_of([(s, t) for s in range(scenes) for t in range(4)])
    if wanted > scenes:
        with pytest.raises(DatasetError, match=f"only {scenes} are there"):
            select(index, "non-paired", starts=wanted, seed=seed)
        return
    frequency = Counter(select(index, "non-paired", starts=wanted, seed=seed)["target_id"])
    assert max(frequency.values()) - min(frequency[t] for t in range(4)) <= 1


@given(few=st.integers(1, 6), more=st.integers(0, 6), seed=st.integers(0, 5))
def test_a_smaller_paired_selection_is_part_of_a_larger_one(few, more, seed):
    index = index_of([(s, t) for s in range(12) for t in range(4)])
    small = select(index, "paired", starts=few, seed=seed)["episode_index"]
    large = select(index, "paired", episodes=4 * (few + more), seed=seed)["episode_index"]
    assert set(small) <= set(large)
    assert len(small) == 4 * few


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"composition": "odd"}, "--select|select="),
        ({"composition": "paired", "episodes": 6}, "not a multiple of the 4 targets"),
        ({"composition": "paired", "episodes": 4, "starts": 1}, "exclude each other"),
        ({"composition": "balanced", "starts": 1}, "--starts has no meaning"),
        ({"composition": "balanced", "episodes": 3}, "cannot be balanced"),
        ({"composition": "all", "episodes": 0}, "at least 1"),
    ],
)
def test_contradictory_arguments_are_named(arguments, message):
    index = index_of([(s, t) for s in range(3) for t in range(4)])
    with pytest.raises(ConfigurationError, match=message):
        select(index, **arguments)


def test_the_seed_changes_the_choice():
    index = index_of([(s, t) for s in range(12) for t in range(4)])
    assert len({tuple(select(index, "paired", starts=3, seed=seed)["scene_id"]) for seed in range(8)}) > 1


def test_failures_rejected_episodes_and_repetitions_are_not_usable():
    index = index_of([(0, 0), (0, 1), (0, 2), (0, 2)])
    index.loc[0, "success"] = False
    index.loc[1, "qc"] = "failed"
    assert usable(index)["episode_index"].tolist() == [2]
    assert usable(index, include_failures=True)["episode_index"].tolist() == [0, 2]
    with pytest.raises(DatasetError, match="no usable episode"):
        select(usable(index.assign(success=False)), "all")


def test_a_scene_on_another_soil_is_another_start_but_held_out_with_it():
    pairs = [(scene, target) for scene in range(5) for target in range(2)]
    index = pd.concat([index_of(pairs), index_of(pairs, soil="gravel")], ignore_index=True)
    index = index.assign(episode_index=range(20))
    assert len(usable(index)) == 20
    parts = split(index, "scene", eval_fraction=0.2)
    held_out = index[index["episode_index"].isin(parts.evaluation)]
    assert sorted(held_out["soil"]) == ["gravel"] * 2 + ["sand"] * 2
    assert held_out["scene_id"].nunique() == 1
    index = index[index["episode_index"] != 1]  # scene 0 on sand lacks target 1
    assert len(select(index, "paired")) == 18
    assert len(select(index, "non-paired")) == 10
    coverage = pair_coverage(index)
    assert (coverage.scenes, coverage.starts, coverage.duplicates) == (5, 10, {})
    assert coverage.missing == {"excavator/train/0/0 on sand": [1]}


def at_stages(pairs, *stages):
    """Make an index in which every pair is shown at each of these stages."""
    uid = "excavator/train/{0.scene_id}/{0.stage}/{0.target_id}"
    index = pd.concat([index_of(pairs, stage=stage) for stage in stages], ignore_index=True)
    return index.assign(episode_index=range(len(index)), pair_uid=[uid.format(row) for row in index.itertuples()])


def test_a_scene_at_another_stage_is_another_start_but_held_out_with_it():
    index = at_stages([(scene, target) for scene in range(5) for target in range(4)], 0, 4)
    assert len(usable(index)) == len(select(index, "paired")) == 40
    assert len(select(index, "non-paired")) == 10
    parts = split(index, "scene", eval_fraction=0.2)
    held_out = index[index["episode_index"].isin(parts.evaluation)]
    assert sorted(held_out["stage"]) == [0] * 4 + [4] * 4
    assert held_out["scene_id"].nunique() == 1


def test_a_later_start_may_have_fewer_targets_but_none_in_between_may_be_missing():
    whole = [(0, target) for target in range(4)]
    index = pd.concat([at_stages(whole, 0, 4), at_stages([(1, 0), (1, 1)], 4), at_stages([(2, 0), (2, 2)], 4)])
    coverage = pair_coverage(index.assign(episode_index=range(len(index))))
    assert (coverage.scenes, coverage.starts, coverage.complete_starts) == (3, 4, 3)
    assert coverage.missing == {"excavator/train/2/4": [1]}
    assert pair_coverage(at_stages([(0, 0), (0, 1), (1, 0)], 0)).missing == {"excavator/train/1/0": [1]}
    assert select(index, "paired")["scene_id"].tolist() == [0] * 8


def test_where_no_setting_changes_the_start_scenes_are_paired_by_number_alone():
    index = index_of([(0, 0), (0, 1), (1, 0), (1, 1), (0, 1)], env="fr5_grasp").drop(columns="soil")
    assert len(select(usable(index), "paired")) == 4
    assert pair_coverage(index).duplicates == {"excavator/train/0/0/1": [1, 4]}
