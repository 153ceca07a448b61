"""What a frame of a dataset holds, and how an episode names its scene and target.

The keys that `lerobot-record` writes from a simulated robot are described exactly as it describes them, so that
recorded, scripted and rolled-out data merge. The `excav.*` columns are the truth about scene, target and outcome: they
are ordinary per-frame columns, the only carrier that survives delete, split, merge and push. The scene set is part of
`excav.pair_uid`.
"""

from typing import Any

from lerobot_excav.datasets.format.storage import require_lossless
from lerobot_excav.datasets.record.environment import EnvironmentDescription
from lerobot_excav.errors import DatasetError

STATE_KEY = "observation.state"
ACTION_KEY = "action"
MASK_KEY = "observation.images.target_mask"
SCENE_KEY = "excav.scene_id"
TARGET_KEY = "excav.target_id"
PAIR_KEY = "excav.pair_uid"
TASK_STATE_KEY = "excav.task_state"
SUCCESS_KEY = "excav.success"
SIMULATION_KEY = "excav.simulation_version"
Feature = dict[str, Any]


def camera_key(camera: str) -> str:
    """Return the dataset key of a camera."""
    return f"observation.images.{camera}"


def setting_key(name: str) -> str:
    """Return the dataset key of a setting that not every environment has."""
    return f"excav.{name}"


def unmarked_columns(environment: EnvironmentDescription) -> dict[str, int | str]:
    """Return what is taken to stand in columns that the first version of the simulation did not write."""
    if environment.unmarked_version is None:
        return {}
    settings = {setting_key(name): setting.unmarked for name, setting in environment.settings.items()}
    return {SIMULATION_KEY: environment.unmarked_version, **settings}


def excav_features(environment: EnvironmentDescription) -> dict[str, Feature]:
    """Describe the columns that LeRobot's recorder does not know."""
    names = list(environment.task_state_names)
    return {
        SCENE_KEY: {"dtype": "int64", "shape": (1,), "names": None},
        TARGET_KEY: {"dtype": "int64", "shape": (1,), "names": None},
        PAIR_KEY: {"dtype": "string", "shape": (1,), "names": None},
        TASK_STATE_KEY: {"dtype": "float32", "shape": (len(names),), "names": names},
        SUCCESS_KEY: {"dtype": "bool", "shape": (1,), "names": None},
        SIMULATION_KEY: {"dtype": "int64", "shape": (1,), "names": None},
        **{
            setting_key(name): {"dtype": "string", "shape": (1,), "names": None}
            for name in environment.settings
        },
    }


def dataset_features(
    environment: EnvironmentDescription, *, height: int, width: int, storage: str = "image"
) -> dict[str, Feature]:
    """Describe every column of a dataset in LeRobot's terms.

    Args:
        environment: Where it comes from.
        height: Image height [px].
        width: Image width [px].
        storage: `image` (PNG) or `video`; see `storage`.

    Returns:
        Feature descriptions by key.
    """
    action, state = list(environment.action_names), list(environment.state_names)
    features: dict[str, Feature] = {
        ACTION_KEY: {"dtype": "float32", "shape": (len(action),), "names": action},
        STATE_KEY: {"dtype": "float32", "shape": (len(state),), "names": state},
    }
    for camera in environment.cameras:
        features[camera_key(camera)] = {
            "dtype": storage,
            "shape": (height, width, 3),
            "names": ["height", "width", "channels"],
            # The recorder writes this for every camera; merging compares it.
            "info": {"is_depth_map": False},
        }
    return features | excav_features(environment)


def require_columns(environment: EnvironmentDescription, features: dict[str, Feature]) -> None:
    """Check that a dataset has the columns of this schema with the right types.

    `unmarked_columns` may be missing together: the excavator's datasets of the first version have no such columns.

    Args:
        environment: Where the dataset comes from.
        features: Feature descriptions of the dataset.

    Raises:
        DatasetError: A column is missing or is of another type, or pictures were compressed with losses.
    """
    expected = dataset_features(environment, height=0, width=0)
    optional = unmarked_columns(environment) if SIMULATION_KEY not in features else {}
    missing = [key for key in expected if key not in features and key not in optional]
    if missing:
        hint = "add the excav.* columns of a recording with `lerobot-excav index DATASET --session=FILE`"
        raise DatasetError(f"the dataset lacks {', '.join(missing)}; {hint}")
    for key in expected.keys() & features.keys():
        if expected[key]["dtype"] == "image" and features[key]["dtype"] == "video":
            require_lossless(key, features[key].get("info") or {})
            continue
        problem = _difference(features[key], expected[key])
        if problem:
            raise DatasetError(f"{key}: {problem}")


def _difference(found: Feature, expected: Feature) -> str:
    if found["dtype"] != expected["dtype"]:
        return f"dtype={found['dtype']!r} instead of {expected['dtype']!r}"
    if expected["dtype"] != "image" and tuple(found["shape"]) != expected["shape"]:
        return f"shape={tuple(found['shape'])} instead of {expected['shape']}"
    if expected["names"] is not None and list(found["names"] or []) != expected["names"]:
        return f"names={found['names']} instead of {expected['names']}"
    return ""
