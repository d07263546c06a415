"""The exceptions and the warning this library defines; it otherwise raises ValueError, TypeError and OSError."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from typing import Any


class TopologyError(ValueError):
    """The given or requested connectivity is not that of a simplex mesh; the message says where and why."""


class DivergedError(RuntimeError):
    """Vertex positions became infinite or NaN during the motion, or left the start and the data.

    Attributes
    ----------
    mesh : SimplexMesh or None
        The last mesh whose vertices were all finite.
    """

    def __init__(self, message: str, mesh: Any = None) -> None:
        super().__init__(message)
        self.mesh = mesh


class SimplexMeshWarning(UserWarning):
    """The input had a defect that was repaired; the message says what and how often."""


def counted(count: int, singular: str, plural: str) -> str:
    """Return a number with its noun in singular or plural, for messages."""
    return f"{count:,} {singular if count == 1 else plural}"


def place(point: Sequence[float]) -> str:
    """Return a place as text, digits enough for coordinates far from the origin."""
    return f"({', '.join(f'{value:.7g}' for value in point)})"


def warn(message: str) -> None:
    """Issue a SimplexMeshWarning that points at the line that called this library."""
    package, level = (f"{__name__.partition('.')[0]}.", "functools.", "contextlib.", "typer.", "click."), 1
    frame = sys._getframe(1)
    while frame.f_back is not None and f"{frame.f_globals.get('__name__', '')}.".startswith(package):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, SimplexMeshWarning, stacklevel=level + 1)
