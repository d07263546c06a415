"""The operators that change the genus or the number of components: T3, cut along a contour, and T4, join two faces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Indices, Mask
from simplexmesh._base.errors import TopologyError
from simplexmesh._base.named_arrays import joined, taken
from simplexmesh._base.units import common_unit
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.contours import Contour
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.results import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh


@dataclass(frozen=True, eq=False, repr=False)
class Cut(Edited):
    """A mesh after a cut.

    Attributes
    ----------
    faces : tuple of two int
        The new faces that close the left and the right side of the contour.
    separated : bool
        Whether the cut added a component; if not, it reduced the genus by one.
    """

    faces: tuple[int, int]
    separated: bool


@dataclass(frozen=True, eq=False, repr=False)
class Joined(Edited):
    """A mesh after two of its faces were joined.

    Attributes
    ----------
    contour : Contour
        The seam between them; a cut along it is the inverse.
    """

    contour: Contour


def cut(mesh: SimplexMesh, contour: Contour | Sequence[int], *, holes: bool = False) -> Cut:
    """T3 (Delingette, thesis, section 2.6): cut along a contour and close each side by a new face.

    Vertices are kept: those whose third edge is on the left of the contour form one of the new faces, those whose third
    edge is on the right the other. A separating contour divides its component in two; any other reduces the genus by
    one.

    Parameters
    ----------
    mesh : SimplexMesh
        The mesh.
    contour : Contour or sequence of int
        A closed contour on this mesh, or its vertices in order.
    holes : bool
        Make the new faces holes.

    Raises
    ------
    TopologyError
        When the contour is open, bounds a single face, has fewer than three edges on a side, or meets a face twice on
        one side.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ring = sm.torus(14, 6)
    >>> x, y, _ = ring.vertices.T
    >>> around = sm.Contour.through(ring, [x.argmax(), y.argmax(), x.argmin(), y.argmin()])
    >>> sm.cut(ring, around, holes=True).mesh
    SimplexMesh(168 vertices, 84 faces, genus 0, 2 holes)
    """
    checks.instance("mesh", mesh, SimplexMesh)
    line = contour if isinstance(contour, Contour) else Contour(mesh, contour)  # type: ignore[arg-type]
    if not line.closed:
        raise TopologyError(f"contour must be closed to be cut along, not open from {line.vertices[0]} on")
    if line.mesh.connectivity is not mesh.connectivity:
        line = Contour(mesh, line.vertices)
    edit = EditableMesh(mesh)
    left, right = edit.cut(line.darts, holes=holes)
    darts = [int(edit.around(face)[0]) for face in (left, right)]
    out = edit.result()
    faces = out.mesh.connectivity.face.reshape(-1)[darts].tolist()
    separated = out.mesh.n_components > mesh.n_components
    return Cut(out.mesh, out.vertex_map, out.face_map, (faces[0], faces[1]), separated)


def join(mesh: SimplexMesh, *what: Any) -> Joined:
    """T4 (Delingette, thesis, section 2.6): join two faces, whose vertices alternate around a tube of zero length.

    Called `join(mesh, face_a, face_b)`, or `join(mesh_a, mesh_b, face_a, face_b)` for two meshes. Vertices are kept,
    the two faces are removed. Within a component the genus grows by one; two components become one. The vertices of the
    second mesh are numbered after those of the first, in the maps too, and data that both have are kept.

    Raises
    ------
    TopologyError
        When the two faces are the same or adjacent, a third one is adjacent to both, or two faces that would share an
        edge along the seam already share one.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(4)
    >>> handle = sm.join(ball, 0, 100)
    >>> handle.mesh.genus, sm.cut(handle.mesh, handle.contour).mesh.genus
    (1, 0)
    >>> sm.join(ball, ball.moved(ball.vertices + 2), 0, 100).mesh.n_components
    1
    """
    if len(what) == 3:
        other, face_a, face_b = what
        checks.instance("mesh_a", mesh, SimplexMesh), checks.instance("mesh_b", other, SimplexMesh)
        face_b = len(mesh.connectivity.face_sizes) + checks.integer(
            "face_b", face_b, 0, len(other.connectivity.face_sizes) - 1
        )
        checks.integer("face_a", face_a, 0, len(mesh.connectivity.face_sizes) - 1)
        mesh = together(mesh, other)
    elif len(what) == 2:
        face_a, face_b = what
    else:
        forms = "(mesh, face_a, face_b) or (mesh_a, mesh_b, face_a, face_b)"
        raise TypeError(f"join takes {forms}, not {1 + len(what)} arguments")
    edit = EditableMesh(mesh)
    seam = edit.join(face_a, face_b)
    out = edit.result()
    return Joined(out.mesh, out.vertex_map, out.face_map, Contour(out.mesh, seam.onward // 3))


def together(*meshes: SimplexMesh) -> SimplexMesh:
    """Return the disjoint union of meshes, numbered one after the other; data that all of them have are kept."""
    if not meshes:
        raise TypeError("together takes at least one mesh")
    twin, holes, at = [], [], 0
    contours: dict[str, Indices] = {}
    for mesh in meshes:
        c = checks.instance("mesh", mesh, SimplexMesh).connectivity
        if both := sorted(contours.keys() & c.contour_darts.keys()):
            raise ValueError(f"meshes must have contours of different names, but two have one named {both[0]!r}")
        twin.append(c.twin.astype(np.int64) + at)
        holes.append(c.hole_darts.astype(np.int64) + at)
        contours |= {name: darts.astype(np.int64) + at for name, darts in c.contour_darts.items()}
        at += 3 * mesh.n_vertices
    return SimplexMesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        Connectivity(np.concatenate(twin), np.concatenate(holes), contours),
        joined([mesh.data for mesh in meshes]),
        common_unit("meshes", meshes),
    )


def parts(mesh: SimplexMesh) -> tuple[Edited, ...]:
    """Return each connected component as a mesh of its own, with its data and the maps from the whole mesh.

    They come in the order of their smallest vertices; the maps are -1 on the rest of the mesh.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.mesh.operators.cut_join import parts, together
    >>> [part.mesh.genus for part in parts(together(sm.sphere(4), sm.torus(14, 6)))]
    [0, 1]
    """
    c = checks.instance("mesh", mesh, SimplexMesh).connectivity
    return tuple(restricted(mesh, c.components == label) for label in range(c.n_components))


def restricted(mesh: SimplexMesh, inside: Mask) -> Edited:
    """Return the components of a mesh whose vertices are in a mask (n,), with the maps from the whole mesh."""
    c = mesh.connectivity
    first = c.face_darts[c.face_offsets[:-1]]
    number = np.where(inside, np.cumsum(inside) - 1, -1).astype(np.int32)
    twin, holes = c.twin[inside], c.hole_darts[inside[c.hole_darts // 3]]
    contours = {
        name: 3 * number[darts // 3] + darts % 3 for name, darts in c.contour_darts.items() if inside[darts[0] // 3]
    }
    connectivity = Connectivity(3 * number[twin // 3] + twin % 3, 3 * number[holes // 3] + holes % 3, contours)
    kept = inside[first // 3]
    face_map = np.full(len(first), -1, np.int32)
    face_map[kept] = connectivity.face.reshape(-1)[3 * number[first[kept] // 3] + first[kept] % 3]
    part = SimplexMesh(mesh.vertices[inside], connectivity, taken(mesh.data, inside), mesh.unit)
    return Edited(part, checks.frozen(number), checks.frozen(face_map))
