"""Experiments that hold the simulation to published ones; not part of the wheel."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
