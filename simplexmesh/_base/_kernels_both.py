"""Kernels compiled twice, serial and multithreaded, with the variant chosen by the size of the input."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from simplexmesh._base._kernels_njit import njit

FAST = {"nsz", "arcp", "contract", "reassoc"}  # never 'nnan': NaN means "no data here" and must stay visible
PARALLEL_FROM = 6000
"""Rows, a tenth of a millisecond of work: starting threads costs 5 microseconds, on a busy machine milliseconds."""


class Both:
    """A kernel in a serial and a parallel variant; the parallel one runs from `pays_from` rows on."""

    def __init__(self, function: Callable[..., Any], pays_from: int = PARALLEL_FROM) -> None:
        self.pays_from = pays_from
        copy = FunctionType(function.__code__, function.__globals__, function.__name__)
        copy.__qualname__ = f"{function.__qualname__}_parallel"  # the disk cache tells kernels apart by name only
        self.serial = njit(cache=True, error_model="numpy", fastmath=FAST)(function)
        self.parallel = njit(cache=True, error_model="numpy", fastmath=FAST, parallel=True)(copy)
        self.__doc__ = function.__doc__

    def __call__(self, vertices: np.ndarray, *arguments: Any) -> None:
        """Run the kernel; the length of its first argument decides which variant."""
        (self.parallel if len(vertices) >= self.pays_from else self.serial)(vertices, *arguments)
