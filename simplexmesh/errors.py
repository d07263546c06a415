"""The errors that are this library's own; everything else is ValueError, TypeError or OSError."""

from __future__ import annotations

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
