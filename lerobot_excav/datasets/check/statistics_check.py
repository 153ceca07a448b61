"""Whether the statistics of a dataset are there and fit its data: training normalises by them."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.datasets.format.dataset_info import PICTURE_DTYPES, DatasetInfo
from lerobot_excav.datasets.format.metadata import STATISTICS_PATH, Statistics
from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.datasets.format.schema import ACTION_KEY, STATE_KEY
from lerobot_excav.errors import DatasetError

VECTOR_KEYS = (STATE_KEY, ACTION_KEY)
"""Columns other than pictures that training normalises."""
NEEDED = ("min", "max", "mean", "std", "count")
TOLERANCE = 1e-3
"""Allowed deviation from the data, as share of the range of an element (guess)."""
LEAST_TOLERANCE = 1e-4
"""The same for an element that hardly changes, in its own unit (guess)."""
STD_ROUNDING = 5e-3
"""What a std may be off besides, as share of the mean: LeRobot subtracts squares in float32 (kind: measured)."""
NEXT_STEP = "make them again with `lerobot-edit-dataset --operation.type=recompute_stats`"


class SeenValues:
    """Sums over the vectors of the episodes that were read, by column."""

    def __init__(self) -> None:
        self._sums: dict[str, list[NDArray[np.float64]]] = {}

    def add(self, key: str, values: NDArray[Any]) -> None:
        """Count the values of an episode, (n, k)."""
        wide = values.astype(np.float64)
        count = np.full(wide.shape[1], float(len(wide)))
        self._sums.setdefault(key, []).append(
            np.stack([wide.min(axis=0), wide.max(axis=0), wide.sum(axis=0), np.square(wide).sum(axis=0), count])
        )

    def statistics(self, key: str) -> dict[str, NDArray[np.float64]]:
        """Return minimum, maximum, mean and standard deviation, each (k,)."""
        parts = np.stack(self._sums[key], axis=1)
        mean = parts[2].sum(axis=0) / parts[4].sum(axis=0)
        variance = parts[3].sum(axis=0) / parts[4].sum(axis=0) - np.square(mean)
        deviation = np.sqrt(np.maximum(variance, 0.0))
        return {"min": parts[0].min(axis=0), "max": parts[1].max(axis=0), "mean": mean, "std": deviation}


def statistics_problems(statistics: Statistics, info: DatasetInfo, seen: SeenValues | None) -> Iterator[str]:
    """Describe in plain words what is wrong with statistics.

    Args:
        statistics: The statistics by column.
        info: What the dataset says about itself.
        seen: What its frames hold; None if not all were read.
    """
    pictures = [key for dtype in PICTURE_DTYPES for key in info.keys_of(dtype)]
    for key in (*VECTOR_KEYS, *pictures):
        shape = (3, 1, 1) if key in pictures else tuple(info.features[key]["shape"])
        try:
            found = _arrays(statistics.get(key), shape)
            _require_possible(found)
            if seen is not None and key in VECTOR_KEYS:
                _require_like(found, seen.statistics(key))
        except DatasetError as problem:
            yield f"{STATISTICS_PATH}: {key} {problem}; {NEXT_STEP}"


def _arrays(found: dict[str, Any] | None, shape: tuple[int, ...]) -> dict[str, NDArray[np.float64]]:
    """Return the statistics of a column as arrays of its shape."""
    missing = [name for name in NEEDED if name not in (found or {})]
    if found is None or missing:
        raise DatasetError(f"lacks {', '.join(missing)}")
    arrays = {}
    for name, value in found.items():
        with reading(f"has {name}={value!r:.40}, which"):
            arrays[name] = np.asarray(value, dtype=np.float64)
        if arrays[name].shape != ((1,) if name == "count" else shape):
            raise DatasetError(f"has {name} of shape {arrays[name].shape} instead of {shape}")
        if not np.isfinite(arrays[name]).all():
            raise DatasetError(f"has a {name} that is not finite")
    return arrays


def _require_possible(found: dict[str, NDArray[np.float64]]) -> None:
    slack = TOLERANCE * (found["max"] - found["min"]) + LEAST_TOLERANCE
    if (found["min"] > found["max"]).any():
        raise DatasetError("has a min above its max")
    if (found["mean"] < found["min"] - slack).any() or (found["mean"] > found["max"] + slack).any():
        raise DatasetError("has a mean outside of min and max")
    if (found["std"] < 0.0).any() or (found["count"] < 1.0).any():
        raise DatasetError("has a std below 0 or a count below 1")


def _require_like(found: dict[str, NDArray[np.float64]], seen: dict[str, NDArray[np.float64]]) -> None:
    tolerance = TOLERANCE * (seen["max"] - seen["min"]) + LEAST_TOLERANCE
    for name, values in seen.items():
        slack = STD_ROUNDING * np.abs(seen["mean"]) if name == "std" else 0.0
        wrong = np.abs(found[name] - values) > tolerance + slack
        if wrong.any():
            element = int(np.argmax(wrong))
            raise DatasetError(
                f"has {name}={found[name][element]:.4g} of element {element}, its frames have {values[element]:.4g}"
            )
