"""What estimators look at: points of a surface, and who is next to whom."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from simplexmesh import _check
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.surface import _kernels_balls as balls
from simplexmesh.surface import _kernels_neighborhoods as kernels
from simplexmesh.surface.neighborhoods import Ball, Nearest, Neighborhood, Neighborhoods, Rings

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

NEAREST = 12
"""A cloud has no edges: so many nearest points stand for its one-ring."""

MOST = 2**28
"""So many neighbors in all take 2 GB; whoever wants more asks for fewer vertices at a time."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of a surface, with faces where there are any.

    Attributes
    ----------
    points : (n, 3) array of float
    faces : (f, 3) array of int or None
        Triangles, counter-clockwise seen from outside.
    links : Neighborhoods or None
        The one-ring where it does not come from triangles: the three neighbors in a simplex mesh, or what was given;
        points that were given none have an empty one.
    outward : (n, 3) array of float or None
        Unit normals known beforehand: those of a cloud, those of a simplex mesh.
    """

    points: Array
    faces: Indices | None = None
    links: Neighborhoods | None = None
    outward: Array | None = None

    def __post_init__(self) -> None:
        if self.links is not None and not np.array_equal(self.links.centers, np.arange(len(self.points))):
            object.__setattr__(self, "links", _of_all(self.links, len(self.points)))

    @cached_property
    def wedges(self) -> tuple[Indices, Indices, Indices]:
        """CSR (offsets, ahead, behind): the two other corners of each triangle around a point, in its order.

        Where there are no triangles, each two neighbors that follow each other in the links stand for one.
        """
        if self.faces is not None:
            out: tuple[Indices, Indices, Indices] = kernels.wedges(self.faces, len(self.points))
            return out
        return wedges_between(self.one_ring)

    @cached_property
    def one_ring(self) -> Neighborhoods:
        """The vertices one edge away, in order; of a cloud the nearest points."""
        if self.links is not None:
            return self.links
        if self.faces is None:
            return self.around(Nearest(min(NEAREST, len(self.points) - 1)))
        offsets, members, closed = kernels.ordered_rings(*self.wedges)
        return Neighborhoods(np.arange(len(self.points)), offsets, members, closed)

    @cached_property
    def tree(self) -> cKDTree:
        """Of all points."""
        return cKDTree(self.points)

    def around(self, neighborhood: Neighborhood, vertices: ArrayLike | None = None) -> Neighborhoods:
        """Return the neighbors of all points, or of some.

        Parameters
        ----------
        neighborhood : Rings, Ball, Nearest or Neighborhoods
            What was asked for; of neighborhoods already made, the rows of the vertices.
        vertices : (c,) array of int, optional
            Analyze these points only.

        Raises
        ------
        TypeError
            Something else was asked for.
        ValueError
            Neighborhoods of other points, or more members than memory should hold.
        """
        n = len(self.points)
        if isinstance(neighborhood, Neighborhoods):
            return _given(neighborhood, n, vertices)
        if not isinstance(neighborhood, Rings | Ball | Nearest):
            kind = type(neighborhood).__name__
            raise TypeError(f"neighborhood must come from rings, ball or nearest, or be Neighborhoods, not {kind}")
        centers = np.arange(n) if vertices is None else _check.selection("vertices", vertices, n)
        if isinstance(neighborhood, Nearest):
            count = min(neighborhood.count, n - 1) + 1
            _, found = self.tree.query(self.points[centers], count, workers=-1)
            return _without_centers(centers, found.reshape(len(centers), count))
        if isinstance(neighborhood, Ball) and not (neighborhood.connected and self.is_connected):
            offsets, members = _in_ball(self.points, centers, neighborhood.radius)
        else:
            ring = self.one_ring
            if isinstance(neighborhood, Ball):
                inside = (self.points, centers, neighborhood.radius, MOST)
                offsets, members = kernels.connected_balls(ring.offsets, ring.members, *inside)
            elif neighborhood.count == 1:
                return ring if vertices is None else ring.taken(centers)
            else:
                offsets, members = kernels.rings(ring.offsets, ring.members, centers, neighborhood.count, MOST)
            _affordable(offsets[-1], neighborhood)
        if isinstance(neighborhood, Ball) and neighborhood.inner > 0.0:
            offsets, members = _beyond(self.points, centers, offsets, members, neighborhood.inner)
        return Neighborhoods(centers, offsets, members, np.zeros(len(centers), bool))

    @property
    def is_connected(self) -> bool:
        """Whether there are edges."""
        return self.faces is not None or self.links is not None


def wedges_between(ring: Neighborhoods) -> tuple[Indices, Indices, Indices]:
    """Return CSR (offsets, ahead, behind) over the rows of a ring: each two neighbors that follow each other."""
    counts = ring.valence
    behind = np.append(ring.members[1:], 0)
    some = counts > 0
    behind[ring.offsets[1:][some] - 1] = ring.members[ring.offsets[:-1][some]]
    kept = np.ones(len(ring.members), bool)
    kept[ring.offsets[1:][some & ~ring.closed] - 1] = False
    offsets = np.concatenate([[0], np.cumsum(counts - (some & ~ring.closed))])
    return offsets, ring.members[kept], behind[kept]


def _in_ball(points: Array, centers: Indices, radius: float) -> tuple[Indices, Indices]:
    """CSR (offsets, members) of all points within `radius` of each center, rising."""
    low = points.min(axis=0)
    width = max(radius, float((points.max(axis=0) - low).max()) / (2**balls.BITS - 4))
    found = balls.cell_keys(points, low, width)
    order = np.argsort(found, kind="stable")
    cells = (points, found[order], order, low, width, radius)
    counts = np.zeros(len(centers), np.int64)
    balls.count(centers, *cells, counts)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    _affordable(offsets[-1], Ball(radius, connected=False))
    members = np.zeros(offsets[-1], np.int64)
    balls.fill(centers, *cells, offsets, members)
    return offsets, members


def _beyond(
    points: Array, centers: Indices, offsets: Indices, members: Indices, inner: float
) -> tuple[Indices, Indices]:
    """CSR (offsets, members) of those that are no nearer to their center than `inner`."""
    rows = np.repeat(np.arange(len(centers)), np.diff(offsets))
    far = ((points[members] - points[centers[rows]]) ** 2).sum(axis=1) >= inner * inner
    counts = np.bincount(rows[far], minlength=len(centers))
    return np.concatenate([[0], np.cumsum(counts)]), members[far]


def _affordable(members: int, asked: Neighborhood) -> None:
    """Refuse neighborhoods that would fill the memory."""
    if members > MOST:
        raise ValueError(
            f"neighborhood must hold at most {MOST:,} neighbors in all, not those of {asked}; "
            "ask for a smaller one, or for fewer vertices at a time"
        )


def _given(made: Neighborhoods, n: int, vertices: ArrayLike | None) -> Neighborhoods:
    """Neighborhoods a caller made: all rows, or those of some vertices."""
    most = max((int(part.max()) for part in (made.centers, made.members) if len(part)), default=0)
    if most >= n:
        raise ValueError(f"neighborhood must name points below {n:,}, not {most:,}")
    if len(own := made.members[made.members == np.repeat(made.centers, made.valence)]):
        raise ValueError(f"neighborhood must not have a point among its own neighbors, as {own[0]:,} has")
    if vertices is None:
        return made
    asked = _check.selection("vertices", vertices, n)
    row = np.full(n, -1)
    row[made.centers] = np.arange(len(made))
    if (missing := row[asked] < 0).any():
        raise ValueError(f"vertices must have neighborhoods; vertex {asked[missing.argmax()]} has none")
    return made.taken(row[asked])


def _of_all(made: Neighborhoods, n: int) -> Neighborhoods:
    """Neighborhoods of some points as those of all, the others' empty."""
    rows = _given(made, n, np.unique(made.centers))
    counts, closed = np.zeros(n, np.int64), np.zeros(n, bool)
    counts[rows.centers], closed[rows.centers] = rows.valence, rows.closed
    return Neighborhoods(np.arange(n), np.concatenate([[0], np.cumsum(counts)]), rows.members, closed)


