"""Connectivity of a 2-simplex mesh: its darts (half-edges), and all adjacency derived from them.

Dart `3 * i + j` is the directed edge from vertex `i` to its neighbor number `j`, counter-clockwise seen from outside.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Indices, Indices32, Mask
from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh import _kernels
from simplexmesh.mesh.paths import Named, refusal_of_darts

MAX_VERTICES = 2**31 // 3


def _read_only(values: NDArray[Any]) -> NDArray[Any]:
    """Mark an array that no one else holds as read-only, without a copy, and return it."""
    values.setflags(write=False)
    return values


def _checked_twin(twin: ArrayLike) -> Indices32:
    """Return `twin` as a read-only array, or raise `TopologyError` naming a vertex where it is not a simplex mesh."""
    given = checks.array("twin", twin, (None, 3), np.int64)
    n = len(given)
    if not 4 <= n <= MAX_VERTICES:
        raise TopologyError(f"twin must have 4 to {MAX_VERTICES} rows, one for each vertex, not {n}")
    flat = checks.indices("twin", given, (n, 3), 3 * n).ravel()
    darts = np.arange(3 * n)
    if (wrong := flat[flat] != darts).any():
        d = int(wrong.argmax())
        raise TopologyError(
            f"twin must be its own inverse; at vertex {d // 3} the twin of dart {d} is {flat[d]}, "
            f"whose twin is {flat[flat[d]]}"
        )
    rows = flat.reshape(-1, 3) // 3
    if (wrong := (rows == np.arange(n)[:, None]).any(axis=1)).any():
        raise TopologyError(f"vertex {int(wrong.argmax())} is its own neighbor, which a simplex mesh forbids")
    a, b, c = rows.T
    if (wrong := (a == b) | (b == c) | (c == a)).any():
        i = int(wrong.argmax())
        raise TopologyError(f"vertex {i} must have three different neighbors, not {rows[i].tolist()}")
    return _read_only(flat.reshape(-1, 3).astype(np.int32))


def _checked_contours(given: Mapping[str, ArrayLike], twin: Indices32) -> Named:
    """Return named contours as read-only arrays of darts, or raise `TopologyError` naming one that is none."""
    out = {}
    used = np.zeros(twin.size, bool)
    for name, darts in given.items():
        chosen = checks.indices(f"contour {name!r}", darts, (None,), twin.size)
        if reason := refusal_of_darts(chosen, twin):
            raise TopologyError(f"contour {name!r} {reason}")
        if used[chosen].any():
            raise TopologyError(f"contour {name!r} must share no edge with another contour")
        used[chosen] = used[twin.reshape(-1)[chosen]] = True
        out[str(name)] = _read_only(chosen.astype(np.int32))
    return MappingProxyType(out)


@dataclass(frozen=True, eq=False, repr=False)
class Connectivity:
    """The topology of a 2-simplex mesh: computed once, read-only, shared by meshes that differ in positions only.

    Faces are the orbits of `next(d) = rotate^-1(twin[d])`, which walks around the face on the left of a dart,
    counter-clockwise seen from outside. A hole is a face with a label: per-face arrays include the holes, marked in
    `face_is_hole`; `n_faces` counts the faces of the surface only.

    Parameters
    ----------
    twin : (n, 3) array of int
        `twin[i, j]` is the opposite of dart `3 * i + j`, itself a dart `3 * k + l`. Must be its own inverse and give
        every vertex three different neighbors, none of them itself.
    hole_darts : sequence of int
        Darts whose left face is a hole; kept as the smallest dart of each hole, sorted.
    contour_darts : mapping of str to sequence of int, optional
        Named contours: the darts along each, in order. They have no edges in common.

    Raises
    ------
    TopologyError
        When `twin` is not that of a simplex mesh, or some darts are not those of a contour; the message names a vertex.

    References
    ----------
    H. Delingette, *Modélisation, déformation et reconnaissance d'objets tridimensionnels à l'aide de maillages
    simplexes*, thesis, École Centrale de Paris, 1994, chapter 2.

    Examples
    --------
    >>> tetrahedron = Connectivity([[3, 6, 9], [0, 11, 7], [1, 5, 10], [2, 8, 4]])
    >>> tetrahedron.n_edges, tetrahedron.n_faces, tetrahedron.genus
    (6, 4, 0)
    >>> tetrahedron.neighbors.tolist()
    [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]
    """

    twin: Indices32
    hole_darts: Indices32 = ()  # type: ignore[assignment]
    contour_darts: Named = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "twin", _checked_twin(self.twin))
        given = checks.any_array("hole_darts", self.hole_darts)
        darts = checks.indices("hole_darts", given if given.size else np.zeros(0, np.int64), (None,), self.twin.size)
        holes = np.unique(self.face.ravel()[darts]) if len(darts) else darts
        object.__setattr__(self, "hole_darts", _read_only(self.face_darts[self.face_offsets[holes]].copy()))
        object.__setattr__(self, "contour_darts", _checked_contours(self.contour_darts, self.twin))

    @classmethod
    def from_neighbors(cls, neighbors: ArrayLike, hole_darts: ArrayLike = ()) -> Connectivity:
        """Return the connectivity with these neighbors, each triple counter-clockwise seen from outside.

        Parameters
        ----------
        neighbors : (n, 3) array of int
            The three neighbors of each vertex.
        hole_darts : sequence of int
            Darts whose left face is a hole.

        Raises
        ------
        TopologyError
            Where vertex b is a neighbor of a but a is not one of b.

        Examples
        --------
        >>> Connectivity.from_neighbors([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]).twin.tolist()
        [[3, 6, 9], [0, 11, 7], [1, 5, 10], [2, 8, 4]]
        """
        n = len(checks.array("neighbors", neighbors, (None, 3), np.int64))
        rows = checks.indices("neighbors", neighbors, (n, 3), n)
        back = rows[rows] == np.arange(n)[:, None, None]
        if (wrong := ~back.any(axis=2)).any():
            i, j = np.argwhere(wrong)[0]
            raise TopologyError(f"vertex {rows[i, j]} is a neighbor of vertex {i}, but {i} is not one of its neighbors")
        return cls(3 * rows + back.argmax(axis=2), hole_darts)  # type: ignore[arg-type]

    def __repr__(self) -> str:
        return f"Connectivity({self.n_vertices} vertices, {self.n_faces} faces, {self.n_holes} holes)"

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy the arguments only, not the cached arrays."""
        return Connectivity, (self.twin, self.hole_darts, dict(self.contour_darts))

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return len(self.twin)

    @property
    def n_edges(self) -> int:
        """Number of edges, 3/2 the number of vertices."""
        return self.twin.size // 2

    @property
    def n_faces(self) -> int:
        """Number of faces of the surface, holes not counted."""
        return len(self.face_offsets) - 1 - self.n_holes

    @property
    def n_holes(self) -> int:
        """Number of hole faces."""
        return len(self.hole_darts)

    @cached_property
    def neighbors(self) -> Indices32:
        """(n, 3) the neighbors of each vertex, counter-clockwise seen from outside."""
        return _read_only(self.twin // np.int32(3))

    @cached_property
    def _orbits(self) -> tuple[Indices32, Indices32, Indices32]:
        face, darts, offsets = _kernels.face_orbits(self.twin.reshape(-1))
        return _read_only(face.reshape(-1, 3)), _read_only(darts), _read_only(offsets)

    @property
    def face(self) -> Indices32:
        """(n, 3) the face on the left of each dart; faces are numbered by their smallest dart, holes included."""
        return self._orbits[0]

    @property
    def vertex_faces(self) -> Indices32:
        """(n, 3) the faces around each vertex, number `j` between its neighbors `j` and `j + 1`; the array `face`."""
        return self._orbits[0]

    @property
    def face_darts(self) -> Indices32:
        """(3n,) the darts of each face in order around it; those of face `f` start at `face_offsets[f]`."""
        return self._orbits[1]

    @property
    def face_offsets(self) -> Indices32:
        """(f + 1,) where each face, holes included, starts in `face_darts` and `face_vertices`."""
        return self._orbits[2]

    @cached_property
    def face_vertices(self) -> Indices32:
        """(3n,) the vertices of each face, counter-clockwise seen from outside."""
        return _read_only(self.face_darts // np.int32(3))

    @cached_property
    def face_sizes(self) -> Indices32:
        """(f,) the number of vertices of each face."""
        return _read_only(np.diff(self.face_offsets))

    @cached_property
    def face_is_hole(self) -> Mask:
        """(f,) whether each face is a hole."""
        out = np.zeros(len(self.face_sizes), bool)
        out[self.face.ravel()[self.hole_darts]] = True
        return _read_only(out)

    @cached_property
    def edge_darts(self) -> Indices32:
        """(e, 2) the two darts of each edge, the smaller first."""
        twin = self.twin.ravel()
        first = np.flatnonzero(twin > np.arange(twin.size)).astype(np.int32)
        return _read_only(np.stack([first, twin[first]], axis=1))

    @cached_property
    def edge_vertices(self) -> Indices32:
        """(e, 2) the two ends of each edge, the smaller first."""
        return _read_only(self.edge_darts // np.int32(3))

    @cached_property
    def edge_faces(self) -> Indices32:
        """(e, 2) the faces on the left and on the right of each edge, directed from its smaller end."""
        return _read_only(self.face.ravel()[self.edge_darts])

    @cached_property
    def components(self) -> Indices32:
        """(n,) the connected component of each vertex, numbered by smallest vertex."""
        return _read_only(_kernels.component_labels(self.neighbors))

    @cached_property
    def n_components(self) -> int:
        """Number of connected components."""
        return int(self.components.max()) + 1

    @property
    def euler(self) -> int:
        """V - E + F with holes counted as faces, as if each were closed by a disk."""
        return self.n_vertices - self.n_edges + len(self.face_sizes)

    @property
    def genus(self) -> int:
        """Number of handles, summed over the components: V - E + F = 2 (components - genus)."""
        return self.n_components - self.euler // 2

    def rings(self, size: int) -> tuple[Indices, Indices32]:
        """Return the neighborhoods Q^s: for each vertex, the vertices within `size` edges, itself among them.

        Parameters
        ----------
        size : int
            s, the number of edges, at least 0.

        Returns
        -------
        offsets : (n + 1,) array of int
            Where each vertex's neighborhood begins.
        vertices : (offsets[n],) array of int
            The neighborhoods one after the other, each sorted.

        Examples
        --------
        >>> tetrahedron = Connectivity([[3, 6, 9], [0, 11, 7], [1, 5, 10], [2, 8, 4]])
        >>> offsets, vertices = tetrahedron.rings(1)
        >>> vertices[offsets[2] : offsets[3]].tolist()
        [0, 1, 2, 3]
        """
        offsets, vertices = _kernels.rings(self.neighbors, checks.integer("size", size, 0))
        return _read_only(offsets), _read_only(vertices)
