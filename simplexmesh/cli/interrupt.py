"""Ctrl-C held back until the work can stop with something whole: between imports, iterations and files."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Report = Callable[[float, str], None]


class Interrupts:
    """Whether Ctrl-C was pressed since the work began."""

    def __init__(self) -> None:
        self.asked = False

    def check(self) -> None:
        """Stop here if Ctrl-C was pressed, once.

        Raises
        ------
        KeyboardInterrupt
        """
        if self.asked:
            self.asked = False
            raise KeyboardInterrupt

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
        interrupts.asked = True

    before = signal.signal(signal.SIGINT, noted)
    try:
        yield interrupts
    finally:
        signal.signal(signal.SIGINT, before)
