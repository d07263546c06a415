"""Kernels for one thread and for all of them.

A parallel call costs some 5 microseconds on an idle machine, and as many milliseconds (the scheduler's time slices)
where another process holds a core and the threads that wait for each other spin; so the rooms that use this ask them to
sleep instead (`_cache`), and they start only where a call has a tenth of a millisecond to share.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from simplexmesh._kernels_njit import njit

FAST = {"nsz", "arcp", "contract", "reassoc"}  # never 'nnan': NaN means "no data here" and must stay visible
PARALLEL_FROM = 6000


class Both:
    """A kernel compiled twice, for one thread and for all; called through the one that pays at this size."""

    def __init__(self, function: Callable[..., Any], pays_from: int = PARALLEL_FROM) -> None:
        self.pays_from = pays_from
        twin = FunctionType(function.__code__, function.__globals__, function.__name__)
        twin.__qualname__ = f"{function.__qualname__}_parallel"  # the disk cache knows kernels by name, not by flags
        self.serial = njit(cache=True, error_model="numpy", fastmath=FAST)(function)
        self.parallel = njit(cache=True, error_model="numpy", fastmath=FAST, parallel=True)(twin)
        self.__doc__ = function.__doc__

    def __call__(self, vertices: np.ndarray, *arguments: Any) -> None:
        """Run on `vertices` and whatever else the kernel takes."""
        (self.parallel if len(vertices) >= self.pays_from else self.serial)(vertices, *arguments)
