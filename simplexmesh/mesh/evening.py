"""Even sizes: large faces divided and small ones merged, whatever stretched or shrank them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.face_geometry import face_areas
from simplexmesh.mesh.simplex_mesh import SimplexMesh

Array = NDArray[np.float64]

LARGE, SMALL, MERGED = 1.7, 0.45, 1.3
"""Faces beyond `LARGE` times the area wanted are divided; those below `SMALL` merge where that makes no `MERGED`."""


def evened(mesh: SimplexMesh, wanted: Array) -> Edited:
    """Divide faces that are too large (T2), merge those that are too small (T1), and even out their vertices (T7).

    One round: each face is divided once at most, across where it is narrowest. Genus and holes stay.

    Parameters
    ----------
    mesh : SimplexMesh
    wanted : (f,) array of float
        The area that each face should have, holes counted, in squared units of the mesh; above 0.

    Returns
    -------
    Edited
        The mesh, and where everything went.

    Raises
    ------
    ValueError
        When an area wanted is not above 0, or not one is given for each face.
    TopologyError
        When the mesh is not complete.

    References
    ----------
    H. Delingette, thesis, 1994, section 5.5, has the operators; the rule is the one usual for remeshing to a size.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> from simplexmesh.mesh.evening import evened
    >>> ball = sm.sphere(6)
    >>> evened(ball, np.full(362, ball.area / 500)).mesh.n_faces
    362
    >>> evened(ball, np.full(362, ball.area / 1000)).mesh.n_faces
    639
    """
    c = mesh.connectivity
    wanted = _check.array("wanted", wanted, (len(c.face_sizes),))
    if not (wanted > 0).all():
        raise ValueError(f"wanted must be areas above 0, not {wanted.min():g}")
    size = face_areas(mesh.vertices, c.face_vertices, c.face_offsets) / wanted
    edit = EditableMesh(mesh)
    large = np.flatnonzero((size > LARGE) & (c.face_sizes >= 5) & ~c.face_is_hole)
    if len(large):
        across = np.array([_across(mesh, face) for face in large.tolist()])
        edit.insert_edges(across[:, 0], across[:, 1])
    small = [_beside(mesh, face, size) for face in np.flatnonzero((size < SMALL) & ~c.face_is_hole).tolist()]
    if small := [dart for dart in small if dart >= 0]:
        edit.remove_edges(small)
    edit.even_out()
    return edit.result()


def _across(mesh: SimplexMesh, face: int) -> tuple[int, int]:
    """Return the two darts of a face whose middles are closest, of those that face each other."""
    c = mesh.connectivity
    darts = c.face_darts[c.face_offsets[face] : c.face_offsets[face + 1]]
    corners = mesh.vertices[darts // 3]
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
    half = len(darts) // 2
    start = int(np.linalg.norm(middles - np.roll(middles, -half, axis=0), axis=1).argmin())
    return int(darts[start]), int(darts[(start + half) % len(darts)])


def _beside(mesh: SimplexMesh, face: int, size: Array) -> int:
    """Return the dart of a face towards its smallest neighbor, -1 when merged they would be too large."""
    c = mesh.connectivity
    darts = c.face_darts[c.face_offsets[face] : c.face_offsets[face + 1]]
    other = c.face.reshape(-1)[c.twin.reshape(-1)[darts]]
    both = np.where(c.face_is_hole[other], np.inf, size[other] + size[face])
    best = int(both.argmin())
    return int(darts[best]) if both[best] < MERGED else -1
