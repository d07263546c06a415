"""Progress reports: a bar, or calls of the user's function."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

COMPILING = "compiling, this first time"

Progress = Callable[[float, str], None]
"""Called with the fraction done, 0 to 1, and a message."""


def _silent(fraction: float, message: str) -> None:
    """Do nothing."""


def announce_compiling() -> None:
    """Have the first compilation of kernels said in a line of the log, on standard error, once numba is loaded."""
    if "numba" in sys.modules:
        from simplexmesh._base._kernels_compiled import announce

        announce()


def part_of(report: Progress, low: float, high: float) -> Progress:
    """Return a function whose reports from 0 to 1 are a part of the whole."""
    return lambda fraction, message: report(low + (high - low) * fraction, message)


@contextmanager
def reporting(
    progress: bool | Progress,  # noqa: FBT001  the caller's own keyword
    title: str,
    *,
    stderr: bool = False,
) -> Iterator[Progress]:
    """Yield a function to report to: the user's, one that updates a bar on the terminal or notebook, or a dummy.

    Commands have the bar on standard error, so that what they print can be piped.
    """
    from simplexmesh._base import checks  # late, as it imports NumPy

    if callable(progress):
        yield progress
    elif checks.flag("progress", progress):
        from rich.console import Console
        from rich.progress import Progress as Bar

        console = Console(stderr=stderr)
        with Bar(console=console, transient=not console.is_jupyter) as bar, bar_reporting(bar, title) as report:
            yield report
    else:
        yield _silent


@contextmanager
def bar_reporting(bar: Any, title: str) -> Iterator[Progress]:
    """Yield a function that updates a `rich` progress bar, which also shows when kernels are being compiled."""
    from simplexmesh._base._kernels_compiled import compiling

    task = bar.add_task(title, total=1.0)
    description = title

    def update(fraction: float, message: str) -> None:
        nonlocal description
        description = f"{title}: {message}"
        bar.update(task, completed=fraction, description=description)

    def begun() -> None:
        bar.update(task, description=f"{description} ({COMPILING})")

    def ended() -> None:
        bar.update(task, description=description)

    with compiling(begun, ended):
        yield update
