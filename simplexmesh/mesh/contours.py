"""Contours: simple paths along the edges of a mesh, around holes or sets of faces, or through given vertices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Indices, Mask
from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.paths import first_repeated, refusal_of_path

if TYPE_CHECKING:
    from simplexmesh.mesh.simplex_mesh import SimplexMesh


@dataclass(frozen=True, eq=False, repr=False)
class Contour:
    """A simple path along the edges of a mesh, closed or open.

    Consecutive vertices are neighbors, no vertex is repeated, and none has all three neighbors on the contour. It is
    directed; left and right are as seen from outside the surface. A mesh keeps contours through edits: see
    `SimplexMesh.with_contours`.

    Parameters
    ----------
    mesh : SimplexMesh
        The mesh it is on.
    vertices : (k,) array of int
        Its vertices in order, the first one not repeated at the end.
    closed : bool
        Whether the last vertex is joined to the first.

    Raises
    ------
    TopologyError
        When a condition is violated; the message names it and a vertex.

    References
    ----------
    H. Delingette, thesis, 1994, section 2.5.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import cylinder
    >>> tube = cylinder(9, 4)
    >>> rims = Contour.of_holes(tube)
    >>> [len(rim) for rim in rims], rims[0].is_face, rims[0].separates
    ([9, 9], True, True)
    """

    mesh: SimplexMesh
    vertices: Indices
    closed: bool = True

    def __post_init__(self) -> None:
        c = _connectivity(self.mesh)
        vertices = checks.frozen(checks.indices("contour", self.vertices, (None,), c.n_vertices))
        object.__setattr__(self, "vertices", vertices)
        closed = checks.flag("closed", self.closed)
        if reason := refusal_of_path(vertices, c.neighbors[vertices], closed=closed):
            raise TopologyError(f"contour {reason}")

    def __repr__(self) -> str:
        return f"Contour({len(self)} vertices{'' if self.closed else ', open'})"

    def __len__(self) -> int:
        return len(self.vertices)

    # ---- constructors

    @classmethod
    def of_face(cls, mesh: SimplexMesh, face: int) -> Contour:
        """Return the boundary of a face or hole, with the face on its left."""
        c = _connectivity(mesh)
        f = checks.integer("face", face, 0, len(c.face_sizes) - 1)
        return cls(mesh, c.face_vertices[c.face_offsets[f] : c.face_offsets[f + 1]].astype(np.int64))

    @classmethod
    def of_holes(cls, mesh: SimplexMesh) -> tuple[Contour, ...]:
        """Return the boundary of each hole, with the hole on its left."""
        c = _connectivity(mesh)
        return tuple(cls.of_face(mesh, int(f)) for f in np.flatnonzero(c.face_is_hole))

    @classmethod
    def of_faces(cls, mesh: SimplexMesh, faces: ArrayLike) -> tuple[Contour, ...]:
        """Return the boundary contours of a set of faces, with the set on their left.

        Parameters
        ----------
        mesh : SimplexMesh
            The mesh.
        faces : (m,) array of int or (f,) array of bool
            The faces, holes included, by number or by mask.

        Examples
        --------
        >>> from simplexmesh.mesh.shapes import sphere
        >>> ball = sphere(4)
        >>> Contour.of_faces(ball, ball.connectivity.vertex_faces[0])
        (Contour(11 vertices),)
        """
        c = _connectivity(mesh)
        inside = np.zeros(len(c.face_sizes), bool)
        inside[checks.selection("faces", faces, len(inside))] = True
        if not inside.any():
            raise ValueError("faces must be at least one, not none")
        return tuple(cls(mesh, loop) for loop in _boundary_loops(c, inside))

    @classmethod
    def through(cls, mesh: SimplexMesh, at: ArrayLike, *, closed: bool = True) -> Contour:
        """Return the contour through given vertices in order, joined by shortest paths that do not touch each other.

        Parameters
        ----------
        mesh : SimplexMesh
            The mesh.
        at : (m,) array of int
            Two or more different vertices.
        closed : bool
            Whether to return from the last to the first; else these are the ends of an open contour.

        Raises
        ------
        TopologyError
            When there is no such path.

        Examples
        --------
        >>> from simplexmesh.mesh.shapes import torus
        >>> ring = torus(14, 6)
        >>> x, y, _ = ring.vertices.T
        >>> Contour.through(ring, [x.argmax(), y.argmax(), x.argmin(), y.argmin()]).separates
        False
        >>> Contour.through(ring, [x.argmax(), y.argmax()], closed=False)
        Contour(8 vertices, open)
        """
        n_vertices = _connectivity(mesh).n_vertices
        stops = checks.indices("at", at, (None,), n_vertices)
        if len(stops) < 2 or first_repeated(stops) >= 0:
            raise ValueError(f"at must be at least 2 different vertices, not {stops.tolist()}")
        return cls(mesh, _shortest_path(mesh, stops, closed=checks.flag("closed", closed)), closed)

    # ---- properties

    @property
    def steps(self) -> Indices:
        """(k, 2) each vertex and the next one; of an open contour (k - 1, 2)."""
        return np.stack([self.vertices, np.roll(self.vertices, -1)], axis=1)[: None if self.closed else -1]

    @cached_property
    def darts(self) -> Indices:
        """(k,) the dart from each vertex to the next one; of an open contour (k - 1,)."""
        tails, heads = self.steps.T
        return 3 * tails + (self.mesh.neighbors[tails] == heads[:, None]).argmax(axis=1)

    @property
    def length(self) -> float:
        """Total length of the edges, in the unit of the mesh."""
        ends = self.mesh.vertices[self.steps]
        return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())

    @property
    def is_face(self) -> bool:
        """Whether it bounds a single face, on either side; a cut along such a contour is impossible."""
        if not self.closed:
            return False
        face, twin = self.mesh.connectivity.face.reshape(-1), self.mesh.connectivity.twin.reshape(-1)
        return bool(np.ptp(face[self.darts]) == 0 or np.ptp(face[twin[self.darts]]) == 0)

    @cached_property
    def left_faces(self) -> Mask:
        """(f,) mask of the faces, holes included, that are connected to its left side without crossing it."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        c = self.mesh.connectivity
        crossed = np.zeros(c.twin.size, bool)
        crossed[self.darts] = crossed[c.twin.reshape(-1)[self.darts]] = True
        beside = c.edge_faces[~crossed[c.edge_darts[:, 0]]]
        n = len(c.face_sizes)
        graph = coo_array((np.ones(len(beside), bool), beside.T), shape=(n, n))
        _, label = connected_components(graph, directed=False)
        out: Mask = label == label[c.face.reshape(-1)[self.darts[0]]]
        out.setflags(write=False)
        return out

    @property
    def separates(self) -> bool:
        """Whether it divides its component of the mesh in two; if not, it is open, or a cut along it opens a handle."""
        c = self.mesh.connectivity
        return not self.left_faces[c.face.reshape(-1)[c.twin.reshape(-1)[self.darts[0]]]]

    def reversed(self) -> Contour:
        """Return the contour in the opposite direction."""
        return Contour(self.mesh, self.vertices[::-1], self.closed)


