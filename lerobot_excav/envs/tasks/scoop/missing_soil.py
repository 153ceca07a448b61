"""Which soil is missing after a dig."""

import numpy as np
from numpy.typing import NDArray


def missing_soil(
    before_m: NDArray[np.float64], after_m: NDArray[np.float64], x_w: NDArray[np.float64], y_w: NDArray[np.float64]
) -> tuple[tuple[float, float] | None, float | None]:
    """Return the centroid of the soil that is missing in a height field (nx, ny) [m], and the greatest loss of height.

    Both are None if none is missing. Soil that slides down is missing where it was.
    """
    missing_m = np.maximum(before_m - after_m, 0.0)
    total = float(missing_m.sum())
    if total <= 1e-6:
        return None, None
    centroid = float(missing_m.sum(axis=1) @ x_w / total), float(missing_m.sum(axis=0) @ y_w / total)
    return centroid, float(missing_m.max())
