"""A triangle mesh."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks, vectors
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.errors import counted, warn
from simplexmesh._base.named_arrays import Data, Located, named_arrays, taken
from simplexmesh._base.units import unit_or_none
from simplexmesh.data.points import PointCloud
from simplexmesh.data.welding import are_proper, distinct_positions, report_welding
from simplexmesh.numerics.blending import blended

if TYPE_CHECKING:
    from simplexmesh.mesh.triangles.topology import Topology


@dataclass(frozen=True, eq=False, repr=False)
class TriangleMesh(Located):
    """A surface of triangles.

    Parameters
    ----------
    vertices : (v, 3) array of float
        Positions, finite, at least four.
    faces : (f, 3) array of int
        Three different vertices each, counter-clockwise seen from outside.
    data : mapping of str to array, optional
        Named arrays with one row per vertex; bytes in three or four columns are colors (sRGB), "colors" in files.
    unit : str, optional
        Unit of length of the vertices: "nm", "um", "mm", "cm", "m", "km", "in" or "ft".

    Raises
    ------
    ValueError
        Wrong shape, fewer than four vertices, no face, NaN or infinite values, an index outside, an unknown unit.
    TypeError
        Not numbers, or faces that are not whole numbers.

    Warns
    -----
    SimplexMeshWarning
        Faces with a repeated vertex were removed.

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
    data: Data = field(default_factory=dict)
    unit: str | None = None

    def __post_init__(self) -> None:
        vertices = checks.array("vertices", self.vertices, (None, 3))
        if len(vertices) < 4:
            raise ValueError(f"vertices must be at least 4, not {len(vertices)}")
        given = checks.any_array("faces", self.faces)
        if given.ndim == 2 and not len(given):
            raise ValueError("faces must be at least one, not none")
        faces = checks.indices("faces", self.faces, (None, 3), len(vertices))
        proper = are_proper(faces)
        if not proper.all():
            removed = counted(int(np.count_nonzero(~proper)), "degenerate face", "degenerate faces")
            warn(f"removed {removed} of {len(faces):,}")
            faces = faces[proper]
            if not len(faces):
                raise ValueError("faces must be at least one with three different vertices, not none")
        object.__setattr__(self, "vertices", checks.frozen(vertices))
        object.__setattr__(self, "faces", checks.frozen(faces))
        object.__setattr__(self, "data", named_arrays(self.data, len(vertices), "vertex"))
        object.__setattr__(self, "unit", unit_or_none("unit", self.unit))

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
    def face_vectors(self) -> Array:
        """(f, 3) array of float: outward face normals, with twice the area as length."""
        return checks.frozen(vectors.triangle_vectors(self.vertices, self.faces))

    @property
    def area(self) -> float:
        """Area of the surface."""
        return float(vectors.norm(self.face_vectors).sum() / 2)

    @property
    def volume(self) -> float:
        """Signed enclosed volume (divergence theorem), positive if oriented outward. Closed surfaces only."""
        center = self.vertices.mean(axis=0)
        return float(vectors.dot(self.vertices[self.faces[:, 0]] - center, self.face_vectors).sum() / 6)

    @cached_property
    def vertex_normals(self) -> Array:
        """(v, 3) array of float: unit vertex normals, area-weighted over the adjacent faces; zero without faces."""
        return checks.frozen(vectors.vertex_normals(self.vertices, self.faces))

    @property
    def shares_vertices(self) -> bool:
        """Whether any two triangles have a vertex in common, as none have of those that STL files list."""
        return len(np.unique(self.faces)) < self.faces.size

    @cached_property
    def is_closed(self) -> bool:
        """Whether the surface has no border: every edge has as many faces in one direction as in the other."""
        ends = self.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        sign = np.where(ends[:, 0] < ends[:, 1], 1, -1)
        key = ends.min(axis=1) * len(self.vertices) + ends.max(axis=1)
        _, edge = np.unique(key, return_inverse=True)
        return not np.bincount(edge.reshape(-1), weights=sign).any()

    @cached_property
    def topology(self) -> Topology:
        """Components, borders, handles and Euler number, whatever the orientation of the faces.

        Raises
        ------
        TopologyError
            More than two faces share an edge, or the surface is not orientable.

        Examples
        --------
        >>> import simplexmesh as sm
        >>> sm.torus(12, 6).triangulated().topology
        Topology(n_components=1, n_borders=0, genus=1, euler=0)
        """
        from simplexmesh.mesh.triangles.topology import surface_topology

        return surface_topology(self.faces)

    @property
    def n_components(self) -> int:
        """Number of connected components; see `topology`."""
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
        """Return the surface with consistently oriented faces, without duplicate faces.

        In each component the minority of the faces is flipped, then closed components that enclose a negative volume
        are flipped as a whole.

        Parameters
        ----------
        outward : bool
            Orient closed components outward. Without it the inner wall of a cavity keeps its orientation.

        Returns
        -------
        TriangleMesh
            With the same vertices; the surface itself if nothing had to be done.

        Raises
        ------
        TopologyError
            An edge has more than two faces, or the surface is not orientable; the message says where.

        Warns
        -----
        SimplexMeshWarning
            Faces were flipped or dropped; the message says how many.

        Examples
        --------
        >>> import warnings
        >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
        >>> with warnings.catch_warnings():
        ...     warnings.simplefilter("ignore")  # flipped 1 of 2 triangles
        ...     TriangleMesh(square, [[0, 1, 2], [0, 3, 2]]).oriented().faces.tolist()
        [[0, 1, 2], [0, 2, 3]]
        """
        from simplexmesh.mesh import manifold

        checks.flag("outward", outward)
        kept, mates, repairs = manifold.matched(self.faces)
        faces, _, turned = manifold.oriented(self.vertices, kept, mates, outward=outward)
        flipped = int(np.count_nonzero((faces != kept).any(axis=1)))
        told = f"{flipped:,} of {len(faces):,} triangles"
        if 0 < flipped < len(faces) and turned[0].endswith("components"):
            repairs.append(f"turned outward {told}: closed components that face inward, as the walls of cavities do")
        elif flipped:
            repairs.append(f"flipped {told}")
        if not repairs:
            return self
        warn(", ".join(repairs))
        return replace(self, faces=faces)

    def transformed(self, T_target_source: ArrayLike) -> TriangleMesh:
        """Return the surface in the target frame of a (4, 4) affine; faces stay outward in reflections; data stay."""
        T = checks.affine("T_target_source", T_target_source)
        faces = self.faces if np.linalg.slogdet(T[:3, :3])[0] > 0 else self.faces[:, ::-1]
        return replace(self, vertices=self.vertices @ T[:3, :3].T + T[:3, 3], faces=faces)

    def welded(self, *, tolerance: float = 0.0, report: bool = True) -> TriangleMesh:
        """Return the surface with vertices merged by position, without collapsed faces and unused vertices.

        Files duplicate vertices (STL always, others at texture seams); the topology needs them merged.
        Data are those of the first of equal vertices.

        Parameters
        ----------
        tolerance : float
            Positions no farther apart than this are merged, in the unit of the vertices; the first one is kept.
        report : bool
            Whether to warn about merged vertices and removed faces.

        Warns
        -----
        SimplexMeshWarning
            Vertices were merged or faces removed.
        """
        first, inverse = distinct_positions(self.vertices, checks.number("tolerance", tolerance, 0.0))
        faces = inverse[self.faces]
        proper = are_proper(faces)
        used, faces = np.unique(faces[proper], return_inverse=True)
        if not len(used):
            raise ValueError("faces must be at least one with three different positions, not none")
        if report:
            report_welding(len(inverse) - len(first), int(np.count_nonzero(~proper)), len(first) - len(used))
        if len(used) == len(self.vertices) and proper.all():
            return self
        kept = first[used]
        return TriangleMesh(self.vertices[kept], faces.reshape(-1, 3), taken(self.data, kept), self.unit)

    def sampled(self, count: int, *, rng: np.random.Generator | int = 0) -> PointCloud:
        """Return points drawn uniformly over the area, with the normals of their faces and interpolated data.

        Parameters
        ----------
        count : int
            How many, at least 4.
        rng : Generator or int
            Draws them.

        Examples
        --------
        >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
        >>> square.sampled(5, rng=0).normals[0]
        array([0., 0., 1.])
        """
        n = checks.integer("count", count, 4)
        rng = checks.generator("rng", rng)
        cumulated = np.cumsum(vectors.norm(self.face_vectors))
        if not cumulated[-1] > 0:
            raise ValueError("faces must have a positive area to sample from, all are degenerate")
        face = np.searchsorted(cumulated, rng.random(n) * cumulated[-1], side="right")
        face = np.minimum(face, len(cumulated) - 1)
        u, v = rng.random((2, n, 1))
        u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
        a, b, c = (self.vertices[self.faces[face, j]] for j in range(3))
        data = blended(self.data, self.faces[face], np.hstack([1 - u - v, u, v])) if self.data else {}
        return PointCloud(a + u * (b - a) + v * (c - a), self.face_vectors[face], data, self.unit)
