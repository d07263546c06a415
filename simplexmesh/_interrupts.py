"""Ctrl-C that meets a callback of the compiler, where an exception leads nowhere: it comes again a moment later."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

AGAIN = 0.02
"""Seconds until then."""


@contextmanager
def insistent_interrupts() -> Iterator[None]:
    """Let no KeyboardInterrupt be lost in code that cannot be broken off, such as LLVM's.

    Examples
    --------
    >>> before = sys.unraisablehook
    >>> with insistent_interrupts():
    ...     sys.unraisablehook is not before
    True
    >>> sys.unraisablehook is before
    True
    """

    def swallowed(lost: sys.UnraisableHookArgs) -> None:
        if lost.exc_type is KeyboardInterrupt:
            threading.Timer(AGAIN, signal.raise_signal, [signal.SIGINT]).start()
        else:
            told(lost)

    told = sys.unraisablehook
    sys.unraisablehook = swallowed
    try:
        yield
    finally:
        sys.unraisablehook = told