def _without_centers(centers: Indices, found: Indices) -> Neighborhoods:
    """Neighborhoods of (c, k + 1) nearest points less the center, or the farthest where copies crowd it out."""
    itself = found == centers[:, None]
    itself[~itself.any(axis=1), -1] = True
    members = found[~itself]
    offsets = np.arange(len(centers) + 1) * (found.shape[1] - 1)
    return Neighborhoods(centers, offsets, members, np.zeros(len(centers), bool))


def as_samples(value: Any, name: str = "surface") -> Samples:
    """Return samples made of a triangle mesh, a simplex mesh, a cloud or what can be made into one; nothing is merged.

    Row i of every result belongs to vertex or point i of what was given, so duplicate points stay; of a file, to what
    `read` returns.

    Raises
    ------
    TypeError
        It is not a surface.
    ValueError, OSError
        Its content cannot be used: of another shape, or of a size beyond what areas can be multiplied in.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> as_samples(sm.sphere(3)).one_ring
    Neighborhoods(180 centers, 540 neighbors)
    """
    if isinstance(value, Samples):
        return value
    found = _as_is(value, name)
    if isinstance(found, TriangleMesh | PointCloud) or hasattr(found, "connectivity"):
        _check.size(name, np.asarray(found.bounds))
    if isinstance(found, TriangleMesh):
        return Samples(found.vertices, found.faces)
    if isinstance(found, PointCloud):
        return Samples(found.points, outward=found.normals)
    if hasattr(found, "connectivity"):
        return Samples(found.vertices, links=_links(found), outward=found.normals)
    what = type(found).__name__
    if isinstance(value, str | os.PathLike):
        what = f"a {what} as in {os.fspath(value)}"
    raise TypeError(f"{name} must be triangles, a simplex mesh, points or a path to them, not {what}")


