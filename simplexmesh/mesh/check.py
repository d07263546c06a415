"""What is wrong with a mesh, in sentences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import dot, norm
from simplexmesh.mesh import face_geometry, geometry
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.self_intersection import self_intersections

Array = NDArray[np.float64]

NOTHING = 1e-9
"""Lengths count as zero below this times the mean edge, areas below its square."""


@dataclass(frozen=True, eq=False)
class Report:
    """The findings of a check; true when nothing is wrong, and printed as sentences.

    Parameters
    ----------
    problems : tuple of str
        One sentence for each kind of problem, with its number and first places.
    where : dict of str to array of int
        The places themselves: "one_sided_edges", "shared_edges" and "flat_edges" edges, "not_finite", "collinear" and
        "inverted" vertices, "flat_faces" and "folded" faces, "crossing" pairs of faces; kinds not found are left out.

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
        """Whether nothing is wrong."""
        return not self.problems

    def __bool__(self) -> bool:
        return self.ok

    def __str__(self) -> str:
        return "\n".join(self.problems) or "nothing wrong"


Finding = tuple[str, str, NDArray[Any]]


def _places(found: NDArray[Any]) -> str:
    """Return the first few places as text."""
    first = ", ".join(str(place) for place in found[:3].tolist())
    return first + (", ..." if len(found) > 3 else "")


def _incomplete(connectivity: Connectivity) -> list[Finding]:
    """Return the edges that break completeness: one face on both sides, or two faces that already share an edge."""
    left, right = connectivity.edge_faces.T.astype(np.int64)
    same = np.flatnonzero(left == right)
    keys = np.minimum(left, right) * len(connectivity.face_sizes) + np.maximum(left, right)
    order = np.argsort(keys, kind="stable")
    again = np.zeros(len(keys), bool)
    again[order[1:]] = np.diff(keys[order]) == 0
    again[same] = False
    return [
        ("one_sided_edges", "edges have the same face on both sides", same),
        ("shared_edges", "edges join two faces that already share another edge", np.flatnonzero(again)),
    ]


def _degenerate(vertices: Array, connectivity: Connectivity) -> list[Finding]:
    """Return the edges without length, the vertices whose neighbors are on one line, and the faces without area."""
    a, b = vertices[connectivity.edge_vertices].transpose(1, 0, 2)
    length = norm(a - b)
    small = NOTHING * float(length.mean())
    _, radius = geometry.circumcircle(vertices, connectivity.neighbors)
    area = face_geometry.face_areas(vertices, connectivity.face_vertices, connectivity.face_offsets)
    flat = ~connectivity.face_is_hole & (area <= NOTHING * float(length.mean()) ** 2)
    return [
        ("flat_edges", "edges have no length", np.flatnonzero(length <= small)),
        ("collinear", "vertices have their neighbors on one line", np.flatnonzero(~(radius * NOTHING < length.mean()))),
        ("flat_faces", "faces have no area", np.flatnonzero(flat)),
    ]


def misoriented(vertices: Array, connectivity: Connectivity) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return (n,) which vertices have a normal against that of their faces, and (f,) which faces are folded.

    A face is folded where triangles of its fan point against the normals of their vertices. Holes are not.
    """
    loops = connectivity.face_vertices, connectivity.face_offsets
    normals = geometry.normals(vertices, connectivity.neighbors)
    vectors = np.add.reduceat(face_geometry.fan_vectors(vertices, *loops), loops[1][:-1], axis=0)
    vectors[connectivity.face_is_hole] = 0
    around = vectors[connectivity.face].sum(axis=1)
    folded = (face_geometry.face_inversions(vertices, normals, *loops) > 0) & ~connectivity.face_is_hole
    return np.asarray(dot(normals, around) < 0), np.asarray(folded)


def _misoriented(vertices: Array, connectivity: Connectivity) -> list[Finding]:
    """Return the vertices whose normal points against their faces, and the faces folded against their vertices."""
    inverted, folded = misoriented(vertices, connectivity)
    return [
        ("inverted", "vertices have a normal against that of their faces", np.flatnonzero(inverted)),
        ("folded", "faces have triangles that point against the normals of their vertices", np.flatnonzero(folded)),
    ]


def check(vertices: Array, connectivity: Connectivity, *, crossings: bool = False) -> Report:
    """Return what is wrong with a mesh: completeness, numbers, degenerate geometry, orientation, self-intersections.

    Parameters
    ----------
    vertices : (n, 3) array of float
        Positions; NaN and infinite ones are reported, and then nothing geometric is.
    connectivity : Connectivity
        What is glued to what.
    crossings : bool
        Also look for faces that cross.

    Returns
    -------
    Report
        True when nothing is wrong.

    References
    ----------
    Completeness: H. Delingette, thesis, 1994, section 2.1.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> ball = sphere(2)
    >>> print(check(-ball.vertices, ball.connectivity))
    the mesh is inside out: it encloses a volume of -3.76601
    """
    findings = _incomplete(connectivity)
    wrong = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    findings.append(("not_finite", "vertices are not finite", wrong))
    outside_in = ""
    if not len(wrong):
        volume = face_geometry.enclosed_volume(vertices, connectivity.face_vertices, connectivity.face_offsets)
        if volume < 0 and not connectivity.n_holes:
            outside_in = f"the mesh is inside out: it encloses a volume of {volume:g}"
        parts: list[Callable[[Array, Connectivity], list[Finding]]] = [_degenerate, _misoriented]
        findings += [finding for part in parts for finding in part(vertices, connectivity)]
        if crossings:
            findings.append(("crossing", "pairs of faces cross", self_intersections(vertices, connectivity)))
    problems = [f"{len(found)} {what}: {_places(found)}" for _, what, found in findings if len(found)]
    where = {kind: found for kind, _, found in findings if len(found)}
    return Report(tuple([outside_in] * bool(outside_in) + problems), where)
