"""Progress, as a bar or as calls to the user's own function."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

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

        with Progress(transient=True) as bar:
            task = bar.add_task("reconstructing", total=1.0)
            yield lambda fraction, message: bar.update(task, completed=fraction, description=message)
    else:
        yield _silent
