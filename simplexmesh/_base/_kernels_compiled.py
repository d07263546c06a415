"""Notification of kernel compilation, which takes up to a minute at the first use after installation."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache

from numba.core import event

FIRST_USE = "compiling for the first use, up to a minute, once per upgrade; `simplexmesh warm-up` does it beforehand"


class _Compiling(event.Listener):  # type: ignore[misc]
    """Report the begin and end of compilation; nested compilations of called kernels count as one."""

    def __init__(self, begun: Callable[[], None], ended: Callable[[], None]) -> None:
        self.begun, self.ended = begun, ended
        self.depth = 0

    def on_start(self, event: event.Event) -> None:
        self.depth += 1
        if self.depth == 1:
            self.begun()

    def on_end(self, event: event.Event) -> None:
        self.depth -= 1
        if self.depth == 0:
            self.ended()


@contextmanager
def compiling(begun: Callable[[], None], ended: Callable[[], None]) -> Iterator[None]:
    """Call `begun` when compilation starts, `ended` when it is complete; loading from the cache does not count."""
    _bars.append(begun)
    try:
        with event.install_listener("numba:compile", _Compiling(begun, ended)):
            yield
    finally:
        _bars.remove(begun)


_bars: list[Callable[[], None]] = []
_told: list[str] = []


@cache
def announce() -> None:
    """Have the first compilation of this process logged, unless a bar shows it."""
    event.register("numba:compile", _Compiling(_tell, lambda: None))


def _tell() -> None:
    if not _bars and not _told:
        _told.append(FIRST_USE)
        logging.getLogger("simplexmesh").warning(FIRST_USE)
