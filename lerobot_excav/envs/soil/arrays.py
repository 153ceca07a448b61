"""Types of the arrays that the soil is made of."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.uint8]
Bools = NDArray[np.bool_]
Indices = NDArray[np.int64]
