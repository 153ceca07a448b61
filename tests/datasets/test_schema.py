import pytest
from lerobot.datasets import aggregate_pipeline_dataset_features, create_initial_features
from lerobot.datasets.feature_utils import features_equal_for_merge
from lerobot.processor import make_default_processors
from lerobot.utils.feature_utils import combine_feature_dicts

from lerobot_excav.datasets.pair import Pair
from lerobot_excav.datasets.schema import (
    ROBOT_TYPE,
    UNMARKED,
    dataset_features,
    excav_features,
    require_columns,
)
from lerobot_excav.envs.features import ACTION_NAMES, CAMERAS, STATE_NAMES
from lerobot_excav.errors import DatasetError


def recorder_features(*, use_videos: bool) -> dict:
    """Describe what `lerobot-record` writes from a robot with these features, by its own functions."""
    teleop_processor, _, observation_processor = make_default_processors()
    observation = {**dict.fromkeys(STATE_NAMES, float), **dict.fromkeys(CAMERAS, (32, 48, 3))}
    return combine_feature_dicts(
        aggregate_pipeline_dataset_features(
            pipeline=teleop_processor,
            initial_features=create_initial_features(action=dict.fromkeys(ACTION_NAMES, float)),
            use_videos=use_videos,
        ),
        aggregate_pipeline_dataset_features(
            pipeline=observation_processor,
            initial_features=create_initial_features(observation=observation),
            use_videos=use_videos,
        ),
    )


def test_the_robot_type_is_that_of_the_simulated_robot():
    from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim

    assert ExcavatorSim.name == ROBOT_TYPE


def test_recorded_features_plus_the_excav_columns_merge_with_scripted_ones():
    recorded = recorder_features(use_videos=False) | excav_features()
    assert features_equal_for_merge(recorded, dataset_features(height=32, width=48))


def test_columns_of_the_schema_are_accepted():
    require_columns(dataset_features(height=96, width=128))


def test_what_first_datasets_lack_may_be_missing_together_only():
    features = dataset_features(height=96, width=128)
    require_columns({key: feature for key, feature in features.items() if key not in UNMARKED})
    del features["excav.soil"]
    with pytest.raises(DatasetError, match=r"lacks excav\.soil"):
        require_columns(features)


def test_a_recording_without_excav_columns_is_refused_with_the_next_step():
    with pytest.raises(DatasetError, match=r"lacks excav.scene_id.*index DATASET --session"):
        require_columns(recorder_features(use_videos=False))


def test_a_video_mask_is_refused_with_the_next_step():
    with pytest.raises(DatasetError, match=r"dtype='video'.*--dataset.video=false"):
        require_columns(recorder_features(use_videos=True) | excav_features())


def test_pair_uid_reads_back():
    pair = Pair("excavator", "test", 12, 3)
    assert pair.uid == "excavator/test/12/3"
    assert Pair.parse(pair.uid) == pair


@pytest.mark.parametrize("uid", ["", "excavator/test/12", "excavator/test/x/1", "a/b/1/2/3"])
def test_a_malformed_pair_uid_is_named(uid):
    with pytest.raises(DatasetError, match="is not of the form"):
        Pair.parse(uid)
