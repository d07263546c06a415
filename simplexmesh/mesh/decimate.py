"""Decimation: fewer vertices with the same shape and topology, by greedy edge removal (T1)."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.errors import counted, warn
from simplexmesh.mesh.coarsening import coarsened
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.fitting import SurfaceSamples, tangled_vertices
from simplexmesh.mesh.regularize import exceptional_faces
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.tolerance import decimated_within
from simplexmesh.mesh.vertex_bound import checked_vertices

Indices = NDArray[np.int32]


@dataclass(frozen=True, eq=False, repr=False)
class Decimated(Edited):
    """A decimated mesh.

    Attributes
    ----------
    rms, largest : float
        Rms and largest distance of the given mesh's vertices and face centroids to the new mesh, in its unit; the
        largest includes the distances of its boundary vertices to the new boundary.
    exceptions : (m,) array of int
        The faces of the new mesh, holes excluded, that have fewer than five or more than seven vertices.

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

    Edges are removed (T1), the cheapest first. Each face represents a region of the surface, and the cost of an edge is
    the increase in energy when the regions of its two faces merge: squared distance to the best-fitting plane, spread
    of the normals, and extent. So faces end at creases, and are elongated where the surface bends in one direction
    only. An edge is kept if a triangle of the dual would turn over or become thin. T7 then regularizes the face sizes,
    and a least-squares fit moves the vertices so that the faces are closest to the surface, each only as far as no
    face folds or crosses another more than before.

    Genus, components and holes are kept. Faces never merge with holes; merging two on a boundary costs the squared
    distance of their parts of it from a line.

    Parameters
    ----------
    mesh : SimplexMesh, TriangleMesh, PyVista or trimesh object, or path
        The mesh; for triangles, their dual: vertices in `vertex_map` and in distances are then the triangles and their
        centroids, see `dual`.
    vertices : int, optional
        Number of vertices to keep: even, as it always is in a simplex mesh.
    tolerance : float, optional
        The largest distance allowed between the two surfaces, in both directions, and between their boundaries, in the
        unit of the mesh. It holds everywhere, not only at samples: where it is exceeded, vertices are displaced, and if
        that is not enough, decimation is repeated with smaller faces there. A mesh without folds stays so. Give this or
        `vertices`.

    Returns
    -------
    Decimated
        The mesh, the maps, and its distance from the given mesh. Vertices that are kept keep their data; at the ends of
        edges swapped by T7, floating-point data are averaged as in `swap_edge`.

    Raises
    ------
    TypeError
        When neither or both of `vertices` and `tolerance` are given, or `mesh` is not a surface.
    ValueError
        When `vertices` is odd or larger than the number there is, or `tolerance` is not above 0.
    TopologyError
        When the mesh is not complete, or `vertices` is below the minimum for its genus, holes and components.

    Warns
    -----
    SimplexMeshWarning
        When more vertices had to be kept, when none could be removed within the tolerance, or when some are on faces
        that fold or cross: because those of the given mesh do, or because there are too few vertices for its thin
        parts.

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
    mesh = _as_simplex_mesh(mesh)
    _check.size("mesh", mesh.bounds)
    if tolerance is not None:
        found = decimated_within(mesh, _check.number("tolerance", tolerance, 0, open_low=True))
        if found is None:
            warn(f"no vertex could be removed within a tolerance of {tolerance:g}: the mesh is unchanged")
            return _unchanged(mesh)
        _report_tangled(int(tangled_vertices(found[0]).sum()))
        return _result(*found)
    wanted = checked_vertices(mesh, vertices)
    out, n_tangled = _decimated(mesh, wanted)
    _report_tangled(n_tangled)
    if (left := out.mesh.n_vertices) > wanted:
        warn(f"{left} vertices are left, not {wanted}: no other edge can be removed without a fold")
    return out


def _report_tangled(n_tangled: int) -> None:
    """Warn of tangled vertices of the decimated mesh, if any."""
    if n_tangled:
        subject = counted(n_tangled, "vertex of the decimated mesh is", "vertices of the decimated mesh are")
        warn(f"{subject} on faces that fold or cross")


def _as_simplex_mesh(mesh: Any) -> SimplexMesh:
    """Return a simplex mesh as it is, or the dual of triangles given as an object or a file."""
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
    """Return the mesh with `wanted` vertices, or more when no more can be removed, and the number of tangled ones."""
    if wanted >= mesh.n_vertices:
        return _unchanged(mesh), 0
    fit, out, *_ = coarsened(mesh, wanted, SurfaceSamples.of(mesh))
    tangled = tangled_vertices(fit.mesh)
    if tangled.any():
        tangled = fit.relax_tangled(tangled)
    return _result(fit.mesh, out, fit.distances()), int(tangled.sum())


def _unchanged(mesh: SimplexMesh) -> Decimated:
    """Return the mesh as it is, as a result of decimation."""
    return _result(mesh, EditableMesh(mesh).result(), (0.0, 0.0))


def _result(mesh: SimplexMesh, out: Edited, distances: tuple[float, float]) -> Decimated:
    return Decimated(mesh, out.vertex_map, out.face_map, *distances, exceptional_faces(mesh.connectivity))
