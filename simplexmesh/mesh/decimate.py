"""Decimation: fewer vertices, the same shape and topology, by T1 where it costs least."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.errors import warn
from simplexmesh.mesh.coarsening import made
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.fitting import Surface, tangled_vertices
from simplexmesh.mesh.regularize import exceptional_faces
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.vertex_bound import checked_vertices
from simplexmesh.mesh.within import made_within

Indices = NDArray[np.int32]


@dataclass(frozen=True, eq=False, repr=False)
class Decimated(Edited):
    """A decimated mesh.

    Attributes
    ----------
    rms, largest : float
        How far the vertices of the mesh before and the centroids of its faces are from the new one, in its unit; in
        the largest one the vertices on its rims count too, and how far they are from the new rims.
    exceptions : (m,) array of int
        The faces of the new mesh, holes left out, that have fewer than five or more than seven vertices.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> out = sm.decimate(sm.torus(40, 20), tolerance=0.1)
    >>> out.mesh.genus, out.largest <= 0.1
    (1, True)
    """

    rms: float
    largest: float
    exceptions: Indices


def decimate(mesh: Any, *, vertices: int | None = None, tolerance: float | None = None) -> Decimated:
    """Return a mesh of the same shape and topology with fewer vertices.

    Edges are removed (T1), the one that costs least first. Each face stands for a region of the surface, and what an
    edge costs is how much less flat the region of both its faces is than the two: the squared distance to the plane
    that fits best, how far normals differ, and how far it reaches. So faces end at creases, and are long where the
    surface bends one way only. An edge stays when a triangle of the dual would turn over or become thin. Then sizes
    of faces are evened out by T7, and the vertices are moved so that the faces are closest to the surface in the
    least-squares sense, each only as far as no face folds or crosses another one more than before.

    Genus, components and holes stay. Faces never merge with holes, and merging two on a rim costs how far their parts
    of it are from a line.

    Parameters
    ----------
    mesh : SimplexMesh, TriangleMesh, PyVista or trimesh object, or path
        The mesh; of triangles, their dual: in `vertex_map` and distances, vertices are the triangles and their
        centroids, see `dual`.
    vertices : int, optional
        How many to keep: even, as the number of vertices of a simplex mesh always is.
    tolerance : float, optional
        The largest distance allowed between the two surfaces, either way, and between their rims, in the unit of the
        mesh: everywhere on them, not only at points looked at. Where they are farther apart, vertices are pulled, and
        if that does not do, faces are kept smaller the next time, or as they were; a mesh without folds stays so. Give
        this or `vertices`.

    Returns
    -------
    Decimated
        The mesh, where everything went, and how far it is from the one given. Vertices that are kept take their data
        along to where they are moved; at the ends of edges that T7 turned, numbers become means, as in `swap_edge`.

    Raises
    ------
    TypeError
        When neither or both of `vertices` and `tolerance` are given, or no mesh.
    ValueError
        When `vertices` is odd, or more than there are, or `tolerance` is not above 0.
    TopologyError
        When the mesh is not complete, or `vertices` is less than its genus, holes and components allow.

    Warns
    -----
    SimplexMeshWarning
        When more vertices had to stay, or some are on faces that fold or cross: where the mesh did itself, or where
        there are too few for its thin parts.

    References
    ----------
    H. Delingette, thesis, 1994, section 7.1; M. Garland, A. Willmott and P. Heckbert, *Hierarchical face clustering on
    polygonal surfaces*, 2001, and D. Cohen-Steiner, P. Alliez and M. Desbrun, *Variational shape approximation*, 2004,
    for the cost.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(12)
    >>> out = sm.decimate(ball, vertices=400)
    >>> out.mesh
    SimplexMesh(400 vertices, 202 faces, genus 0, 0 holes)
    >>> out.rms < 0.01
    True
    >>> sm.decimate(ball.triangulated("dual"), vertices=400).mesh.n_vertices
    400
    """
    if (vertices is None) == (tolerance is None):
        raise TypeError("give vertices or tolerance" + ("" if vertices is None else ", not both"))
    mesh = _given(mesh)
    if tolerance is not None:
        near = made_within(mesh, _check.number("tolerance", tolerance, 0, open_low=True))
        return _unchanged(mesh) if near is None else _result(*near)
    wanted = checked_vertices(mesh, vertices)
    out, wrong = _decimated(mesh, wanted)
    if wrong:
        warn(f"{wrong} vertices of the decimated mesh are on faces that fold or cross")
    if (left := out.mesh.n_vertices) > wanted:
        warn(f"{left} vertices are left, not {wanted}: no other edge can be removed without a fold")
    return out


def _given(mesh: Any) -> SimplexMesh:
    """Return the simplex mesh a caller gave, or the dual of the triangles, also those in a file."""
    if isinstance(mesh, SimplexMesh):
        return mesh
    from simplexmesh.data.convert import as_data

    found = as_data(mesh, "mesh")
    if isinstance(found, SimplexMesh):
        return found
    if hasattr(found, "faces"):
        return dual(found)
    where = f" in {os.path.basename(os.fspath(mesh))}" if isinstance(mesh, str | os.PathLike) else ""
    raise TypeError(f"mesh must be a SimplexMesh or triangles, not the {type(found).__name__}{where}: see reconstruct")


def _decimated(mesh: SimplexMesh, wanted: int) -> tuple[Decimated, int]:
    """Return the mesh with so many vertices, or more when no more can go, and how many are on faces that fold.

    With as many as there are, the mesh is returned as it is.
    """
    if wanted >= mesh.n_vertices:
        return _unchanged(mesh), 0
    fit, out, *_ = made(mesh, wanted, Surface.of(mesh))
    tangled = tangled_vertices(fit.mesh)
    if tangled.any():
        tangled = fit.loosen(tangled)
    return _result(fit.mesh, out, fit.distances()), int(tangled.sum())


def _unchanged(mesh: SimplexMesh) -> Decimated:
    """Return the mesh as it is."""
    return _result(mesh, EditableMesh(mesh).result(), (0.0, 0.0))


def _result(mesh: SimplexMesh, out: Edited, distances: tuple[float, float]) -> Decimated:
    return Decimated(mesh, out.vertex_map, out.face_map, *distances, exceptional_faces(mesh.connectivity))
