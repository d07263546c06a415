"""Ctrl-C during a callback of the compiler, where exceptions are discarded: the signal is sent again."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

RESEND_DELAY = 0.02
"""Seconds until it is sent again."""


@contextmanager
def resend_lost_interrupts() -> Iterator[None]:
    """Send SIGINT again whenever a KeyboardInterrupt is discarded in a callback from C, such as LLVM's.

    Examples
    --------
    >>> before = sys.unraisablehook
    >>> with resend_lost_interrupts():
    ...     sys.unraisablehook is not before
    True
    >>> sys.unraisablehook is before
    True
    """

    def hook(lost: sys.UnraisableHookArgs) -> None:
        if lost.exc_type is KeyboardInterrupt:
            threading.Timer(RESEND_DELAY, signal.raise_signal, [signal.SIGINT]).start()
        else:
            previous(lost)

    previous = sys.unraisablehook
    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = previous
