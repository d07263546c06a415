"""The interface of targets, and the record of one iteration of a motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Target(Protocol):
    """Data that attracts a mesh: any object with a method `gap`."""

    def gap(self, vertices: Array, normals: Array, reach: float) -> Array:
        """Return (n,) the signed distance along its normal from each vertex to the data; NaN where none is in `reach`.

        The arrays are read-only views of the model's own; `reach` may be infinite.
        """


def check_target(target: Any, name: str = "target") -> None:
    """Raise a TypeError for a target without a method `gap`."""
    if not callable(getattr(target, "gap", None)):
        raise TypeError(f"{name} must have a method gap(vertices, normals, reach), not {type(target).__name__}")


@dataclass(frozen=True)
class State:
    """Summary of one iteration of a motion.

    Attributes
    ----------
    iteration : int
        Iterations done since the model was made.
    energy : float
        Mean over the vertices of half of ``alpha |P* - P|^2 + beta gap^2``, in squared units; of a vertex on a hole, P*
        is the goal of the boundary's internal force.
    gap : float
        Mean distance to the data along the normals, in the mesh's unit; NaN when no vertex is within reach.
    reached : float
        Fraction of the vertices that have data within reach.
    move : float
        Largest displacement of a vertex in this iteration, in the mesh's unit.
    released : float
        Fraction of the vertices that are folded, or were left without data by a fold. They contract until they find
        data; a mesh with many of them is not at its goal, however small `gap` is.
    """

    iteration: int
    energy: float
    gap: float
    reached: float
    move: float
    released: float = 0.0

    @classmethod
    def of(cls, iteration: int, energy: Array, gaps: Array, move: float, released: NDArray[np.bool_]) -> State:
        """Return the state of a mesh from the (n,) energies and gaps of its vertices, and which are released."""
        seen = np.isfinite(gaps)
        reached = float(seen.mean())
        gap = float(np.abs(gaps[seen]).mean()) if reached else float("nan")
        return cls(iteration, float(energy.mean()), gap, reached, move, float(released.mean()))
