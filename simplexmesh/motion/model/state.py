"""The course of a motion: its stages, the record of an iteration, when it is at rest, and what keeps it from straying.

Forces along normals of folded vertices are the known trap of deformable models: their sides are confused, what they
are averaged with is not their surface, and parts of constant mean curvature that no data holds grow without bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices32, Mask
from simplexmesh._base.errors import counted, warn
from simplexmesh._base.vectors import norm
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model import _kernels_averages

STILL, LEVEL = 0.01, 0.02
"""Of the mean edge, the longest step, and of the mean energy, its change, of a motion at rest. A tenth and a quarter of
them take up to three times the iterations, in which vertices slide along the data; with twice the step boundaries of
holes stop halfway."""

MARGIN = 0.05
"""Of the diagonal of start and data: how far beyond their bounding box a vertex may swing, if not two edges."""

RINGS = 12
"""Edges from a fold within which vertices without data are released; less leaves films around bodies."""

MOST_UNSEEN, FAR = 0.25, 0.03
"""Of the vertices, and of the diagonal: how many vertices without data within reach, and how far any of them from what
the others see, if by two edges too, are warned of at the end of a motion: a film over a hole, a bridge."""


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
    def of(cls, iteration: int, energy: Array, gaps: Array, move: float, released: Mask) -> State:
        """Return the state of a mesh from the (n,) energies and gaps of its vertices, and which are released."""
        seen = np.isfinite(gaps)
        reached = float(seen.mean())
        gap = float(np.abs(gaps[seen]).mean()) if reached else float("nan")
        return cls(iteration, float(energy.mean()), gap, reached, move, float(released.mean()))


@dataclass(frozen=True)
class Stage:
    """One stage of a coarse-to-fine motion; the parameters are those of `DeformableModel`."""

    rigidity: int
    reach: float
    iterations: int
    alpha: float = 0.4
    beta: float = 0.2
    adaptation: float = 0.0


def mean_edge(mesh: SimplexMesh) -> float:
    """Return the mean length of the edges, in the mesh's unit."""
    ends = mesh.vertices[mesh.connectivity.edge_vertices]
    return float(norm(ends[:, 0] - ends[:, 1]).mean())


def is_at_rest(states: Sequence[State], edge: float) -> bool:
    """Return whether in the last ten of a stage's states no vertex moved by much of an `edge`, or the energy rests."""
    if len(states) < 20 or len(states) % 10:
        return False
    if max(state.move for state in states[-10:]) <= STILL * edge:
        return True
    blocks = np.array([state.energy for state in states[-30:]]).reshape(-1, 10)
    then, now = blocks[-2:].mean(axis=1)
    # half of alpha is 0.2: of vertices that near to their goals the energy falls as long as they slide along clean data
    if now <= 0.2 * (STILL * edge) ** 2 or abs(now - then) <= LEVEL * then:
        return True
    change = np.abs(np.diff(blocks.mean(axis=1)))
    return len(blocks) == 3 and bool((change <= blocks[1:].std(axis=1) * 0.2**0.5).all())  # its standard error


class Release:
    """The vertices folded, or without data where folds spread: they unfold, or contract until they find data."""

    def __init__(self, count: int) -> None:
        self._rings, self._other = np.zeros(count, np.int8), np.zeros(count, np.int8)

    @property
    def mask(self) -> Mask:
        """(n,) bool: the vertices released now."""
        return self._rings > 0

    def update(self, normals: Array, neighbors: Indices32, gaps: Array, held: Mask) -> None:
        """Find the vertices released now, given their gaps (n,); none of those that are held (n,)."""
        _kernels_averages.released(len(normals), normals, neighbors, gaps, RINGS, self._rings, self._other)
        self._rings, self._other = self._other, self._rings
        self._rings[held] = 0


class Confines:
    """The box around the start of a motion and the `bounds` (2, 3) of its target, if it has such."""

    def __init__(self, start: Array, neighbors: Indices32, target: Any) -> None:
        self.target, self._box, self._room = target, None, 0.0
        bounds: Any = getattr(target, "bounds", None)
        if np.shape(bounds) == (2, 3):
            low, high = np.minimum(start.min(axis=0), bounds[0]), np.maximum(start.max(axis=0), bounds[1])
            edge = float(np.linalg.norm(start[neighbors] - start[:, None], axis=2).mean())
            margin = max(MARGIN * float(np.linalg.norm(high - low)), 2.0 * edge)
            self._box = low - margin, high + margin

    def stray(self, vertices: Array, move: float) -> int:
        """Return the first vertex outside, -1 for none; no vertex has moved farther than `move` since the last call."""
        self._room -= move
        if self._box is None or self._room > 0.0:
            return -1
        low, high = self._box
        self._room = min(min(x.min() - a, b - x.max()) for a, x, b in zip(low, vertices.T, high, strict=True))
        if self._room >= 0.0:
            return -1  # which a comparison of rows of three would tell in four times the time
        out = (vertices < low) | (vertices > high)
        return int(out.any(axis=1).argmax()) if out.any() else -1


def warn_of_end(mesh: SimplexMesh, gaps: Array, released: Mask, reach: float) -> None:
    """Warn at the end of a motion of vertices that are folded, or left without data by folds, or far from all data."""
    unseen = np.isnan(gaps) & ~released
    if released.any():
        count = counted(int(released.sum()), "vertex is", "vertices are")
        warn(f"{count} folded, or off the data beside folds; a start nearer to the data, or more vertices, may help")
    if unseen.any():
        on = ~np.isnan(gaps)
        seen = mesh.vertices[on] + gaps[on, None] * mesh.normals[on]
        away = float(cKDTree(seen).query(mesh.vertices[unseen])[0].max()) if len(seen) else float("inf")
        if unseen.mean() > MOST_UNSEEN or away > max(FAR * mesh.diagonal, 2.0 * mean_edge(mesh)):
            said = f", and are up to {away:.3g} from what the others reach" if len(seen) else ""
            share = f"{100 * unseen.mean():.3g}%"
            warn(f"{share} of the vertices have no data within reach ({reach:.3g}) along their normals{said}")
