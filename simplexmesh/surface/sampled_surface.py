"""Input of the estimators: points of a surface and their adjacency."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import norm
from simplexmesh.data.foreign import converted
from simplexmesh.data.points import PointCloud, cloud_of_rows
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.numerics import scan_lines
from simplexmesh.surface import _kernels_neighborhoods as kernels
from simplexmesh.surface.neighborhoods import Ball, Nearest, Neighborhood, Neighborhoods, Rings

CLOUD_NEIGHBORS = 12
"""Number of nearest points that serve as the one-ring in a cloud, which has no edges."""

MAX_MEMBERS = 2**28
"""Limit on the neighbors of all centers together: 2 GB."""

AT_A_TIME = 2**24
"""Neighbors in balls that are found together: SciPy's pairs take four times the memory of the result."""


@dataclass(frozen=True, eq=False)
class SampledSurface:
    """Points of a surface, with faces if there are any."""

    points: Array
    faces: Indices | None = None  # (f, 3), counter-clockwise seen from outside
    links: Neighborhoods | None = None  # one-rings of all points that do not come from triangles: of a simplex mesh
    outward: Array | None = None  # (n, 3) known unit normals

    @cached_property
    def wedges(self) -> tuple[Indices, Indices, Indices]:
        """CSR (offsets, ahead, behind): the other corners of triangles around a point, ccw, or consecutive links."""
        if self.faces is not None:
            out: tuple[Indices, Indices, Indices] = kernels.wedges(self.faces, len(self.points))
            return out
        return wedges_between(self.one_ring)

    @cached_property
    def one_ring(self) -> Neighborhoods:
        """The vertices one edge away, in order; in a cloud the nearest points."""
        if self.links is not None:
            return self.links
        if self.faces is None:
            near = scan_lines.even(self.tree).near(np.arange(n := len(self.points)), min(CLOUD_NEIGHBORS + 1, n))[1]
            return _without_centers(np.arange(n), near)
        offsets, members, closed = kernels.ordered_rings(*self.wedges)
        return Neighborhoods(np.arange(len(self.points)), offsets, members, closed)

    @cached_property
    def ring_edges(self) -> tuple[Indices, Array]:
        """Centers and lengths of the edges of the one-rings, (m,) each, in the order of `one_ring.members`."""
        ring = self.one_ring
        ends = np.repeat(ring.centers, ring.valence)
        return ends, norm(self.points[ring.members] - self.points[ends])

    @cached_property
    def edges(self) -> csr_array:
        """(n, n) the lengths of the edges of the one-rings, above 0, as graphs of SciPy have them."""
        ring, n = self.one_ring, len(self.points)
        return csr_array((np.maximum(self.ring_edges[1], 1e-300), ring.members, ring.offsets), shape=(n, n))

    @cached_property
    def components(self) -> Indices:
        """(n,) the connected component of each point over the edges of the one-rings."""
        return np.asarray(connected_components(self.edges, directed=False)[1], np.int64)

    @cached_property
    def tree(self) -> cKDTree:
        """Kd-tree of all points."""
        return cKDTree(self.points)

    def around(self, neighborhood: Neighborhood, vertices: ArrayLike | None = None) -> Neighborhoods:
        """Return the neighbors of all points, or of some; at most `MAX_MEMBERS` in all."""
        n = len(self.points)
        if isinstance(neighborhood, Neighborhoods):
            return _selected(neighborhood, n, vertices)
        if not isinstance(neighborhood, Rings | Ball | Nearest):
            kind = type(neighborhood).__name__
            raise TypeError(f"neighborhood must come from rings, ball or nearest, or be Neighborhoods, not {kind}")
        centers = np.arange(n) if vertices is None else checks.selection("at", vertices, n)
        if isinstance(neighborhood, Nearest):
            count = min(neighborhood.count, n - 1) + 1
            _, found = self.tree.query(self.points[centers], count, workers=-1)
            return _without_centers(centers, found.reshape(len(centers), count))
        if neighborhood == Rings(1):
            return self.one_ring if vertices is None else self.one_ring.taken(centers)
        radius, steps = (neighborhood.radius, n) if isinstance(neighborhood, Ball) else (np.inf, neighborhood.count)
        if isinstance(neighborhood, Ball) and not (neighborhood.connected and self.is_connected):
            offsets, members = _in_balls(self.tree, centers, radius)
        else:
            ring = (self.one_ring.offsets, self.one_ring.members)
            offsets, members = kernels.within(*ring, self.points, centers, steps, radius, MAX_MEMBERS)
            _check_total(len(members), neighborhood)
        if isinstance(neighborhood, Ball) and neighborhood.inner > 0.0:
            offsets, members = _outside(self.points, centers, offsets, members, neighborhood.inner)
        return Neighborhoods(centers, offsets, members, np.zeros(len(centers), bool))

    @property
    def is_connected(self) -> bool:
        """Whether there are faces or links."""
        return self.faces is not None or self.links is not None


