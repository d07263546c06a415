"""A triangulated surface, as measured or as read from a file."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check, _vec
from simplexmesh.data.points import PointCloud, affine
from simplexmesh.data.welding import are_proper, distinct_positions, report_welding
from simplexmesh.errors import warn

if TYPE_CHECKING:
    from simplexmesh.mesh.surface_topology import Topology

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class TriangleMesh:
    """A surface of triangles.

    Parameters
    ----------
    vertices : (v, 3) array of float
        Positions, finite, at least four.
    faces : (f, 3) array of int
        Three different vertices each, counter-clockwise seen from outside.

    Raises
    ------
    ValueError
        Wrong shape, fewer than four vertices, no face, NaN or infinite values, an index outside.
    TypeError
        Not numbers, or faces that are not whole numbers.

    Warns
    -----
    SimplexMeshWarning
        Faces that name a vertex twice are removed.

    Examples
    --------
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> tetrahedron = TriangleMesh(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    >>> tetrahedron
    TriangleMesh(4 vertices, 4 faces, closed)
    >>> round(tetrahedron.volume, 6)
    0.166667
    """

    vertices: Array
    faces: Indices

    def __post_init__(self) -> None:
        vertices = _check.array("vertices", self.vertices, (None, 3))
        if len(vertices) < 4:
            raise ValueError(f"vertices must be at least 4, not {len(vertices)}")
        if np.ndim(self.faces) == 2 and not len(self.faces):
            raise ValueError("faces must be at least one, not none")
        faces = _check.indices("faces", self.faces, (None, 3), len(vertices))
        whole = are_proper(faces)
        if not whole.all():
            gone = int(np.count_nonzero(~whole))
            warn(f"removed {gone:,} degenerate faces of {len(faces):,}")
            faces = faces[whole]
            if not len(faces):
                raise ValueError("faces must be at least one with three different vertices, not none")
        object.__setattr__(self, "vertices", _check.frozen(vertices))
        object.__setattr__(self, "faces", _check.frozen(faces))

    def __repr__(self) -> str:
        kind = "closed" if self.is_closed else "open"
        return f"TriangleMesh({len(self.vertices)} vertices, {len(self.faces)} faces, {kind})"

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return len(self.vertices)

    @property
    def n_faces(self) -> int:
        """Number of triangles."""
        return len(self.faces)

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) array of float: lowest and highest coordinates."""
        return _check.frozen(np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)]))

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the bounding box."""
        low, high = self.bounds
        return float(np.linalg.norm(high - low))

    @cached_property
    def face_vectors(self) -> Array:
        """(f, 3) array of float: outward normals of the faces, as long as twice their areas."""
        a, b, c = (self.vertices[self.faces[:, j]] for j in range(3))
        return _check.frozen(_vec.cross(b - a, c - a))

    @property
    def area(self) -> float:
        """Area of the surface."""
        return float(_vec.norm(self.face_vectors).sum() / 2)

    @property
    def volume(self) -> float:
        """Signed volume enclosed (divergence theorem); positive when the faces look outward. Closed surfaces only."""
        center = self.vertices.mean(axis=0)
        return float(_vec.dot(self.vertices[self.faces[:, 0]] - center, self.face_vectors).sum() / 6)

    @cached_property
    def vertex_normals(self) -> Array:
        """(v, 3) array of float: unit normals, means of the faces around weighted by area; zero without faces."""
        total = np.zeros_like(self.vertices)
        for j in range(3):
            np.add.at(total, self.faces[:, j], self.face_vectors)
        return _check.frozen(_vec.normalized(total))

    @cached_property
    def is_closed(self) -> bool:
        """Whether every edge has as many faces on one side as on the other: no boundary."""
        ends = self.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        sign = np.where(ends[:, 0] < ends[:, 1], 1, -1)
        key = ends.min(axis=1) * len(self.vertices) + ends.max(axis=1)
        _, edge = np.unique(key, return_inverse=True)
        return not np.bincount(edge.reshape(-1), weights=sign).any()

    @cached_property
    def topology(self) -> Topology:
        """Components, borders, handles and Euler number, whichever way the faces are turned.

        Raises
        ------
        TopologyError
            Where more than two faces share an edge, or the surface has one side only.

        Examples
        --------
        >>> import simplexmesh as sm
        >>> sm.torus(12, 6).triangulated().topology
        Topology(n_components=1, n_borders=0, genus=1, euler=0)
        """
        from simplexmesh.mesh.surface_topology import surface_topology

        return surface_topology(self.faces)

    @property
    def n_components(self) -> int:
        """Number of connected pieces; see `topology`."""
        return self.topology.n_components

    @property
    def n_borders(self) -> int:
        """Number of loops of border edges; see `topology`."""
        return self.topology.n_borders

    @property
    def genus(self) -> int:
        """Number of handles; see `topology`."""
        return self.topology.genus

    def oriented(self, *, outward: bool = True) -> TriangleMesh:
        """Return the surface with its faces turned alike, without second copies of a face.

        Of each component the fewer faces are turned, then closed components that enclose a negative volume as a
        whole.

        Parameters
        ----------
        outward : bool
            Turn closed components outward; without it the wall of a cavity keeps looking into the cavity.

        Returns
        -------
        TriangleMesh
            With the same vertices; the surface itself when nothing had to be done.

        Raises
        ------
        TopologyError
            Naming the edge that more than two faces share, or a face of a surface with one side.

        Warns
        -----
        SimplexMeshWarning
            Saying how many faces were turned or dropped.

        Examples
        --------
        >>> import warnings
        >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
        >>> with warnings.catch_warnings():
        ...     warnings.simplefilter("ignore")  # it says: turned 1 of 2 triangles
        ...     TriangleMesh(square, [[0, 1, 2], [0, 3, 2]]).oriented().faces.tolist()
        [[0, 1, 2], [0, 2, 3]]
        """
        from simplexmesh.mesh import manifold

        kept, mates, said = manifold.matched(self.faces)
        faces, _, _ = manifold.oriented(self.vertices, kept, mates, outward=outward)
        turned = int(np.count_nonzero((faces != kept).any(axis=1)))
        if turned:
            said.append(f"turned {turned:,} of {len(faces):,} triangles")
        if not said:
            return self
        warn(", ".join(said))
        return TriangleMesh(self.vertices, faces)

    def transformed(self, T_target_source: ArrayLike) -> TriangleMesh:
        """Return the surface in the frame the transform leads to; a reflection turns the faces so as to stay outward.

        Parameters
        ----------
        T_target_source : (4, 4) array of float
            Affine.
        """
        T = affine("T_target_source", T_target_source)
        faces = self.faces if np.linalg.det(T[:3, :3]) > 0 else self.faces[:, ::-1]
        return TriangleMesh(self.vertices @ T[:3, :3].T + T[:3, 3], faces)

    def welded(self, *, tolerance: float = 0.0, report: bool = True) -> TriangleMesh:
        """Return the surface with every position once, without the faces that collapse and the vertices without face.

        Files store corners of triangles apart (STL always, others at texture seams); topology needs them together.

        Parameters
        ----------
        tolerance : float
            Positions no farther apart than this are one, in the unit of the vertices; the first of them stays.
        report : bool
            Whether to warn of what was merged and removed.

        Warns
        -----
        SimplexMeshWarning
            When vertices were merged or faces removed.
        """
        unique, place = distinct_positions(self.vertices, _check.number("tolerance", tolerance, 0.0))
        faces = place[self.faces]
        whole = are_proper(faces)
        used, faces = np.unique(faces[whole], return_inverse=True)
        if not len(used):
            raise ValueError("faces must be at least one with three different positions, not none")
        if report:
            report_welding(len(place) - len(unique), int(np.count_nonzero(~whole)), len(unique) - len(used))
        if len(used) == len(self.vertices) and whole.all():
            return self
        return TriangleMesh(unique[used], faces.reshape(-1, 3))

    def sampled(self, n: int, rng: np.random.Generator | int | None = None) -> PointCloud:
        """Return `n` points drawn uniformly over the area, with the normals of their faces.

        Parameters
        ----------
        n : int
            How many, at least 4.
        rng : Generator or int, optional
            Source of randomness.

        Examples
        --------
        >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
        >>> square.sampled(5, rng=0).normals[0]
        array([0., 0., 1.])
        """
        n = _check.integer("n", n, 4)
        rng = np.random.default_rng(rng)
        cumulated = np.cumsum(_vec.norm(self.face_vectors))
        if not cumulated[-1] > 0:
            raise ValueError("faces must have an area to draw points from, all are flat")
        face = np.searchsorted(cumulated, rng.random(n) * cumulated[-1], side="right")
        face = np.minimum(face, len(cumulated) - 1)
        u, v = rng.random((2, n, 1))
        u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
        a, b, c = (self.vertices[self.faces[face, j]] for j in range(3))
        return PointCloud(a + u * (b - a) + v * (c - a), self.face_vectors[face])
