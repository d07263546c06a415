"""Decimation: fewer vertices with the same shape and topology, by greedy edge removal (T1)."""

from __future__ import annotations

from dataclasses import dataclass

from simplexmesh._base import checks
from simplexmesh._base.arrays import Indices32
from simplexmesh._base.errors import counted, warn
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.mesh.decimation.coarsening import Coarsened, coarsened
from simplexmesh.mesh.decimation.comparison import Original, sample_distances
from simplexmesh.mesh.decimation.fitting import SurfaceSamples
from simplexmesh.mesh.decimation.tolerance import coarsened_within
from simplexmesh.mesh.decimation.vertex_bound import checked_vertices
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.regularize import exceptional_faces
from simplexmesh.mesh.operators.results import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh


@dataclass(frozen=True, eq=False, repr=False)
class Decimated(Edited):
    """A decimated mesh.

    Attributes
    ----------
    rms : float
        Rms distance of the given mesh's vertices and face centroids to the new mesh, in its unit.
    largest : float
        Largest of these distances, and of those of its boundary vertices to the new boundary.
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
    exceptions: Indices32


def with_vertices(mesh: SimplexMesh, vertices: int) -> Decimated:
    """Return the mesh with a number of vertices, or more with a warning when no more edges can be removed."""
    wanted = checked_vertices(mesh, vertices)
    if wanted == mesh.n_vertices:
        return _unchanged(mesh)
    samples = SurfaceSamples.of(mesh)
    out = _result(coarsened(mesh, wanted, samples), samples)
    if (left := out.mesh.n_vertices) > wanted:
        warn(f"{left} vertices are left, not {wanted}: no other edge can be removed without a fold")
    return out


def within_tolerance(mesh: SimplexMesh, tolerance: float | None) -> Decimated:
    """Return the mesh with as few vertices as are found within a tolerance, everywhere and either way."""
    original = Original(mesh)
    found = coarsened_within(mesh, original, checks.number("tolerance", tolerance, 0, open_low=True))
    if found is not None:
        return _result(found, original.samples)
    warn(f"no vertex could be removed within a tolerance of {tolerance:g}: the mesh is unchanged")
    return _unchanged(mesh)


def _unchanged(mesh: SimplexMesh) -> Decimated:
    out = EditableMesh(mesh).result()
    return Decimated(mesh, out.vertex_map, out.face_map, 0.0, 0.0, exceptional_faces(mesh.connectivity))


def _result(found: Coarsened, samples: SurfaceSamples) -> Decimated:
    """Return the result, with a warning of tangled vertices, if any."""
    mesh, out = found.fit.mesh, found.out
    if n_tangled := int(tangled_vertices(mesh).sum()):
        subject = counted(n_tangled, "vertex of the decimated mesh is", "vertices of the decimated mesh are")
        warn(f"{subject} on faces that fold or cross")
    exceptions = exceptional_faces(mesh.connectivity)
    return Decimated(mesh, out.vertex_map, out.face_map, *sample_distances(samples, mesh), exceptions)
