"""Kernels over rows, whose rows threads of Python share: numba's own end the process after a fork or beside another.

With `parallel=True` numba would also compile each kernel for another time as long, and lose writes to arrays of tuples.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from queue import Empty, SimpleQueue
from typing import Any

import numba

from simplexmesh._base._kernels_njit import njit

SHARED_FROM = 6000
"""Rows, a tenth of a millisecond of work, from which threads share light kernels: waking one takes a tenth of that."""

PARTS = 4
"""Parts for each thread, so that none waits for long where rows take different times."""

GLANCE = 0.05
"""Seconds after which a thread looks whether the others have ended, should a Ctrl-C have kept it from being told."""


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
        ends = [part * count // n_parts for part in range(n_parts + 1)]
        call = Call(self.kernel, [(*rows, *arguments) for rows in pairwise(ends)])
        try:
            for _ in range(min(threads, n_parts) - 1):
                _helpers.put(call.help, threads - 1)
            call.run()
        finally:
            call.finish()
        for error in filter(None, call.ended):
            raise error


def by_rows(shared_from: int = SHARED_FROM, **options: Any) -> Callable[[Callable[..., Any]], RowKernel]:
    """Return the decorator of kernels over rows that threads share from so many rows on; the options are numba's."""
    return lambda function: RowKernel(function, shared_from, **options)


class Call:
    """One call of a kernel, of whose parts each thread takes the next one."""

    def __init__(self, kernel: Callable[..., None], parts: list[tuple[Any, ...]]) -> None:
        self.kernel, self.parts = kernel, iter(parts)
        self.begun: list[None] = []
        self.ended: list[BaseException | None] = []
        self._told: SimpleQueue[None] = SimpleQueue()

    def run(self) -> None:
        """Run parts until none is left."""
        for part in self.parts:
            self.kernel(*part)

    def help(self) -> None:
        """Run parts in another thread, which keeps what they raise."""
        self.begun.append(None)
        error = None
        try:
            self.run()
        except BaseException as raised:
            error = raised
        self.ended.append(error)
        self._told.put(None)

    def finish(self) -> None:
        """Leave what parts there are, and return when no thread writes any more; a Ctrl-C meanwhile is raised then."""
        try:
            for _ in self.parts:
                pass
            while len(self.ended) < len(self.begun):
                with suppress(Empty):
                    self._told.get(timeout=GLANCE)
        except KeyboardInterrupt:
            self.finish()
            raise


class Helpers:
    """Threads that wait for tasks, started when needed; executors of the standard library take no more at exit."""

    def __init__(self) -> None:
        self.count = 0
        self._starting, self._tasks = threading.Lock(), SimpleQueue[Callable[[], None]]()

    def put(self, task: Callable[[], None], wanted: int) -> None:
        """Have a task run by one of the threads, so many of which are wanted; without any it is not needed either."""
        with self._starting:
            while self.count < wanted:
                self.count += 1
                try:
                    threading.Thread(target=self._serve, name="simplexmesh", daemon=True).start()
                except RuntimeError:  # the system has no more
                    self.count -= 1
                    break
        if self.count:
            self._tasks.put(task)

    def _serve(self) -> None:
        while True:
            self._tasks.get()()


_helpers = Helpers()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_helpers.__init__)  # type: ignore[misc]  # threads do not survive a fork
