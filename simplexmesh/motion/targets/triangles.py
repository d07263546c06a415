"""The target of triangulated surfaces, and signed distances to them; uses libigl's AABB tree."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import igl
import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, norm, normalized, sums, triangle_vectors
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh import _kernels
from simplexmesh.motion.targets.borders import Border, border_of_triangles
from simplexmesh.motion.targets.protocol import BuiltInTarget, checked_arguments
from simplexmesh.numerics.kd_tree import uneven_tree

ON_SURFACE = 1e-7
"""Points closer than this fraction of the surface's size are on it."""

AT_SIDE = 1e-6
"""Points of a triangle closer than this fraction of its height are on a side."""


class Triangles(BuiltInTarget):
    """A triangulated surface: the closest point, projected on each vertex's normal.

    A closest point counts if its triangle faces the same way as the vertex (within about 78 degrees), so that the far
    wall of a thin sheet does not attract; on an edge or corner, which several triangles share, the direction to the
    closest point is considered too. Beyond the border of an open surface there is no data.

    Parameters
    ----------
    triangles : TriangleMesh or anything convertible
        Counter-clockwise seen from outside.
    oriented : bool
        False if the orientation of the triangles is meaningless: both sides attract.

    Raises
    ------
    ValueError, TypeError
        Not triangles, or of a size for which products of areas overflow.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> square = sm.TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> target = Triangles(square)
    >>> up = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
    >>> target.gap(np.array([[0.5, 0.2, -0.1], [0.5, 0.5, 3.0]]), up, reach=1.0)
    array([0.1, nan])
    """

    def __init__(self, triangles: Any, *, oriented: bool = True) -> None:
        mesh = as_triangles(triangles)
        checks.size("triangles", mesh.bounds)
        self.bounds: Array = mesh.bounds
        self.unit = mesh.unit
        self.oriented = checks.flag("oriented", oriented)
        self.vertices = np.ascontiguousarray(mesh.vertices, dtype=np.float64)
        self.faces = np.ascontiguousarray(mesh.faces, dtype=np.int64)
        self._normals = normalized(triangle_vectors(self.vertices, self.faces))
        self._on_border = border_sides(self.faces)
        self._touching = ON_SURFACE * float(np.ptp(self.vertices, axis=0).max())
        self._tree = igl.AABB()
        self._tree.init(self.vertices, self.faces)

    def closest(self, points: Array) -> tuple[Array, Array, Indices]:
        """Return, for each point, its distance to the surface, the closest point and its triangle."""
        squared, faces, closest = self._tree.squared_distance(
            self.vertices, self.faces, np.ascontiguousarray(points, dtype=np.float64)
        )
        return np.sqrt(np.asarray(squared).ravel()), np.asarray(closest), np.asarray(faces).ravel()

    def gap(self, vertices: Array, normals: Array, reach: float) -> Array:
        """Return (n,) the signed distance along each normal, NaN where the closest point is beyond `reach`."""
        vertices, normals, reach = checked_arguments(vertices, normals, reach)
        known = np.isfinite(vertices)  # the tree cannot handle others
        distance, closest, faces = self.closest(np.where(known, vertices, 0.0))
        facing = dot(self._normals[faces], normals)
        # at an edge the face found is an arbitrary one of several, so the direction to the closest point counts too
        toward = closest - vertices
        along = dot(toward, normals)
        straight = np.abs(along) > 0.5 * np.maximum(distance, 1e-300)
        agrees = (facing > 0.2) | (straight & (facing > -0.2))
        if not self.oriented:
            agrees = (np.abs(facing) > 0.2) | straight
        agrees |= distance <= self._touching
        agrees &= ~(self._beyond_border(closest, faces) & (np.abs(along) < 0.8 * distance))
        return np.where(agrees & (distance <= reach) & known.all(axis=1), along, np.nan)

    def depths(self, points: Array) -> Array:
        """Return, for points in or near a closed surface, how deep they are, in ways to the opposite side.

        0 is on the side nearest to a point, 0.5 halfway along the normal there, negative outside; NaN if none is
        opposite.
        """
        _, closest, faces = self.closest(points)
        inward = -self._normals[faces]
        start = closest + self._touching * inward
        hit, way, _ = self._tree.intersect_ray_first(self.vertices, self.faces, start, inward)
        return np.where(np.asarray(hit).ravel() < 0, np.nan, dot(points - closest, inward) / np.asarray(way).ravel())

    def signed(self, points: Array) -> tuple[Array, Array, Mask]:
        """Return, for each point, its signed distance, the gradient of this, and whether it is beyond a border.

        Distances are positive outside, or on the side that the faces of an open surface face. For closed surfaces the
        inside is determined by the winding number: where the surface intersects itself, as offsets do, the normal at
        the closest point is unreliable. A surface oriented inward, like the wall of a cavity, has its inside around it.
        On the surface the gradient is the normal.
        """
        at = np.ascontiguousarray(points, dtype=np.float64)
        distance, closest, faces = self.closest(at)
        away, beyond = at - closest, self._beyond_border(closest, faces)
        on_it = distance <= self._touching
        if self._on_border.any():
            normals = self._normals_at(closest, faces)
            inside = dot(away, normals) < 0
        else:
            normals = away.copy()
            normals[on_it] = self._normals_at(closest[on_it], faces[on_it])
            winding = np.asarray(self._winding.winding_number(_relative(at, self.vertices))).ravel()
            inside = winding > (-0.5 if self._looks_inward else 0.5)
        sign = np.where(inside, -1.0, 1.0)
        direction = normalized(np.where(on_it[:, None], normals, sign[:, None] * away))
        return sign * distance, direction, beyond

    @cached_property
    def _winding(self) -> Any:
        found = igl.FastWindingNumberBVH()
        found.init(_relative(self.vertices, self.vertices), self.faces)
        return found

    @cached_property
    def _looks_inward(self) -> bool:
        return TriangleMesh(self.vertices, self.faces).volume < 0

    @cached_property
    def _pseudonormals(self) -> tuple[Array, Array]:
        """Angle-weighted normals of vertices (v, 3), and the normals of sides (f, 3, 3), not normalized."""
        corners = self.vertices[self.faces]
        along = normalized((np.roll(corners, -1, axis=1) - corners).reshape(-1, 3)).reshape(-1, 3, 3)
        turns = np.arccos(np.clip(-(along * np.roll(along, 1, axis=1)).sum(axis=2), -1.0, 1.0))
        weighted, other = turns[:, :, None] * self._normals[:, None], np.roll(self.faces, -1, axis=1)
        at_vertices = sums(weighted.reshape(-1, 3), self.faces.ravel(), len(self.vertices))
        keys = np.minimum(self.faces, other) * len(self.vertices) + np.maximum(self.faces, other)
        edges, inverse = np.unique(keys.ravel(), return_inverse=True)
        at_edges = sums(np.repeat(self._normals, 3, axis=0), inverse.ravel(), len(edges))
        return at_vertices, at_edges[inverse.ravel()].reshape(-1, 3, 3)

    def _normals_at(self, closest: Array, faces: Indices) -> Array:
        """Return (n, 3) unit pseudonormals at surface points: of faces, sides or corners (Baerentzen, Aanaes 2005)."""
        (at_vertices, at_sides), low = self._pseudonormals, self._at_sides(closest, faces)
        out = self._normals[faces].copy()
        for side in range(3):
            out[low[:, side]] = at_sides[faces[low[:, side]], side]
        for corner in range(3):
            here = low[:, corner] & low[:, corner - 1]
            out[here] = at_vertices[self.faces[faces[here], corner]]
        return normalized(out)

    @cached_property
    def border(self) -> Border:
        """Points along the border of an open surface, to which the boundary of a mesh is attracted."""
        return border_of_triangles(self.vertices, self.faces, self._on_border)

    def beyond_border(self, points: Array) -> Mask:
        """Return (n,) bool: whether the closest point of the surface is on its border."""
        _, closest, faces = self.closest(points)
        return self._beyond_border(closest, faces)

    def _beyond_border(self, closest: Array, faces: Indices) -> Mask:
        """Return (n,) bool: whether closest points lie on the border of an open surface."""
        out = np.zeros(len(faces), dtype=bool)
        rows = np.flatnonzero(self._corner_on_border[faces].any(axis=1))
        at, found = self._at_sides(closest[rows], faces[rows]), faces[rows]
        corner = at & np.roll(at, 1, axis=1) & self._corner_on_border[found]  # of any triangle around it
        out[rows] = ((at & self._on_border[found]) | corner).any(axis=1)
        return out

    @cached_property
    def _corner_on_border(self) -> Mask:
        """(f, 3) bool: whether the border passes a corner of a triangle, which may have no side on it."""
        out = np.zeros(len(self.vertices), dtype=bool)
        for end in (self.faces, np.roll(self.faces, -1, axis=1)):
            out[end[self._on_border]] = True
        return out[self.faces]

    def _at_sides(self, closest: Array, faces: Indices) -> Mask:
        """Return (n, 3) bool: whether a point of triangle i is on its side j, from corner j to j + 1."""
        corners = self.vertices[self.faces[faces]]
        rest = closest[:, None] - corners
        share = norm(np.cross(np.roll(corners, -1, axis=1) - corners, rest).reshape(-1, 3)).reshape(-1, 3)
        return np.asarray(share <= AT_SIDE * np.maximum(share.max(axis=1), 1e-300)[:, None])


