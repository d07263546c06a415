"""Notification of kernel compilation, which takes up to a minute at the first use after installation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numba.core import event


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
    with event.install_listener("numba:compile", _Compiling(begun, ended)):
        yield
