"""What the motion of one part against another must keep to."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh._vec import norm
from simplexmesh.recognition.rigid import point_pairs

Array = NDArray[np.float64]


class Limits(NamedTuple):
    """What a motion must keep to.

    Attributes
    ----------
    near, far : float
        Gaps at which parts touch, and beyond which they have nothing to do with each other.
    deep : float
        How deep parts may go into each other.
    here, there : (k, 3) array of float
        Pairs.
    slack : float
        How far these may be apart.
    """

    near: float
    far: float
    deep: float
    here: Array
    there: Array
    slack: float

    def apart(self, T: Array) -> Array:
        """Return how far apart each pair is after the motion T (4, 4) of the moving part."""
        return np.asarray(norm(self.here @ T[:3, :3].T + T[:3, 3] - self.there))


def bounds_of(pairs: Any, slack: float | None) -> tuple[Array, Array, float]:
    """Return points of the moving part, those of the fixed one, and how far they may be apart.

    Raises
    ------
    ValueError, TypeError
    """
    none = np.zeros((0, 3))
    if pairs is None:
        if slack is not None:
            raise ValueError("slack must be left out without pairs")
        return none, none, np.inf
    here, there = point_pairs(pairs, "of the moving part and of the fixed one")
    if len(here) < 3 and slack is None:
        raise ValueError(f"pairs must be at least 3 without a slack, not {len(here)}")
    return here, there, np.inf if slack is None else _check.number("slack", slack, 0.0, open_low=True)
