"""Ctrl-C held back until the work can stop with something whole: between imports, iterations and files."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from simplexmesh._interrupts import resend_lost_interrupts

Report = Callable[[float, str], None]

PATIENCE = 1.0
"""Seconds after which somebody who pressed Ctrl-C is told that it was heard."""

HEARD = "note: stopping as soon as it can; Ctrl-C once more breaks off at once\n"


class Interrupts:
    """Whether Ctrl-C was pressed since the work began."""

    def __init__(self) -> None:
        self.asked = False
        self._waiting: threading.Timer | None = None

    def heard(self) -> None:
        """Note that Ctrl-C was pressed, and say so if the work goes on for long: kernels that compile take a minute."""
        self.asked = True
        self._waiting = threading.Timer(PATIENCE, lambda: sys.stderr.write(HEARD))
        self._waiting.daemon = True
        self._waiting.start()

    def check(self) -> None:
        """Stop here if Ctrl-C was pressed, once.

        Raises
        ------
        KeyboardInterrupt
        """
        if self.asked:
            self.asked = False
            self.settle()
            raise KeyboardInterrupt

    def settle(self) -> None:
        """Say no more: the work has stopped."""
        if self._waiting is not None:
            self._waiting.cancel()

    def watching(self, report: Report) -> Report:
        """Return the report, which also stops the work at its next call after Ctrl-C."""

        def reported(share: float, message: str) -> None:
            self.check()
            report(share, message)

        return reported


@contextmanager
def held_interrupts() -> Iterator[Interrupts]:
    """Note Ctrl-C instead of breaking off whatever runs, such as an import or the writing of a file; twice breaks off.

    Elsewhere than in the main thread Ctrl-C is left as it is.
    """
    interrupts = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return

    def noted(number: int, frame: object) -> None:
        if interrupts.asked:
            raise KeyboardInterrupt
        interrupts.heard()

    before = signal.signal(signal.SIGINT, noted)
    try:
        with resend_lost_interrupts():
            yield interrupts
    finally:
        interrupts.settle()
        signal.signal(signal.SIGINT, before)
