"""The rims of a mesh's holes as rows of darts: who comes before and after whom along each hole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.motion import _kernels_rim

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

    def places(self, vertices: Array, neighbors: NDArray[np.int32]) -> Array:
        """Return (m, 3) where each rim vertex is, from the middle of the chord between its neighbors along the rim.

        Along the chord, into the surface and across it, in lengths of the chord: what a similarity does not change.
        """
        out = np.zeros((len(self.vertices), 3))
        rows = (self.vertices, self.before, self.after)
        _kernels_rim.rim_places(np.array(vertices), neighbors, *rows, np.zeros((3, 3)), out)
        return out

    def targets(
        self, vertices: Array, neighbors: NDArray[np.int32], constraint: NDArray[np.int8], remembered: Array
    ) -> Array:
        """Return (m, 3) where the contour's internal force draws each rim vertex: even spacing, and its constraint.

        The 1-simplex constraints in space (Delingette 1994, sections 3.2 and 4.8) with equal metric parameters.
        ``free`` keeps the rim's own curvature, ``orientation`` asks for none, ``shape`` for the place `remembered` (see
        `places`), all others for continuous curvature: a circle with evenly spaced vertices is at rest, so rims do not
        contract.
        """
        work = np.zeros((3, len(self.vertices), 3))
        rows = (self.vertices, self.before, self.after)
        _kernels_rim.rim_targets(
            vertices, neighbors, *rows, constraint, remembered, work[0], work[1], np.zeros((3, 3)), work[2]
        )
        return work[2]
