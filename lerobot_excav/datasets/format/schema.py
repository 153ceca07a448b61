"""What a frame of a dataset holds, and how an episode names its scene and target.

The keys that `lerobot-record` writes from a simulated robot are described exactly as it describes them, so that
recorded, scripted and rolled-out data merge. The `excav.*` columns are the truth about start, target and outcome: they
are ordinary per-frame columns, the only carrier that survives delete, split, merge and push. The scene set is part of
`excav.pair_uid`. Target and mask are those in force in that frame: a command may change within an episode, and then
`excav.pair_uid` names the first.
"""

from collections.abc import Sequence
from typing import Any, NotRequired, TypedDict

from pydantic import ConfigDict, PositiveInt, with_config

from lerobot_excav.datasets.format.storage import require_lossless
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import DatasetError

STATE_KEY = "observation.state"
ACTION_KEY = "action"
MASK_KEY = "observation.images.target_mask"
SCENE_KEY = "excav.scene_id"
STAGE_KEY = "excav.stage"
"""How many cycles a seeded operator had dug before the start; 0 where a task has no stages."""
TARGET_KEY = "excav.target_id"
PAIR_KEY = "excav.pair_uid"
TASK_STATE_KEY = "excav.task_state"
OUTCOME_KEY = "excav.outcome"
"""Task state at the end of the episode: after its last action, and after the rest where that was left out."""
REST_KEY = "excav.rest_frames"
"""How many frames the machine was held still after the last one until the episode was over; they are left out."""
SUCCESS_KEY = "excav.success"
OPERATOR_KEY = "excav.operator"
INTERVENTION_KEY = "excav.intervention"
"""Whether a person took over from the policy in this frame."""
MASK_SOURCE_KEY = "excav.mask_source"
SIMULATION_KEY = "excav.simulation_version"
COMMAND_KEY = "excav.command_frame"
"""Frame from which on the present command holds: a command may change and yet name a target of the same number."""


OPERATORS = ("scripted", "person", "policy")
"""Who may have commanded an episode."""


@with_config(ConfigDict(extra="allow"))
class Feature(TypedDict):
    """How LeRobot describes a column; there may be more in it, which stays."""

    dtype: str
    shape: tuple[PositiveInt, ...]
    names: list[Any] | dict[str, Any] | None
    info: NotRequired[dict[str, Any] | None]


def camera_key(camera: str) -> str:
    """Return the dataset key of a camera."""
    return f"observation.images.{camera}"


def setting_key(name: str) -> str:
    """Return the dataset key of a setting that is kept in every frame, such as the soil."""
    return f"excav.{name}"


TASK_KEY = setting_key("task")
"""Which of the robot's tasks is played; all of them share the other columns."""


NUMBERING: dict[str, Feature] = {
    "timestamp": {"dtype": "float32", "shape": (1,), "names": None},
    **{
        key: {"dtype": "int64", "shape": (1,), "names": None}
        for key in ("frame_index", "episode_index", "index", "task_index")
    },
}
"""The columns that LeRobot adds to every dataset."""


def excav_features(spec: TaskSpec) -> dict[str, Feature]:
    """Describe the columns that LeRobot's recorder does not know."""
    words = (MASK_SOURCE_KEY, *map(setting_key, spec.settings.columns()))
    return {
        SCENE_KEY: _scalar("int64"),
        STAGE_KEY: _scalar("int64"),
        TARGET_KEY: _scalar("int64"),
        COMMAND_KEY: _scalar("int64"),
        PAIR_KEY: _scalar("string"),
        TASK_STATE_KEY: _vector(spec.task_state_names),
        OUTCOME_KEY: _vector(spec.task_state_names),
        REST_KEY: _scalar("int64"),
        SUCCESS_KEY: _scalar("bool"),
        OPERATOR_KEY: _scalar("string"),
        INTERVENTION_KEY: _scalar("bool"),
        SIMULATION_KEY: _scalar("int64"),
        **{key: _scalar("string") for key in words},
    }


def _scalar(dtype: str) -> Feature:
    return {"dtype": dtype, "shape": (1,), "names": None}


def _vector(names: Sequence[str]) -> Feature:
    return {"dtype": "float32", "shape": (len(names),), "names": list(names)}


def dataset_features(spec: TaskSpec, *, height: int, width: int, storage: str = "image") -> dict[str, Feature]:
    """Describe every column of a dataset in LeRobot's terms.

    Args:
        spec: Task of the robot that it was recorded with.
        height: Image height [px].
        width: Image width [px].
        storage: `image` (PNG) or `video`; see `storage`.
    """
    features = {ACTION_KEY: _vector(spec.action_names), STATE_KEY: _vector(spec.state_names)}
    for camera in spec.cameras:
        features[camera_key(camera)] = {
            "dtype": storage,
            "shape": (height, width, 3),
            "names": ["height", "width", "channels"],
            # The recorder writes this for every camera; merging compares it.
            "info": {"is_depth_map": False},
        }
    return features | excav_features(spec)


def require_columns(spec: TaskSpec, features: dict[str, Feature]) -> None:
    """Check that a dataset has the columns of this schema with the right types.

    Raises:
        DatasetError: A column is missing or is of another type, or pictures were compressed with losses.
    """
    expected = dataset_features(spec, height=0, width=0)
    missing = [key for key in expected if key not in features]
    if missing:
        hint = (
            "add the excav.* columns of a recording with `lerobot-excav index DATASET --session=FILE`; a dataset that "
            "an earlier release has written has to be recorded again"
        )
        raise DatasetError(f"the dataset lacks {', '.join(missing)}; {hint}")
    for key in expected.keys() & features.keys():
        if expected[key]["dtype"] == "image" and features[key]["dtype"] == "video":
            require_lossless(key, features[key].get("info") or {})
            continue
        problem = _difference(features[key], expected[key])
        if problem:
            raise DatasetError(f"{key}: {problem}")


def require_numbering(features: dict[str, Feature]) -> None:
    """Check that a dataset has the columns that LeRobot itself adds, with the right types.

    Raises:
        DatasetError: A column is missing or is of another type.
    """
    for key, expected in NUMBERING.items():
        problem = _difference(features[key], expected) if key in features else "the dataset lacks it"
        if problem:
            raise DatasetError(f"{key}: {problem}; LeRobot cannot read such a dataset")


def _difference(found: Feature, expected: Feature) -> str:
    if found["dtype"] != expected["dtype"]:
        return f"dtype={found['dtype']!r} instead of {expected['dtype']!r}"
    if (found.get("info") or {}).get("is_depth_map", False):
        return "is_depth_map=True, so LeRobot takes its pictures for distances"
    if expected["dtype"] != "image" and tuple(found["shape"]) != expected["shape"]:
        return f"shape={tuple(found['shape'])} instead of {expected['shape']}"
    if expected["names"] is not None and list(found["names"] or []) != expected["names"]:
        return f"names={found['names']} instead of {expected['names']}"
    return ""
