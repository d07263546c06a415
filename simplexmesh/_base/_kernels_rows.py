"""Kernels over rows, whose rows threads of Python share: numba's own end the process after a fork or beside another.

With `parallel=True` numba would also compile each kernel for another time as long, and lose writes to arrays of tuples.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache
from typing import Any

import numba

from simplexmesh._base._kernels_njit import njit

SHARED_FROM = 6000
"""Rows, a tenth of a millisecond of work, from which threads share light kernels: waking one takes a tenth of that."""

PARTS = 4
"""Parts for each thread, so that none waits for long where rows take different times."""


class RowKernel:
    """A kernel of the rows `begin` to `end`, its first two parameters, that is called with the number of all rows."""

    def __init__(self, function: Callable[..., Any], shared_from: int, **options: Any) -> None:
        self.kernel = njit(cache=True, error_model="numpy", nogil=True, **options)(function)
        self.shared_from = shared_from
        self.__doc__ = function.__doc__

    def __call__(self, count: int, *arguments: Any) -> None:
        """Run the kernel on all rows: in parts on several threads where there are enough."""
        threads = numba.config.NUMBA_NUM_THREADS
        n_parts = min(PARTS * threads, 2 * count // self.shared_from) if threads > 1 else 1
        if n_parts < 2:
            self.kernel(0, count, *arguments)
            return
        parts = [(part * count // n_parts, (part + 1) * count // n_parts) for part in range(n_parts)]

        def run_parts() -> None:
            while parts:
                try:
                    begin, end = parts.pop()
                except IndexError:  # another thread took it
                    return
                self.kernel(begin, end, *arguments)

        others = [_threads().submit(run_parts) for _ in range(min(threads, n_parts) - 1)]
        try:
            run_parts()
        finally:  # also after a Ctrl-C: nothing writes to the caller's arrays any more
            parts.clear()
            wait(others)
        for other in others:
            other.result()


def by_rows(shared_from: int = SHARED_FROM, **options: Any) -> Callable[[Callable[..., Any]], RowKernel]:
    """Return the decorator of kernels over rows that threads share from so many rows on; the options are numba's."""
    return lambda function: RowKernel(function, shared_from, **options)


@cache
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(numba.config.NUMBA_NUM_THREADS - 1, "simplexmesh")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_threads.cache_clear)  # threads do not survive a fork
