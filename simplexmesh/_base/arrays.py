"""Types of arrays, for signatures; shapes are told where they matter."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Indices32 = NDArray[np.int32]
Mask = NDArray[np.bool_]
