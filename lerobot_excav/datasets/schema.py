"""What a frame of an excavator dataset holds, and how an episode names its scene and target.

The keys that `lerobot-record` writes from the simulated robot are described exactly as it describes them, so that
recorded, scripted and rolled-out data merge. The `excav.*` columns are the truth about scene, target and outcome: they
are ordinary per-frame columns, the only carrier that survives delete, split, merge and push. The scene set is part of
`excav.pair_uid`.
"""

from typing import Any

from lerobot_excav.envs.excavator.task_state import TASK_STATE_NAMES
from lerobot_excav.envs.features import ACTION_NAMES, CAMERAS, STATE_NAMES
from lerobot_excav.envs.simulation_version import UNMARKED_VERSION
from lerobot_excav.errors import DatasetError

ROBOT_TYPE = "excavator_sim"

STATE_KEY = "observation.state"
ACTION_KEY = "action"
MASK_KEY = "observation.images.target_mask"
SCENE_KEY = "excav.scene_id"
TARGET_KEY = "excav.target_id"
PAIR_KEY = "excav.pair_uid"
TASK_STATE_KEY = "excav.task_state"
SUCCESS_KEY = "excav.success"
SIMULATION_KEY = "excav.simulation_version"
SOIL_KEY = "excav.soil"
FIDELITY_KEY = "excav.fidelity"

UNMARKED: dict[str, int | str] = {
    SIMULATION_KEY: UNMARKED_VERSION,
    SOIL_KEY: "unknown",
    FIDELITY_KEY: "standard",
}
"""Columns that the first version of the simulation did not write, and what its datasets are taken to hold there."""

Feature = dict[str, Any]


def camera_key(camera: str) -> str:
    """Return the dataset key of a camera."""
    return f"observation.images.{camera}"


def excav_features() -> dict[str, Feature]:
    """Describe the columns that LeRobot's recorder does not know."""
    return {
        SCENE_KEY: {"dtype": "int64", "shape": (1,), "names": None},
        TARGET_KEY: {"dtype": "int64", "shape": (1,), "names": None},
        PAIR_KEY: {"dtype": "string", "shape": (1,), "names": None},
        TASK_STATE_KEY: {
            "dtype": "float32",
            "shape": (len(TASK_STATE_NAMES),),
            "names": list(TASK_STATE_NAMES),
        },
        SUCCESS_KEY: {"dtype": "bool", "shape": (1,), "names": None},
        SIMULATION_KEY: {"dtype": "int64", "shape": (1,), "names": None},
        SOIL_KEY: {"dtype": "string", "shape": (1,), "names": None},
        FIDELITY_KEY: {"dtype": "string", "shape": (1,), "names": None},
    }


def dataset_features(*, height: int, width: int) -> dict[str, Feature]:
    """Describe every column of an excavator dataset in LeRobot's terms.

    Args:
        height: Image height [px].
        width: Image width [px].

    Returns:
        Feature descriptions by key. Images are `image` (PNG, lossless), never `video`, whose codec would blur the mask.
    """
    features: dict[str, Feature] = {
        ACTION_KEY: {"dtype": "float32", "shape": (len(ACTION_NAMES),), "names": list(ACTION_NAMES)},
        STATE_KEY: {"dtype": "float32", "shape": (len(STATE_NAMES),), "names": list(STATE_NAMES)},
    }
    for camera in CAMERAS:
        features[camera_key(camera)] = {
            "dtype": "image",
            "shape": (height, width, 3),
            "names": ["height", "width", "channels"],
            # The recorder writes this for every camera; merging compares it.
            "info": {"is_depth_map": False},
        }
    return features | excav_features()


def require_columns(features: dict[str, Feature]) -> None:
    """Check that a dataset has the columns of this schema with the right types.

    `UNMARKED` may be missing together: datasets of the first version have no such columns.

    Args:
        features: Feature descriptions of the dataset.

    Raises:
        DatasetError: A column is missing or is of another type.
    """
    expected = dataset_features(height=0, width=0)
    optional = UNMARKED if SIMULATION_KEY not in features else {}
    missing = [key for key in expected if key not in features and key not in optional]
    if missing:
        hint = "add the excav.* columns of a recording with `lerobot-excav index DATASET --session=FILE`"
        raise DatasetError(f"the dataset lacks {', '.join(missing)}; {hint}")
    for key in expected.keys() & features.keys():
        problem = _difference(features[key], expected[key])
        if problem:
            raise DatasetError(f"{key}: {problem}")


def _difference(found: Feature, expected: Feature) -> str:
    if found["dtype"] != expected["dtype"]:
        hint = " (record with --dataset.video=false)" if found["dtype"] == "video" else ""
        return f"dtype={found['dtype']!r} instead of {expected['dtype']!r}{hint}"
    if expected["dtype"] != "image" and tuple(found["shape"]) != expected["shape"]:
        return f"shape={tuple(found['shape'])} instead of {expected['shape']}"
    if expected["names"] is not None and list(found["names"] or []) != expected["names"]:
        return f"names={found['names']} instead of {expected['names']}"
    return ""
