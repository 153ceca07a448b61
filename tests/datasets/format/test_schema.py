import pytest
from lerobot.datasets import aggregate_pipeline_dataset_features, create_initial_features
from lerobot.datasets.feature_utils import features_equal_for_merge
from lerobot.processor import make_default_processors
from lerobot.utils.feature_utils import combine_feature_dicts
from lerobot_excav.datasets.record.environments import ENVIRONMENTS, environment_of_robot
from lerobot_excav.datasets.record.excavator_environment import EXCAVATOR

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.format.schema import (
    dataset_features,
    excav_features,
    require_columns,
    unmarked_columns,
)
from lerobot_excav.errors import DatasetError

LOSSLESS = {"video.codec": "h264", "video.crf": 0, "video.pix_fmt": "yuv444p"}


@pytest.fixture(params=ENVIRONMENTS.values(), ids=ENVIRONMENTS)
def environment(request):
    return request.param


def recorder_features(environment, *, use_videos: bool) -> dict:
    """Describe what `lerobot-record` writes from a robot with these features, by its own functions."""
    teleop_processor, _, observation_processor = make_default_processors()
    cameras = dict.fromkeys(environment.cameras, (32, 48, 3))
    action = dict.fromkeys(environment.action_names, float)
    return combine_feature_dicts(
        aggregate_pipeline_dataset_features(
            pipeline=teleop_processor,
            initial_features=create_initial_features(action=action),
            use_videos=use_videos,
        ),
        aggregate_pipeline_dataset_features(
            pipeline=observation_processor,
            initial_features=create_initial_features(
                observation={**dict.fromkeys(environment.state_names, float), **cameras}
            ),
            use_videos=use_videos,
        ),
    )


def stored_as_video(environment, info: dict) -> dict:
    """Describe a dataset whose pictures are videos."""
    features = dataset_features(environment, height=32, width=48, storage="video")
    videos = {key for key, feature in features.items() if feature["dtype"] == "video"}
    return {
        key: {**feature, "info": {**feature["info"], **info}} if key in videos else feature
        for key, feature in features.items()
    }


def test_the_robot_type_is_that_of_the_simulated_robot(environment):
    from lerobot.robots import RobotConfig

    import lerobot_excav.plugin  # noqa: F401 - registers the robots

    assert environment.robot_type in RobotConfig.get_known_choices()
    assert environment_of_robot(environment.robot_type) is environment


def test_a_dataset_of_another_robot_is_refused():
    with pytest.raises(DatasetError, match=r"robot_type='so100'.*'excavator_sim', 'fr5_sim'"):
        environment_of_robot("so100")


@pytest.mark.parametrize("storage", ["image", "video"])
def test_recorded_features_plus_the_excav_columns_merge_with_scripted_ones(environment, storage):
    use_videos = storage == "video"
    recorded = recorder_features(environment, use_videos=use_videos) | excav_features(environment)
    scripted = dataset_features(environment, height=32, width=48, storage=storage)
    assert features_equal_for_merge(recorded, scripted)


def test_columns_of_the_schema_are_accepted(environment):
    require_columns(environment, dataset_features(environment, height=96, width=128))
    require_columns(environment, stored_as_video(environment, LOSSLESS))


def test_what_first_datasets_lack_may_be_missing_together_only():
    features = dataset_features(EXCAVATOR, height=96, width=128)
    unmarked = unmarked_columns(EXCAVATOR)
    require_columns(EXCAVATOR, {key: feature for key, feature in features.items() if key not in unmarked})
    del features["excav.soil"]
    with pytest.raises(DatasetError, match=r"lacks excav\.soil"):
        require_columns(EXCAVATOR, features)


def test_the_arm_has_no_unmarked_datasets():
    features = dataset_features(ENVIRONMENTS["fr5_grasp"], height=96, width=128)
    del features["excav.simulation_version"]
    with pytest.raises(DatasetError, match=r"lacks excav\.simulation_version"):
        require_columns(ENVIRONMENTS["fr5_grasp"], features)


def test_settings_of_other_environments_are_no_columns():
    assert not {"excav.soil", "excav.fidelity"} & excav_features(ENVIRONMENTS["fr5_grasp"]).keys()


def test_a_recording_without_excav_columns_is_refused_with_the_next_step(environment):
    with pytest.raises(DatasetError, match=r"lacks excav.scene_id.*index DATASET --session"):
        require_columns(environment, recorder_features(environment, use_videos=False))


@pytest.mark.parametrize(
    "changes", [{"video.crf": 30}, {"video.pix_fmt": "yuv420p"}, {"video.crf": None}, {"video.codec": "hevc"}]
)
def test_a_video_with_losses_is_refused_with_the_next_step(environment, changes):
    with pytest.raises(DatasetError, match=r"dtype='video'.*blurs the mask.*--dataset.video=false"):
        require_columns(environment, stored_as_video(environment, {**LOSSLESS, **changes}))


def test_columns_of_another_environment_are_refused():
    features = dataset_features(ENVIRONMENTS["fr5_grasp"], height=32, width=48)
    with pytest.raises(DatasetError, match=r"lacks observation\.images\.cab"):
        require_columns(EXCAVATOR, features)


def test_pair_uid_reads_back():
    pair = Pair("excavator", "test", 12, 3)
    assert pair.uid == "excavator/test/12/3"
    assert Pair.parse(pair.uid) == pair


@pytest.mark.parametrize("uid", ["", "excavator/test/12", "excavator/test/x/1", "a/b/1/2/3"])
def test_a_malformed_pair_uid_is_named(uid):
    with pytest.raises(DatasetError, match="is not of the form"):
        Pair.parse(uid)