def _connectivity(mesh: SimplexMesh) -> Connectivity:
    """Return the connectivity of what must be a simplex mesh."""
    if not isinstance(c := getattr(mesh, "connectivity", None), Connectivity):
        raise TypeError(f"mesh must be a SimplexMesh, not {checks.type_name(mesh)}")
    return c


def _boundary_loops(connectivity: Connectivity, inside: Mask) -> list[Indices]:
    """Return the boundary loops of a set of faces, the set on their left; disjoint, as vertices have three faces."""
    twin, face = connectivity.twin.reshape(-1), connectivity.face.reshape(-1)
    border = np.flatnonzero(inside[face] & ~inside[face[twin]])
    number = np.full(twin.size, -1)
    number[border] = np.arange(len(border))
    back = twin[border].astype(np.int64)
    ahead = 3 * (back // 3) + (back + 2) % 3  # along the face on the left, if that edge is on the border
    ahead = np.where(number[ahead] >= 0, ahead, 3 * (back // 3) + (back + 1) % 3)
    following = number[ahead]
    seen = np.zeros(len(border), bool)
    loops = []
    for start in range(len(border)):
        loop = []
        at = start
        while not seen[at]:
            seen[at] = True
            loop.append(border[at] // 3)
            at = following[at]
        if loop:
            loops.append(np.array(loop))
    return loops


def _shortest_path(mesh: SimplexMesh, stops: Indices, *, closed: bool) -> Indices:
    """Return the vertices of a path through `stops`, each leg the shortest that avoids the earlier ones."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    c = mesh.connectivity
    a, b = c.edge_vertices.T.astype(np.int64)
    length = np.linalg.norm(mesh.vertices[a] - mesh.vertices[b], axis=1)
    free = np.ones(c.n_vertices, bool)
    free[stops] = False
    path: list[int] = []
    for start, end in np.stack([stops, np.roll(stops, -1)], axis=1)[: None if closed else -1].tolist():
        usable = free.copy()
        usable[[start, end]] = True
        legal = usable[a] & usable[b]
        if len(stops) == 2 and path:  # the second leg must not reuse an edge between the two
            legal &= ~((np.minimum(a, b) == min(start, end)) & (np.maximum(a, b) == max(start, end)))
        graph = csr_array((length[legal], (a[legal], b[legal])), shape=(c.n_vertices, c.n_vertices))
        _, predecessor = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
        if predecessor[end] < 0:
            raise TopologyError(f"no path from vertex {start} to vertex {end} avoids the rest of the contour")
        leg = [end]
        while leg[-1] != start:
            leg.append(int(predecessor[leg[-1]]))
        path += leg[:0:-1]
        free[leg] = False
        free[c.neighbors[leg[1:-1]]] = False  # otherwise the path could run alongside itself around a face
    return np.array(path if closed else [*path, int(stops[-1])])
