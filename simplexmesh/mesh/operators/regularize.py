"""Regularization of face sizes: swap edges until nearly all faces have five, six or seven vertices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Indices32
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.results import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh


@dataclass(frozen=True, eq=False, repr=False)
class Regularized(Edited):
    """A regularized mesh.

    Attributes
    ----------
    swaps : int
        Number of edges swapped.
    exceptions : (m,) array of int
        The faces of the new mesh, holes excluded, that still have fewer than five or more than seven vertices.
    """

    swaps: int
    exceptions: Indices32


def exceptional_faces(connectivity: Connectivity) -> Indices32:
    """Return the faces, holes excluded, that have fewer than five or more than seven vertices."""
    sizes = connectivity.face_sizes
    odd = ((sizes < 5) | (sizes > 7)) & ~connectivity.face_is_hole
    out: Indices32 = checks.frozen(np.flatnonzero(odd), np.int32)
    return out


def regularize(mesh: SimplexMesh) -> Regularized:
    """Swap edges (T7), the most unequal first, until as many faces as possible have five, six or seven vertices.

    The imbalance of an edge is c = N1 + N2 - N3 - N4, the sizes of its adjacent faces minus those of its opposite ones.
    A swap changes the sum of the squared sizes by 4 - 2 c, so swaps with c >= 3 terminate. Swaps with c = 2 leave that
    sum unchanged and could cycle; they are made if the sum of (N - 6)^4 decreases, which eliminates faces of four and
    eight vertices. Edges on a hole are kept, as are the numbers of vertices and faces, the genus and the holes.

    Raises
    ------
    TopologyError
        When the mesh is not complete.

    References
    ----------
    H. Delingette, thesis, 1994, section 5.5.2, where all c >= 2 are swapped.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> uneven = sm.refine_face(sm.sphere(8), 40).mesh
    >>> out = sm.regularize(uneven)
    >>> sorted({len(face) for face in out.mesh.faces}), len(out.exceptions)
    ([5, 6, 7], 0)
    """
    edit = EditableMesh(mesh)
    swaps = edit.even_out()
    out = edit.result()
    return Regularized(out.mesh, out.vertex_map, out.face_map, swaps, exceptional_faces(out.mesh.connectivity))
