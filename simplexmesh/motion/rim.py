"""Rims of holes: boundary vertices, their order along each hole, and the goals of their internal force."""

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
    """The vertices on holes, each with its two neighbors along the hole.

    Attributes
    ----------
    vertices : (m,) array of int
        Each vertex on a rim.
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
        vertices, before, after, start = [], [], [], 0
        for face in np.flatnonzero(connectivity.face_is_hole):
            around = connectivity.face_vertices[offsets[face] : offsets[face + 1]]
            rows = np.arange(len(around), dtype=np.int32) + start
            vertices.append(around)
            before.append(np.roll(rows, 1))
            after.append(np.roll(rows, -1))
            start += len(around)
        return cls(np.concatenate(vertices), np.concatenate(before), np.concatenate(after))

    def goals(self, vertices: Array, constraint: NDArray[np.int8], shape: RimShape) -> Array:
        """Return (m, 3) the goal of the internal force at each rim vertex: evenly spaced, at its constraint's height.

        The constraints of 1-simplex meshes in space (Delingette 1994, sections 3.2 and 4.8), metric parameters equal.
        ``free`` keeps the present curvature, ``orientation`` asks for zero curvature, ``shape`` for the position in
        `shape`, all others for curvature averaged along the rim: evenly spaced circles are at rest and do not contract.
        """
        work = np.zeros((3, len(self.vertices), 3))
        rows = (self.vertices, self.before, self.after)
        elastic = bool((constraint[self.vertices] == CONSTRAINTS.index("shape")).any())
        restored = shape.positions(vertices) if elastic else work[2]
        _kernels_rim.rim_goals(vertices, *rows, constraint, restored, work[0], work[1], np.zeros(3), work[2])
        return work[2]


class RimShape:
    """Positions of rim vertices relative to the vertices within two edges, taken from a reference mesh.

    A contour in space has no normal, and frames built from the few nearest neighbors amplify errors. The least-squares
    similarity between whole neighborhoods does not.

    Parameters
    ----------
    rim : (m,) array of int
        The rim vertices.
    vertices : (n, 3) array of float
        Of the reference mesh.
    neighbors : (n, 3) array of int

    References
    ----------
    M. Müller et al., "Meshless deformations based on shape matching", ACM Transactions on Graphics 24 (3), 2005.
    """

    def __init__(self, rim: NDArray[np.int32], vertices: Array, neighbors: NDArray[np.int32]) -> None:
        near = neighbors[rim]
        self._neighborhoods = np.concatenate([rim[:, None], near, neighbors[near].reshape(-1, 9)], axis=1)
        weights = np.ones(self._neighborhoods.shape)
        weights[:, 4:][self._neighborhoods[:, 4:] == rim[:, None]] = 0.0
        self._weights = weights / weights.sum(axis=1, keepdims=True)
        self._offsets, _ = self._centered(vertices)
        self._size2 = np.maximum((self._weights * dot(self._offsets, self._offsets)).sum(axis=1), 1e-300)

    def _centered(self, vertices: Array) -> tuple[Array, Array]:
        """Return each neighborhood (m, 13, 3) relative to its weighted centroid, and the centroids (m, 3)."""
        positions = vertices[self._neighborhoods]
        centers = np.einsum("mk,mki->mi", self._weights, positions)
        return positions - centers[:, None], centers

    def positions(self, vertices: Array) -> Array:
        """Return (m, 3) the reference positions, mapped by the best similarity to each present neighborhood."""
        offsets, centers = self._centered(vertices)
        U, S, Vt = np.linalg.svd(np.einsum("mki,mk,mkj->mij", offsets, self._weights, self._offsets))
        sign = np.where(np.linalg.det(U) * np.linalg.det(Vt) < 0, -1.0, 1.0)
        U[:, :, 2] *= sign[:, None]
        scale = (S[:, 0] + S[:, 1] + sign * S[:, 2]) / self._size2
        return centers + scale[:, None] * np.einsum("mij,mjk,mk->mi", U, Vt, self._offsets[:, 0])