def border_sides(faces: Indices) -> Mask:
    """Return (f, 3) bool: whether side j of a triangle, from corner j to j + 1, belongs to no other triangle."""
    mates, crowded = _kernels.half_edge_mates(np.array(faces, dtype=np.int64))
    if crowded < 0:
        return np.asarray(mates.reshape(-1, 3) < 0)
    other = np.roll(faces, -1, axis=1)  # non-manifold: slower, for any number of triangles per edge
    edge = np.minimum(faces, other) * (int(faces.max()) + 1) + np.maximum(faces, other)
    _, inverse, count = np.unique(edge.ravel(), return_inverse=True, return_counts=True)
    return np.asarray((count[inverse] == 1).reshape(-1, 3))


def surface_distance(points: Array, vertices: Array, faces: Indices) -> Array:
    """Return (n,) the unsigned distances of points to a triangulated surface."""
    out = np.zeros(len(points))
    order = uneven_tree(points).indices  # neighbors one after the other take a third of the time
    squared, _, _ = igl.point_mesh_squared_distance(
        np.ascontiguousarray(points[order], dtype=np.float64),
        np.ascontiguousarray(vertices, dtype=np.float64),
        np.ascontiguousarray(faces, dtype=np.int64),
    )
    out[order] = np.sqrt(np.asarray(squared).ravel())
    return out


def inside_surface(points: Array, vertices: Array, faces: Indices) -> Mask:
    """Return (n,) bool: whether points are inside a closed triangulated surface."""
    return winding_numbers(points, vertices, faces) > 0.5


def winding_numbers(points: Array, vertices: Array, faces: Indices) -> Array:
    """Return the winding numbers (n,) of points in a triangulated surface (Jacobson 2013)."""
    if not len(points):
        return np.zeros(0)
    numbers = igl.fast_winding_number(
        _relative(vertices, vertices), np.ascontiguousarray(faces, dtype=np.int64), _relative(points, vertices)
    )
    return np.asarray(numbers).ravel()


def _relative(points: Array, vertices: Array) -> Array:
    """Return points relative to the middle of a surface, in its extent: winding numbers are in single precision."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    extent = float((high - low).max()) or 1.0
    return np.ascontiguousarray((points - (low + high) / 2) / extent, dtype=np.float64)
