import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lerobot.configs.default import DatasetConfig
from lerobot.configs.train import TrainPipelineConfig
from lerobot.datasets import make_train_eval_datasets
from lerobot.policies.act.configuration_act import ACTConfig

from lerobot_excav.datasets.pairs.paired_index import build_index
from lerobot_excav.datasets.pairs.split import Split, split
from lerobot_excav.errors import ConfigurationError, DatasetError

from .test_selection import index_of, pair_sets


@given(
    pairs=pair_sets, fraction=st.floats(0.0, 0.9), seed=st.integers(0, 5), unit=st.sampled_from(["scene", "episode"])
)
def test_parts_are_disjoint_complete_and_share_no_scene_when_split_by_scene(pairs, fraction, seed, unit):
    index = index_of(pairs)
    try:
        parts = split(index, unit, eval_fraction=fraction, seed=seed)
    except DatasetError:
        assert index["scene_id"].nunique() < 2 or len(index) < 2 or fraction > 0.4
        return
    assert sorted(parts.train + parts.evaluation) == index["episode_index"].tolist()
    assert parts.train
    assert bool(parts.evaluation) == (fraction > 0.0)
    if unit == "scene":
        scene = index.set_index("episode_index")["scene_id"]
        assert not set(scene[parts.train]) & set(scene[parts.evaluation])


@given(train=st.integers(1, 3000), held_out=st.integers(1, 3000))
def test_lerobots_rounding_holds_out_exactly_the_evaluation_episodes(train, held_out):
    parts = Split(train=list(range(train)), evaluation=list(range(train, train + held_out)))
    ratio = float(parts.flags()[1].split("=")[1])
    assert math.ceil((train + held_out) * ratio) == held_out
    assert 0.0 < ratio < 1.0


def lerobot_split(root: Path, flags: list[str]) -> tuple[list[int], list[int]]:
    """Split a dataset by LeRobot's own function, from the flags as they are printed."""
    values = dict(flag.removeprefix("--dataset.").split("=", 1) for flag in flags)
    dataset = DatasetConfig(
        repo_id="local/toy",
        root=str(root),
        episodes=[int(number) for number in values["episodes"].strip("[]").split(",")],
        eval_split=float(values["eval_split"]),
        video_backend="pyav",
    )
    train, evaluation = make_train_eval_datasets(TrainPipelineConfig(dataset=dataset, policy=ACTConfig(device="cpu")))
    return train.episodes, evaluation.episodes


@pytest.mark.slow
@pytest.mark.parametrize("unit", ["scene", "episode"])
@pytest.mark.parametrize("fraction", [0.2, 0.37])
def test_stock_lerobot_train_splits_as_the_flags_say(paired_dataset, unit, fraction):
    parts = split(build_index(paired_dataset), unit, eval_fraction=fraction, seed=3)
    assert lerobot_split(paired_dataset, parts.flags()) == (parts.train, parts.evaluation)


@pytest.mark.parametrize("fraction", [-0.1, 1.0])
def test_a_fraction_out_of_range_is_named(fraction):
    with pytest.raises(ConfigurationError, match="--eval_fraction="):
        split(index_of([(0, 0), (1, 0)]), "scene", eval_fraction=fraction)


def test_units_and_seeds_hold_out_other_episodes():
    index = index_of([(s, t) for s in range(12) for t in range(4)])
    by_scene, by_episode, other_seed = (
        split(index, unit, eval_fraction=0.25, seed=seed).evaluation
        for unit, seed in (("scene", 0), ("episode", 0), ("scene", 1))
    )
    assert len(by_scene) == len(by_episode) == 12
    assert len({number // 4 for number in by_scene}) == 3 < len({number // 4 for number in by_episode})
    assert by_scene != other_seed
