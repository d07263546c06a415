"""The rims of a mesh's holes as rows of darts: who comes before and after whom along each hole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import dot
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.motion import _kernels_rim
from simplexmesh.motion.forces import CONSTRAINTS

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rim:
    """All vertices on holes, each with its neighbors along the hole.

    Attributes
    ----------
    vertices : (m,) array of int
        The vertices on the rims.
    before, after : (m,) array of int
        Rows of `vertices`: the previous and the next vertex along the same hole.
    """

    vertices: NDArray[np.int32]
    before: NDArray[np.int32]
    after: NDArray[np.int32]

    @classmethod
    def of(cls, connectivity: Connectivity) -> Rim | None:
        """Return the rims of a mesh, or None when it has no hole.

        Examples
        --------
        >>> import simplexmesh as sm
        >>> Rim.of(sm.sphere(2).connectivity) is None
        True
        """
        if not connectivity.n_holes:
            return None
        offsets = connectivity.face_offsets
        rows, before, after, start = [], [], [], 0
        for face in np.flatnonzero(connectivity.face_is_hole):
            around = connectivity.face_vertices[offsets[face] : offsets[face + 1]]
            places = np.arange(len(around), dtype=np.int32) + start
            rows.append(around)
            before.append(np.roll(places, 1))
            after.append(np.roll(places, -1))
            start += len(around)
        return cls(np.concatenate(rows), np.concatenate(before), np.concatenate(after))

    def targets(self, vertices: Array, constraint: NDArray[np.int8], memory: Memory) -> Array:
        """Return (m, 3) where the contour's internal force draws each rim vertex: even spacing, and its constraint.

        The 1-simplex constraints in space (Delingette 1994, sections 3.2 and 4.8) with equal metric parameters.
        ``free`` keeps the rim's own curvature, ``orientation`` asks for none, ``shape`` for the place in `memory`, all
        others for continuous curvature: a circle with evenly spaced vertices is at rest, so rims do not contract.
        """
        work = np.zeros((3, len(self.vertices), 3))
        rows = (self.vertices, self.before, self.after)
        shaped = bool((constraint[self.vertices] == CONSTRAINTS.index("shape")).any())
        remembered = memory.places(vertices) if shaped else work[2]
        _kernels_rim.rim_targets(vertices, *rows, constraint, remembered, work[0], work[1], np.zeros(3), work[2])
        return work[2]


class Memory:
    """The places of rim vertices among the vertices within two edges, as they are on a reference mesh.

    A contour in space has no normal of its own, and the planes of its few neighbors are too short a lever: frames made
    of them amplify errors. The similarity that fits the whole neighborhood best does not.

    Parameters
    ----------
    row : (m,) array of int
        Vertices to remember.
    vertices : (n, 3) array of float
        The reference.
    neighbors : (n, 3) array of int

    References
    ----------
    M. Müller et al., "Meshless deformations based on shape matching", ACM Transactions on Graphics 24 (3), 2005.
    """

    def __init__(self, row: NDArray[np.int32], vertices: Array, neighbors: NDArray[np.int32]) -> None:
        near = neighbors[row]
        self._stars = np.concatenate([row[:, None], near, neighbors[near].reshape(-1, 9)], axis=1)
        weights = np.ones(self._stars.shape)
        weights[:, 4:][self._stars[:, 4:] == row[:, None]] = 0.0
        self._weights = weights / weights.sum(axis=1, keepdims=True)
        self._offsets, _ = self._centered(vertices)
        self._size2 = np.maximum((self._weights * dot(self._offsets, self._offsets)).sum(axis=1), 1e-300)

    def _centered(self, vertices: Array) -> tuple[Array, Array]:
        """Return each neighborhood (m, 13, 3) from its center, and the centers (m, 3)."""
        stars = vertices[self._stars]
        centers = np.einsum("mk,mki->mi", self._weights, stars)
        return stars - centers[:, None], centers

    def places(self, vertices: Array) -> Array:
        """Return (m, 3) where each vertex belongs, by the best similarity of its neighborhood then to that now."""
        offsets, centers = self._centered(vertices)
        U, S, Vt = np.linalg.svd(np.einsum("mki,mk,mkj->mij", offsets, self._weights, self._offsets))
        turn = np.where(np.linalg.det(U) * np.linalg.det(Vt) < 0, -1.0, 1.0)
        U[:, :, 2] *= turn[:, None]
        scale = (S[:, 0] + S[:, 1] + turn * S[:, 2]) / self._size2
        return centers + scale[:, None] * np.einsum("mij,mjk,mk->mi", U, Vt, self._offsets[:, 0])
