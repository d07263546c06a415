"""Deferred Ctrl-C: a command is interrupted between imports, iterations and files, never within one."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from simplexmesh._interrupts import resend_lost_interrupts

Report = Callable[[float, str], None]

DELAY = 1.0
"""Seconds after which a Ctrl-C that has not taken effect is acknowledged."""

ACKNOWLEDGMENT = "note: stopping as soon as possible; press Ctrl-C again to stop at once\n"


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
        """Raise the pending interrupt, if there is one, and clear it.

        Raises
        ------
        KeyboardInterrupt
        """
        if self.pending:
            self.pending = False
            self.cancel_acknowledgment()
            raise KeyboardInterrupt

    def cancel_acknowledgment(self) -> None:
        """Print no acknowledgment: the work has stopped."""
        if self._timer is not None:
            self._timer.cancel()

    def checking(self, report: Report) -> Report:
        """Return the progress callback with a check for Ctrl-C at each call."""

        def reported(share: float, message: str) -> None:
            self.check()
            report(share, message)

        return reported


@contextmanager
def deferred_interrupts() -> Iterator[Interrupts]:
    """Record Ctrl-C instead of raising it in the middle of an import or of writing a file; a second one raises.

    Outside the main thread Ctrl-C is left as it is.
    """
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