def wedges_between(ring: Neighborhoods) -> tuple[Indices, Indices, Indices]:
    """Return CSR (offsets, ahead, behind) over the rows of a ring: the pairs of consecutive neighbors."""
    counts = ring.valence
    behind = np.append(ring.members[1:], 0)
    some = counts > 0
    behind[ring.offsets[1:][some] - 1] = ring.members[ring.offsets[:-1][some]]
    kept = np.ones(len(ring.members), bool)
    kept[ring.offsets[1:][some & ~ring.closed] - 1] = False
    offsets = np.concatenate([[0], np.cumsum(counts - (some & ~ring.closed))])
    return offsets, ring.members[kept], behind[kept]


def _in_balls(tree: cKDTree, centers: Indices, radius: float) -> tuple[Indices, Indices]:
    """Return CSR (offsets, members) of all points within `radius` of each center, ascending."""
    total = int(tree.count_neighbors(cKDTree(tree.data[centers]), radius))
    _check_total(total - len(centers), Ball(radius, connected=False))
    counts, members = [np.zeros(1, np.int64)], [np.zeros(0, np.int64)]
    for some in np.array_split(centers, 1 + total // AT_A_TIME):
        pairs = cKDTree(tree.data[some]).sparse_distance_matrix(tree, radius, output_type="ndarray")
        row, near = (pairs[name][some[pairs["i"]] != pairs["j"]] for name in ("i", "j"))
        table = csr_array((np.ones(len(row), bool), (row, near)), shape=(len(some), tree.n))
        table.sort_indices()
        counts.append(np.diff(table.indptr))
        members.append(table.indices)
    return np.concatenate(counts).cumsum(), np.concatenate(members)


def _outside(
    points: Array, centers: Indices, offsets: Indices, members: Indices, inner: float
) -> tuple[Indices, Indices]:
    """Return CSR (offsets, members) of the members no nearer to their center than `inner`."""
    rows = np.repeat(np.arange(len(centers)), np.diff(offsets))
    far = ((points[members] - points[centers[rows]]) ** 2).sum(axis=1) >= inner * inner
    counts = np.bincount(rows[far], minlength=len(centers))
    return np.concatenate([[0], np.cumsum(counts)]), members[far]


def _check_total(members: int, asked: Neighborhood) -> None:
    """Raise an error if there are more than `MAX_MEMBERS` neighbors in all."""
    if members > MAX_MEMBERS:
        raise ValueError(
            f"neighborhood must hold at most {MAX_MEMBERS:,} neighbors in all, not those of {asked}; "
            "ask for a smaller one, or for fewer vertices at a time"
        )


def _selected(made: Neighborhoods, n: int, vertices: ArrayLike | None) -> Neighborhoods:
    """Return given neighborhoods, checked: all rows, or those of some vertices."""
    most = max((int(part.max()) for part in (made.centers, made.members) if len(part)), default=0)
    if most >= n:
        raise ValueError(f"neighborhood must name points below {n:,}, not {most:,}")
    if len(own := made.members[made.members == np.repeat(made.centers, made.valence)]):
        raise ValueError(f"neighborhood must not have a point among its own neighbors, as {own[0]:,} has")
    if vertices is None:
        return made
    asked = checks.selection("at", vertices, n)
    row = np.full(n, -1)
    row[made.centers] = np.arange(len(made))
    if (missing := row[asked] < 0).any():
        raise ValueError(f"at must select vertices with neighborhoods; vertex {asked[missing.argmax()]} has none")
    return made.taken(row[asked])


def _without_centers(centers: Indices, found: Indices) -> Neighborhoods:
    """Return neighborhoods of (c, k + 1) nearest points less the center, or the farthest if duplicates displace it."""
    itself = found == centers[:, None]
    itself[~itself.any(axis=1), -1] = True
    members = found[~itself]
    offsets = np.arange(len(centers) + 1) * (found.shape[1] - 1)
    return Neighborhoods(centers, offsets, members, np.zeros(len(centers), bool))


def as_sampled_surface(value: Any) -> SampledSurface:
    """Convert a triangle mesh, a simplex mesh, a cloud or what converts to one, with all its points in order."""
    if isinstance(value, SampledSurface):
        return value
    found = _converted(value)
    if isinstance(found, TriangleMesh | PointCloud) or hasattr(found, "connectivity"):
        checks.size("surface", np.asarray(found.bounds))
    if isinstance(found, TriangleMesh):
        return SampledSurface(found.vertices, found.faces)
    if isinstance(found, PointCloud):
        return SampledSurface(found.points, outward=found.normals)
    if hasattr(found, "connectivity"):
        return SampledSurface(found.vertices, links=_links(found), outward=found.normals)
    what = checks.type_name(found)
    if isinstance(value, str | os.PathLike):
        what = f"a {what} as in {os.fspath(value)}"
    raise TypeError(f"surface must be triangles, a simplex mesh, points or a path to them, not {what}")


def _converted(value: Any) -> Any:
    """Convert a surface to one of our own types, with all its points; return anything else as it is."""
    if isinstance(value, PointCloud | TriangleMesh):
        return value
    found = converted(value, "surface")
    if found is not None:
        return found
    if hasattr(value, "connectivity"):  # a simplex mesh
        return value
    if isinstance(value, str | os.PathLike):
        from simplexmesh.data.io.reading import read

        return read(value)
    if isinstance(value, tuple | list) and len(value) == 2:
        points, faces = (checks.any_array("surface", part) for part in value)
        if points.ndim == faces.ndim == 2:
            return TriangleMesh(points, faces)
    if isinstance(value, list | tuple) or hasattr(value, "__array__"):
        rows = checks.any_array("surface", value)
        if rows.ndim != 2 or rows.shape[1] not in (3, 6):
            raise ValueError(f"surface must have shape (*, 3) for points or (*, 6) with normals, not {rows.shape}")
        return cloud_of_rows("surface", rows)
    return value


def _links(mesh: Any) -> Neighborhoods:
    """Return the three neighbors in a simplex mesh: a closed cycle, or next to a hole a fan that begins after it."""
    c = mesh.connectivity
    beside_hole = c.face_is_hole[c.face]  # the face of dart j lies between neighbors j and j + 1
    first = np.where(beside_hole.any(axis=1), 1 + beside_hole.argmax(axis=1), 0)
    neighbors = np.take_along_axis(c.neighbors, (np.arange(3) + first[:, None]) % 3, axis=1)
    n = len(neighbors)
    return Neighborhoods(np.arange(n), 3 * np.arange(n + 1), neighbors.ravel(), ~beside_hole.any(axis=1))
