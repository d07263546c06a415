"""What a motion looks at and what it tells: the target's one question, and the states it passes through."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Target(Protocol):
    """What a mesh can be drawn to: anything that answers one question."""

    def gap(self, vertices: Array, normals: Array, reach: float) -> Array:
        """Return (n,) how far along its normal the data is from each vertex; NaN where nothing is within `reach`.

        The model's own arrays are handed in, as views that cannot be written to; `reach` may be infinite.
        """


@dataclass(frozen=True)
class State:
    """A moment of the motion, light enough to keep.

    Attributes
    ----------
    iteration : int
        Iterations done since the model was made.
    energy : float
        Mean over the vertices of half of ``alpha |P* - P|^2 + beta gap^2``, in squared units; of a vertex on a rim, P*
        is where the rim's force wants it.
    gap : float
        Mean distance to the data along the normals, in the mesh's unit; NaN when no vertex is within reach.
    reached : float
        Share of the vertices that have data within reach.
    move : float
        Largest step of any vertex in this iteration, in the mesh's unit.
    """

    iteration: int
    energy: float
    gap: float
    reached: float
    move: float

    @classmethod
    def of(cls, iteration: int, energy: Array, gaps: Array, move: float) -> State:
        """Return the state of a mesh from the (n,) energies and gaps of its vertices."""
        seen = np.isfinite(gaps)
        reached = float(seen.mean())
        gap = float(np.abs(gaps[seen]).mean()) if reached else float("nan")
        return cls(iteration, float(energy.mean()), gap, reached, move)