def _as_is(value: Any, name: str) -> Any:
    """Return what a caller gave as one of our own types, with every point it had, where it is a surface."""
    if isinstance(value, PointCloud | TriangleMesh):
        return value
    if hasattr(value, "IsA") and hasattr(value, "GetPointData"):
        from simplexmesh.data import vtk

        return vtk.from_dataset(value, name)
    if hasattr(value, "connectivity"):  # of a simplex mesh
        return value
    if isinstance(value, str | os.PathLike):
        from simplexmesh.data.reading import read

        return read(value)
    if isinstance(value, tuple | list) and len(value) == 2:
        points, faces = (_check.any_array(name, part) for part in value)
        if points.ndim == faces.ndim == 2:
            return TriangleMesh(points, faces)
    if hasattr(value, "vertices"):  # of trimesh
        corners = getattr(value, "faces", None)
        points = np.asarray(value.vertices)
        return PointCloud(points) if corners is None or not len(corners) else TriangleMesh(points, np.asarray(corners))
    if isinstance(value, list | tuple) or hasattr(value, "__array__"):
        return _cloud(_check.any_array(name, value), name)
    return value


def _cloud(rows: NDArray[Any], name: str) -> PointCloud:
    """Return points, with normals in three more columns."""
    if rows.ndim != 2 or rows.shape[1] not in (3, 6):
        raise ValueError(f"{name} must have shape (*, 3) for points or (*, 6) with normals, not {rows.shape}")
    return PointCloud(rows[:, :3], rows[:, 3:] if rows.shape[1] == 6 else None)


def _links(mesh: Any) -> Neighborhoods:
    """Return the three neighbors in a simplex mesh: closed where no hole lies between them, else from a hole on."""
    c = mesh.connectivity
    beside_hole = c.face_is_hole[c.face]  # the face of dart j lies between neighbors j and j + 1
    first = np.where(beside_hole.any(axis=1), 1 + beside_hole.argmax(axis=1), 0)
    turned = np.take_along_axis(c.neighbors, (np.arange(3) + first[:, None]) % 3, axis=1)
    n = len(turned)
    return Neighborhoods(np.arange(n), 3 * np.arange(n + 1), turned.ravel(), ~beside_hole.any(axis=1))
