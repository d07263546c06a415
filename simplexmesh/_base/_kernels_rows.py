"""Kernels over rows, whose rows threads of Python share: numba's own end the process after a fork or beside another.

With `parallel=True` numba would also compile each kernel for another time as long, and lose writes to arrays of tuples.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from queue import SimpleQueue
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
        ended: SimpleQueue[BaseException | None] = SimpleQueue()

        def run_parts() -> None:
            with suppress(IndexError):  # no part is left
                while True:
                    ended.put(self._error(parts.pop(), arguments))

        for _ in range(min(threads, n_parts) - 1):
            _tasks().put(run_parts)
        run_parts()
        for error in [ended.get() for _ in range(n_parts)]:
            if error is not None:
                raise error

    def _error(self, part: tuple[int, int], arguments: tuple[Any, ...]) -> BaseException | None:
        """Run the kernel on part of the rows; return what it raised, as a Ctrl-C: the other parts shall end before."""
        try:
            self.kernel(*part, *arguments)
        except BaseException as error:
            return error
        return None


def by_rows(shared_from: int = SHARED_FROM, **options: Any) -> Callable[[Callable[..., Any]], RowKernel]:
    """Return the decorator of kernels over rows that threads share from so many rows on; the options are numba's."""
    return lambda function: RowKernel(function, shared_from, **options)


@cache
def _tasks() -> SimpleQueue[Callable[[], None]]:
    """Return the queue that the threads serve; an executor of the standard library takes nothing more at exit."""
    tasks: SimpleQueue[Callable[[], None]] = SimpleQueue()

    def serve() -> None:
        while True:
            tasks.get()()

    for _ in range(numba.config.NUMBA_NUM_THREADS - 1):
        threading.Thread(target=serve, name="simplexmesh", daemon=True).start()
    return tasks


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_tasks.cache_clear)  # threads do not survive a fork
