"""The errors that are this library's own; everything else is ValueError, TypeError or OSError."""

from __future__ import annotations

import sys
import warnings
from typing import Any


class TopologyError(ValueError):
    """The connectivity given or asked for is not that of a simplex mesh; the message says where and why."""


class DivergedError(RuntimeError):
    """A motion left the finite numbers.

    Attributes
    ----------
    mesh : SimplexMesh or None
        The last mesh whose vertices were all finite.
    """

    def __init__(self, message: str, mesh: Any = None) -> None:
        super().__init__(message)
        self.mesh = mesh


class SimplexMeshWarning(UserWarning):
    """The data given had a flaw that was repaired; the message says what and how often."""


def told(message: str) -> None:
    """Warn, at the line that called this library, however deep inside something was found.

    Examples
    --------
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     told("merged 12 duplicate points")
    >>> str(caught[0].message), caught[0].filename == __file__
    ('merged 12 duplicate points', False)
    """
    package, level = (f"{__name__.partition('.')[0]}.", "functools.", "contextlib."), 1
    frame = sys._getframe(1)
    while frame.f_back is not None and f"{frame.f_globals.get('__name__', '')}.".startswith(package):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, SimplexMeshWarning, stacklevel=level + 1)
