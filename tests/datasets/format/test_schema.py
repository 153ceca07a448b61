import pytest
from lerobot.datasets import aggregate_pipeline_dataset_features, create_initial_features
from lerobot.datasets.feature_utils import features_equal_for_merge
from lerobot.processor import make_default_processors
from lerobot.robots import RobotConfig
from lerobot.utils.feature_utils import combine_feature_dicts, dataset_to_policy_features

import lerobot_excav.plugin  # noqa: F401 - registers the robots
from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.format.schema import dataset_features, excav_features, require_columns
from lerobot_excav.envs.tasks.grasp.spec import GRASP
from lerobot_excav.envs.tasks.registry import task_of_robot
from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from lerobot_excav.errors import DatasetError

LOSSLESS = {"video.codec": "h264", "video.crf": 0, "video.pix_fmt": "yuv444p"}


@pytest.fixture(params=[SCOOP, GRASP], ids=lambda spec: spec.id)
def spec(request):
    return request.param


def recorder_features(spec, *, use_videos):
    """Describe what `lerobot-record` writes from a robot with these features, by its own functions."""
    teleop_processor, _, observation_processor = make_default_processors()
    observation = {**dict.fromkeys(spec.state_names, float), **dict.fromkeys(spec.cameras, (32, 48, 3))}
    parts = (
        (teleop_processor, {"action": dict.fromkeys(spec.action_names, float)}),
        (observation_processor, {"observation": observation}),
    )
    return combine_feature_dicts(
        *(
            aggregate_pipeline_dataset_features(
                pipeline=pipeline, initial_features=create_initial_features(**features), use_videos=use_videos
            )
            for pipeline, features in parts
        )
    )


def stored_as_video(spec, info):
    """Describe a dataset whose pictures are videos."""
    features = dataset_features(spec, height=32, width=48, storage="video")
    return {
        key: {**feature, "info": {**feature["info"], **info}} if feature["dtype"] == "video" else feature
        for key, feature in features.items()
    }


def test_the_robot_type_is_that_of_the_simulated_robot(spec):
    assert spec.robot_type in RobotConfig.get_known_choices()
    assert task_of_robot(spec.robot_type) is spec


def test_a_dataset_of_another_robot_is_refused():
    with pytest.raises(DatasetError, match=r"robot_type='so100'.*'excavator_sim', 'fr5_sim'"):
        task_of_robot("so100")


@pytest.mark.parametrize("storage", ["image", "video"])
def test_recorded_features_plus_the_excav_columns_merge_with_scripted_ones(spec, storage):
    recorded = recorder_features(spec, use_videos=storage == "video") | excav_features(spec)
    assert features_equal_for_merge(recorded, dataset_features(spec, height=32, width=48, storage=storage))


def test_columns_of_the_schema_are_accepted(spec):
    require_columns(spec, dataset_features(spec, height=96, width=128))
    require_columns(spec, stored_as_video(spec, LOSSLESS))


@pytest.mark.parametrize(
    ("key", "changes", "message"),
    [
        ("excav.mask_source", None, r"lacks excav\.mask_source"),
        ("excav.stage", None, r"lacks excav\.stage.*earlier release has written has to be recorded again"),
        ("excav.operator", None, r"lacks excav\.operator"),
        ("excav.target_id", {"dtype": "float32"}, "dtype='float32' instead of 'int64'"),
        ("action", {"shape": (9,)}, r"shape=\(9,\) instead of"),
        ("excav.task_state", {"names": ["x"]}, "names=.* instead of"),
    ],
)
def test_a_column_that_is_missing_or_of_another_kind_is_named(spec, key, changes, message):
    features = dataset_features(spec, height=96, width=128)
    changed = {} if changes is None else {key: {**features.pop(key), **changes}}
    features.pop(key, None)
    with pytest.raises(DatasetError, match=message):
        require_columns(spec, features | changed)


def test_policies_see_none_of_the_excav_columns(spec):
    features = dataset_features(spec, height=32, width=48)
    shown = dataset_to_policy_features(features)
    assert shown.keys() == features.keys() - excav_features(spec).keys()


def test_a_setting_is_a_column_where_its_task_has_it_alone():
    settings = {"excav.soil", "excav.density", "excav.pile", "excav.fidelity"}
    assert settings <= excav_features(SCOOP).keys()
    assert not settings & excav_features(GRASP).keys()


def test_a_recording_without_excav_columns_is_refused_with_the_next_step(spec):
    with pytest.raises(DatasetError, match=r"lacks excav.scene_id.*index DATASET --session"):
        require_columns(spec, recorder_features(spec, use_videos=False))


@pytest.mark.parametrize(
    "changes", [{"video.crf": 30}, {"video.pix_fmt": "yuv420p"}, {"video.crf": None}, {"video.codec": "hevc"}]
)
def test_a_video_with_losses_is_refused_with_the_next_step(spec, changes):
    with pytest.raises(DatasetError, match=r"dtype='video'.*blurs the mask.*--dataset.video=false"):
        require_columns(spec, stored_as_video(spec, {**LOSSLESS, **changes}))


def test_columns_of_another_task_are_refused():
    with pytest.raises(DatasetError, match=r"lacks observation\.images\.cab"):
        require_columns(SCOOP, dataset_features(GRASP, height=32, width=48))


def test_pair_uid_reads_back():
    pair = Pair("excavator", "test", 12, 4, 3)
    assert pair.uid == "excavator/test/12/4/3"
    assert Pair.parse(pair.uid) == pair
    assert pair.reset_options == {"scene_id": 12, "stage": 4, "target_id": 3}


@pytest.mark.parametrize("uid", ["", "excavator/test/12", "excavator/test/12/3", "excavator/test/0/x/1", "a/b/1/2/3/4"])
def test_a_malformed_pair_uid_is_named(uid):
    with pytest.raises(DatasetError, match="is not of the form"):
        Pair.parse(uid)
