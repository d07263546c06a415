"""Ctrl-C where it must not strike: in a callback from C, whose exceptions are lost or fatal, or within a step."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from simplexmesh._base.progress import Progress

DELAY = 1.0
"""Seconds after which a Ctrl-C that has not taken effect is acknowledged."""

ACKNOWLEDGMENT = "note: stopping as soon as possible; press Ctrl-C again to stop at once\n"


@contextmanager
def resend_lost_interrupts() -> Iterator[None]:
    """Send SIGINT again whenever a KeyboardInterrupt is discarded in a callback from C, such as LLVM's."""

    def hook(lost: sys.UnraisableHookArgs) -> None:
        if lost.exc_type is KeyboardInterrupt:
            threading.Timer(0.02, signal.raise_signal, [signal.SIGINT]).start()
        else:
            previous(lost)

    previous = sys.unraisablehook
    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = previous


class Interrupts:
    """A pending Ctrl-C."""

    def __init__(self) -> None:
        self.pending = False
        self._timer: threading.Timer | None = None

    def request(self) -> None:
        """Record a Ctrl-C; acknowledge it if the work does not stop soon (compiling kernels takes up to a minute)."""
        self.pending = True
        self._timer = threading.Timer(DELAY, lambda: sys.stderr.write(ACKNOWLEDGMENT))
        self._timer.daemon = True
        self._timer.start()

    def check(self) -> None:
        """Raise the pending interrupt, if there is one, and clear it."""
        if self.pending:
            self.pending = False
            self.cancel_acknowledgment()
            raise KeyboardInterrupt

    def cancel_acknowledgment(self) -> None:
        """Print no acknowledgment: the work has stopped."""
        if self._timer is not None:
            self._timer.cancel()

    def checking(self, report: Progress) -> Progress:
        """Return the progress callback with a check for Ctrl-C at each call."""

        def reported(share: float, message: str) -> None:
            self.check()
            report(share, message)

        return reported


@contextmanager
def deferred_interrupts() -> Iterator[Interrupts]:
    """Record Ctrl-C of the main thread instead of raising it within an import or a file; a second one raises."""
    interrupts = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return

    def handler(number: int, frame: object) -> None:
        if interrupts.pending:
            raise KeyboardInterrupt
        interrupts.request()

    before = signal.signal(signal.SIGINT, handler)
    try:
        with resend_lost_interrupts():
            yield interrupts
    finally:
        interrupts.cancel_acknowledgment()
        signal.signal(signal.SIGINT, before)
