"""Ctrl-C during a callback from C: of the compiler, which discards exceptions, or of VTK, which ends the process."""

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


@contextmanager
def held_interrupts() -> Iterator[None]:
    """Hold Ctrl-C back until the end, as while drawing: VTK may crash on an exception in a callback.

    Outside the main thread Ctrl-C is left as it is.

    Examples
    --------
    >>> try:
    ...     with held_interrupts():
    ...         signal.raise_signal(signal.SIGINT)
    ...         print("done")
    ... except KeyboardInterrupt:
    ...     print("interrupted")
    done
    interrupted
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    held: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: held.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if held:
            signal.raise_signal(signal.SIGINT)
