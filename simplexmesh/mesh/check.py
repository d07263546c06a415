"""Validity checks: completeness (thesis, section 2.1), degenerate geometry, orientation, crossings and tangles."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Indices, Mask
from simplexmesh._base.errors import counted
from simplexmesh._base.vectors import dot, norm, normalized
from simplexmesh.mesh import face_geometry, geometry
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.triangles.self_intersection import self_intersections

if TYPE_CHECKING:
    from simplexmesh.mesh.simplex_mesh import SimplexMesh

DEGENERATE = 1e-9
"""Lengths below this times the mean edge length count as zero, areas below this times its square."""


@dataclass(frozen=True, eq=False)
class Report:
    """The defects found by a check; true when there are none, printed as sentences.

    Parameters
    ----------
    problems : tuple of str
        One sentence for each kind of defect, with their number and the first few indices.
    where : dict of str to array of int
        All indices by kind: edges for "one_sided_edges", "shared_edges" and "flat_edges", vertices for "collinear" and
        "inverted", faces for "flat_faces" and "folded", pairs of faces for "crossing".

    Examples
    --------
    >>> bool(Report()), print(Report())
    nothing wrong
    (True, None)
    """

    problems: tuple[str, ...] = ()
    where: dict[str, NDArray[Any]] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether no defect was found."""
        return not self.problems

    def __bool__(self) -> bool:
        return self.ok

    def __str__(self) -> str:
        return "\n".join(self.problems) or "nothing wrong"


SENTENCES = {
    "one_sided_edges": ("edge has", "edges have", "the same face on both sides"),
    "shared_edges": ("edge joins", "edges join", "two faces that already share another edge"),
    "flat_edges": ("edge has", "edges have", "no length"),
    "collinear": ("vertex has", "vertices have", "collinear neighbors"),
    "flat_faces": ("face has", "faces have", "no area"),
    "inverted": ("vertex has", "vertices have", "a normal opposite to that of the adjacent faces"),
    "folded": ("face has", "faces have", "triangles that point against their vertex normals"),
    "crossing": ("pair of faces", "pairs of faces", "cross"),
}
"""For each kind of defect, the subject in singular and in plural, and the rest of the sentence."""

Defects = dict[str, NDArray[Any]]


def _incomplete(connectivity: Connectivity) -> Defects:
    """Return the edges that violate completeness: one face on both sides, or two faces that already share an edge."""
    left, right = connectivity.edge_faces.T.astype(np.int64)
    same = np.flatnonzero(left == right)
    keys = np.minimum(left, right) * len(connectivity.face_sizes) + np.maximum(left, right)
    order = np.argsort(keys, kind="stable")
    repeated = np.zeros(len(keys), bool)
    repeated[order[1:]] = np.diff(keys[order]) == 0
    repeated[same] = False
    return {"one_sided_edges": same, "shared_edges": np.flatnonzero(repeated)}


def degenerate(mesh: SimplexMesh) -> Defects:
    """Return the edges of zero length, the vertices with collinear neighbors, and the faces of zero area."""
    c = mesh.connectivity
    a, b = mesh.vertices[c.edge_vertices].transpose(1, 0, 2)
    length = norm(a - b)
    mean = float(length.mean())
    _, radius = geometry.circumcircle(mesh.vertices, c.neighbors)
    flat = ~c.face_is_hole & (mesh.face_areas <= DEGENERATE * mean**2)
    return {
        "flat_edges": np.flatnonzero(length <= DEGENERATE * mean),
        "collinear": np.flatnonzero(~(radius * DEGENERATE < mean)),
        "flat_faces": np.flatnonzero(flat),
    }


def misoriented(mesh: SimplexMesh) -> tuple[Mask, Mask]:
    """Return masks of inverted vertices (n,), whose normal opposes their faces, and of folded faces (f,).

    Vertices on creases have no normal of their own: there the normals of the faces count.
    """
    c = mesh.connectivity
    loops = c.face_vertices, c.face_offsets
    vectors = face_geometry.fan_vectors(mesh.vertices, *loops)
    of_face = np.add.reduceat(vectors, loops[1][:-1], axis=0)
    of_face[c.face_is_hole] = 0
    face_sum = of_face[c.face].sum(axis=1)
    inverted: Mask = np.asarray(dot(mesh.normals, face_sum) < 0)
    at_corners = mesh.normals[loops[0]]
    if (creased := creased_vertices(mesh)) is not None:
        inverted &= ~creased
        sharp = creased[loops[0]]
        at_corners[sharp] = normalized(of_face)[np.repeat(np.arange(len(of_face)), np.diff(loops[1]))[sharp]]
    folded = (face_geometry.face_inversions(vectors, at_corners, *loops) > 0) & ~c.face_is_hole
    return inverted, np.asarray(folded)


def creased_vertices(mesh: SimplexMesh) -> Mask | None:
    """Return the vertices (n,) on creases, those of data array `crease`; None if the mesh has none."""
    marks = mesh.data.get("crease")
    return None if marks is None else np.asarray(marks, bool)


def check(mesh: SimplexMesh, *, crossings: bool = False) -> Report:
    """Return the defects of a mesh."""
    problems = []
    if mesh.volume < 0 and not mesh.n_holes:
        problems.append(f"the mesh is inside out: it encloses a volume of {mesh.volume:g}")
    inverted, folded = misoriented(mesh)
    found = _incomplete(mesh.connectivity) | degenerate(mesh)
    found |= {"inverted": np.flatnonzero(inverted), "folded": np.flatnonzero(folded)}
    if crossings:
        found["crossing"] = self_intersections(mesh.vertices, mesh.connectivity)
    where = {kind: indices for kind, indices in found.items() if len(indices)}
    for kind, indices in where.items():
        one, several, what = SENTENCES[kind]
        first = ", ".join(map(str, indices[:3].tolist())) + (", ..." if len(indices) > 3 else "")
        problems.append(f"{counted(len(indices), one, several)} {what}: {first}")
    return Report(tuple(problems), where)


def tangled_vertices(mesh: SimplexMesh) -> Mask:
    """Return a mask (n,) of the vertices inverted, degenerate, or on a face folded, flat or crossing another."""
    return tangled_with(mesh, self_intersections(mesh.vertices, mesh.connectivity))


def tangled_with(mesh: SimplexMesh, pairs: Indices) -> Mask:
    """Return the tangled vertices (n,), given the pairs (m, 2) of faces that cross."""
    c, found = mesh.connectivity, degenerate(mesh)
    faces = np.zeros(len(c.face_sizes), bool)
    faces[found["flat_faces"]] = True
    faces[pairs.ravel()] = True
    out = folded_vertices(mesh) | faces[c.vertex_faces].any(axis=1)
    out[found["collinear"]] = out[c.edge_vertices[found["flat_edges"]].ravel()] = True
    return np.asarray(out)


def folded_vertices(mesh: SimplexMesh) -> Mask:
    """Return a mask (n,) of the vertices inverted or on folded faces: a fast test that finds most tangles."""
    inverted, folded = misoriented(mesh)
    return np.asarray(inverted | folded[mesh.connectivity.vertex_faces].any(axis=1))
