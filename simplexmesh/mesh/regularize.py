"""Even face sizes: swap edges until all faces have five, six or seven vertices, but for rare ones, which are told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh


@dataclass(frozen=True, eq=False, repr=False)
class Regularized(Edited):
    """A mesh with even face sizes.

    Attributes
    ----------
    swaps : int
        How many edges were swapped.
    exceptions : (m,) array of int
        The faces of the new mesh, holes left out, that have fewer than five or more than seven vertices still.
    """

    swaps: int
    exceptions: NDArray[np.int32]


def regularize(mesh: SimplexMesh) -> Regularized:
    """Swap edges (T7), the most unequal first, until the faces have five, six or seven vertices wherever they can.

    An edge is unequal by c = N1 + N2 - N3 - N4, the sizes of its adjacent faces less those of its opposite ones. A swap
    changes the sum of the squared sizes by 4 - 2 c, so those with c >= 3 come to an end by themselves. Those with c = 2
    leave that sum as it is and could go to and fro for ever; they are done when the sum of (N - 6)^4 gets less, which
    rids the mesh of faces of four and eight. Edges on a hole stay, and so do numbers of vertices and faces, the genus
    and the holes.

    Parameters
    ----------
    mesh : SimplexMesh
        The mesh.

    Returns
    -------
    Regularized
        The mesh, and the faces that are exceptions.

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
    >>> from simplexmesh.mesh.operators import refine_face
    >>> from simplexmesh.mesh.regularize import regularize
    >>> uneven = refine_face(sm.sphere(8), 40).mesh
    >>> out = regularize(uneven)
    >>> sorted({len(face) for face in out.mesh.faces}), len(out.exceptions)
    ([5, 6, 7], 0)
    """
    edit = EditableMesh(mesh)
    swaps = edit.even_out()
    out = edit.result()
    c = out.mesh.connectivity
    odd = np.flatnonzero(((c.face_sizes < 5) | (c.face_sizes > 7)) & ~c.face_is_hole).astype(np.int32)
    return Regularized(out.mesh, out.vertex_map, out.face_map, swaps, _check.frozen(odd))
