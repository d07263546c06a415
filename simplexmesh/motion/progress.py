"""Progress, as a bar or as calls to the user's own function."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

COMPILING = "compiling, this first time"

Report = Callable[[float, str], None]
"""Called with the share done (0 to 1) and what is being done."""


def _silent(fraction: float, message: str) -> None:
    """Do nothing."""


@contextmanager
def reporting(progress: bool | Report) -> Iterator[Report]:  # noqa: FBT001  the caller's own keyword
    """Yield the function to report to: the user's, a bar on the terminal or in the notebook, or nothing.

    Examples
    --------
    >>> with reporting(lambda fraction, message: print(f"{fraction:.0%} {message}")) as report:
    ...     report(0.5, "fitting")
    50% fitting
    """
    if callable(progress):
        yield progress
    elif progress:
        from rich.progress import Progress

        with Progress(transient=True) as bar, moving(bar, "reconstructing") as report:
            yield report
    else:
        yield _silent


@contextmanager
def moving(bar: Any, title: str, prefix: str = "") -> Iterator[Report]:
    """Yield a function that moves a bar of rich's, which also says when kernels are compiled instead.

    Examples
    --------
    >>> from rich.progress import Progress
    >>> bar = Progress(disable=True)
    >>> with moving(bar, "fitting") as report:
    ...     report(0.5, "half of it")
    >>> bar.tasks[0].description, bar.tasks[0].percentage
    ('half of it', 50.0)
    """
    from simplexmesh._kernels_compiled import compiling

    task = bar.add_task(title, total=1.0)
    said = title

    def moved(fraction: float, message: str) -> None:
        nonlocal said
        said = prefix + message
        bar.update(task, completed=fraction, description=said)

    def begun() -> None:
        bar.update(task, description=f"{said} ({COMPILING})")

    def ended() -> None:
        bar.update(task, description=said)

    with compiling(begun, ended):
        yield moved
