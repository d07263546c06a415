"""The genus-preserving operators T1, T2, T5, T6 and T7 as single edits of an `EditableMesh`: mesh in, new mesh out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh.operators import _kernels_edit as kernels
from simplexmesh.mesh.operators.editable_mesh import EditableMesh, edge_fractions
from simplexmesh.mesh.operators.results import Batch, Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh

Edge = int | Sequence[int]


def remove_edge(mesh: SimplexMesh, edge: Edge) -> Edited:
    """T1 (Delingette, thesis, section 2.6): remove an edge and its two ends, merging the faces on its two sides.

    Two vertices, three edges and one face fewer; the two opposite faces, those at the ends, lose a vertex each. A face
    beside a hole merges into the hole, and two holes into one.

    Parameters
    ----------
    mesh : SimplexMesh
        The mesh.
    edge : int or pair of int
        A dart, or the two ends.

    Returns
    -------
    Edited
        The new mesh, and the new numbers of vertices and faces.

    Raises
    ------
    TopologyError
        When an opposite face is a triangle, or some other face is adjacent to both sides.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(4)
    >>> after = sm.remove_edge(ball, 0)
    >>> after.mesh.n_vertices - ball.n_vertices, after.mesh.n_faces - ball.n_faces
    (-2, -1)
    """
    edit = EditableMesh(mesh)
    return _edited_at_edge(edit, edge, edit.remove_edges, "removed")


def insert_edge(
    mesh: SimplexMesh, edge: Edge, other: Edge, *, at: Sequence[float] = (0.5, 0.5), face: int | None = None
) -> Edited:
    """T2 (Delingette, thesis, section 2.6): divide a face by an edge between a new vertex on each of two of its edges.

    Two vertices, three edges and one face more; the new vertices are the last two, their positions and floating-point
    data interpolated along the edges. Two edges that meet in a vertex cut it off by a triangle. A hole is divided into
    two holes. `remove_edge` of the new edge is the inverse.

    Parameters
    ----------
    mesh : SimplexMesh
        The mesh.
    edge, other : int or pair of int
        Two edges of one face, each by a dart or its two ends.
    at : pair of float
        Position on each edge, as a fraction of its length from the end given first; in (0, 1), one number for both.
    face : int, optional
        The face to divide, as a check: the two edges have only one in common.

    Raises
    ------
    TopologyError
        When the edges are the same, or have no face in common.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(4)
    >>> a, b, c, d, *_ = ball.faces[0]
    >>> sm.insert_edge(ball, (a, b), (c, d)).mesh
    SimplexMesh(322 vertices, 163 faces, genus 0, 0 holes)
    """
    edit = EditableMesh(mesh)
    twin = mesh.connectivity.twin.reshape(-1)
    darts = edit.dart("edge", edge), edit.dart("other", other)
    if face is not None:
        edit.face(face)
    fractions = edge_fractions(at, 1)[0].tolist()
    pairs = [(one, two) for one in (darts[0], int(twin[darts[0]])) for two in (darts[1], int(twin[darts[1]]))]
    common = [pair for pair in pairs if edit.faces_beside(pair[0])[0] == edit.faces_beside(pair[1])[0]]
    names = " and ".join(_edge_name(edit, dart) for dart in darts)
    if darts[0] in (darts[1], twin[darts[1]]):
        raise TopologyError(f"edges {names} are the same; an edge is inserted between two different ones")
    if not common or (face is not None and edit.faces_beside(common[0][0])[0] != face):
        where = "have no face in common" if face is None else f"are not both on face {face}"
        raise TopologyError(f"edges {names} {where}")
    along = [at if dart == given else 1 - at for at, dart, given in zip(fractions, common[0], darts, strict=True)]
    if not edit.insert_edges(common[0][:1], common[0][1:], [along]).done[0]:
        raise TopologyError(f"edges {names} are on one contour, which an edge between them would make touch itself")
    return edit.result()


def swap_edge(mesh: SimplexMesh, edge: Edge) -> Edited:
    """T7 (Delingette, thesis, section 2.6): swap an edge, which then separates the two faces that were at its ends.

    The adjacent faces lose a vertex each, the opposite ones gain one; vertices are kept. Position and floating-point
    data of each end become the mean of both ends and of its two other neighbors after the swap.

    Raises
    ------
    TopologyError
        When an adjacent face is a triangle, or the opposite faces are the same or already share an edge.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sorted({len(face) for face in sm.swap_edge(sm.torus(14, 6), 0).mesh.faces})
    [5, 6, 7]
    """
    edit = EditableMesh(mesh)
    return _edited_at_edge(edit, edge, edit.swap_edges, "swapped")


def remove_face(mesh: SimplexMesh, face: int) -> Edited:
    """T5 (Delingette, thesis, section 2.6): merge a face with all its neighbors, by T1 on its edges.

    For a face of m vertices, 2 m vertices, 3 m edges and m faces fewer. On the middle face of `refine_face` it is the
    inverse.

    Raises
    ------
    TopologyError
        When a T1 is illegal, or the face or a neighbor is a hole.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(4)
    >>> sm.remove_face(ball, 5).mesh
    SimplexMesh(308 vertices, 156 faces, genus 0, 0 holes)
    """
    edit = EditableMesh(mesh)
    return _edited_at_face(edit, face, edit.remove_faces, "removed")


def refine_face(mesh: SimplexMesh, face: int) -> Edited:
    """T6 (Delingette, thesis, section 2.6): replace a face by a smaller one and a ring of pentagons around it, by T2.

    For a face of m vertices, 2 m vertices, 3 m edges and m faces more; each neighbor gains a vertex. The face map sends
    the refined face to the one in the middle, again of m vertices.

    Raises
    ------
    TopologyError
        When the face is a hole.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sm.refine_face(sm.sphere(4), 5).mesh
    SimplexMesh(332 vertices, 168 faces, genus 0, 0 holes)
    """
    edit = EditableMesh(mesh)
    return _edited_at_face(edit, face, edit.refine_faces, "refined")


def _edge_name(edit: EditableMesh, dart: int) -> str:
    """Return the name of an edge in messages, its two ends."""
    return "-".join(str(end) for end in edit.ends(dart))


def _edited_at_edge(edit: EditableMesh, edge: Edge, apply: Callable[[list[int]], Batch], done: str) -> Edited:
    """Return the mesh after an edit of one edge, or raise with the reason why it was refused."""
    dart = edit.dart("edge", edge)
    name, (left, right) = _edge_name(edit, dart), edit.faces_beside(dart)
    batch = apply([dart])
    status, witness = int(batch.status[0]), int(batch.witness[0])
    reasons = {
        kernels.OPPOSITE_TRIANGLE: f"face {witness}, opposite to it, is a triangle",
        kernels.SHARED: f"face {witness} is adjacent to both its sides, faces {left} and {right}",
        kernels.BESIDE_TRIANGLE: f"face {witness}, on one side of it, is a triangle",
        kernels.SAME_OPPOSITE: f"the faces opposite to it are the same, face {witness}",
        kernels.NEIGHBORS: f"the faces opposite to it, one of them face {witness}, already share an edge",
        kernels.ON_CONTOUR: "it would break a contour",
    }
    if status != kernels.DONE:
        raise TopologyError(f"edge {name} cannot be {done}: {reasons[status]}")
    return edit.result()


def _edited_at_face(edit: EditableMesh, face: int, apply: Callable[[list[int]], Batch], done: str) -> Edited:
    """Return the mesh after an edit of one face, or raise with the reason why it was refused."""
    batch = apply([edit.face(face)])
    status, witness = int(batch.status[0]), int(batch.witness[0])
    reasons = {
        kernels.HOLE: "it is a hole",
        kernels.BESIDE_HOLE: f"its neighbor, face {witness}, is a hole",
        kernels.OPPOSITE_TRIANGLE: f"face {witness}, at the end of an edge to be removed, is a triangle",
        kernels.SHARED: f"face {witness} is adjacent to both sides of an edge to be removed",
        kernels.ON_CONTOUR: "it would break a contour",
    }
    if status != kernels.DONE:
        raise TopologyError(f"face {face} cannot be {done}: {reasons[status]}")
    return edit.result()
