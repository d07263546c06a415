"""Whether kernels are being compiled: at the first use after installing only, which takes up to a minute."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numba.core import event


class _Compiling(event.Listener):  # type: ignore[misc]
    """Tells when compilation begins and ends; kernels that call others are compiled within each other's time."""

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
    """Call one function when kernels begin to be compiled, another when they are; none for those in the cache.

    Examples
    --------
    >>> from numba import njit
    >>> with compiling(lambda: print("compiling"), lambda: print("compiled")):
    ...     njit(lambda x: x + 1)(1)
    compiling
    compiled
    2
    """
    with event.install_listener("numba:compile", _Compiling(begun, ended)):
        yield
