"""Primitive shapes: sphere, ellipsoid, cylinder, plane and torus, all with outward normals."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import normalized, tangents
from simplexmesh.mesh import lattices, resolution
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.simplex_mesh import SimplexMesh

TRIANGLES = {"icosahedron": 20, "octahedron": 8, "tetrahedron": 4}
"""Triangles of each polyhedron; its sphere has this many vertices times the squared frequency. Most regular first."""

CYLINDER = resolution.Grid("around", "along", lambda n, m: 2 * n * (m + 1), (3, 1))
PLANE = resolution.Grid("across", "along", lambda n, m: (2 * n + 1) * m + 2 * (n + m) + m % 2, (2, 2))
TORUS = resolution.Grid("around", "across", lambda n, m: 2 * n * m, (3, 4), step=2)

SMOOTHING_PASSES = 8
"""Smoothing passes over the inner vertices of a plane, which in its corners have collinear neighbors otherwise."""


def sphere(
    frequency: int | None = None,
    base: str | None = None,
    *,
    vertices: int | None = None,
    radius: float = 1.0,
    center: ArrayLike = (0.0, 0.0, 0.0),
) -> SimplexMesh:
    """Return a sphere: the dual of a regular polyhedron with each triangle divided into `frequency` squared.

    Parameters
    ----------
    frequency : int, optional
        f at least 1: the sphere has 4 f^2 vertices from the tetrahedron, 8 f^2 from the octahedron and 20 f^2 from
        the icosahedron, which is the most regular (12 pentagons, the rest hexagons).
    base : {"icosahedron", "octahedron", "tetrahedron"}, optional
        The polyhedron; by default the icosahedron, or the one chosen for `vertices`.
    vertices : int, optional
        Approximate number of vertices, instead of `frequency`; 1,280 when neither is given. Without a `base` the
        icosahedron is used if its nearest count is within 10 %, else the base that comes nearest: the error is at most
        10 % from 233 vertices up and 13 % from 200 up.
    radius : float
        Distance of all vertices from the center.
    center : (3,) array of float
        The center.

    Returns
    -------
    SimplexMesh
        Closed, of genus 0.

    References
    ----------
    H. Delingette, thesis, 1994, section 2.4; the text prints 6 f^2 for the octahedron.

    Examples
    --------
    >>> sphere(3)
    SimplexMesh(180 vertices, 92 faces, genus 0, 0 holes)
    >>> sphere(vertices=3000, base="octahedron").n_vertices
    2888
    >>> sphere(vertices=130).n_vertices
    128
    """
    if base is None:
        base = "icosahedron" if frequency is not None else resolution.base_for(vertices, TRIANGLES)
    corners, faces = lattices.polyhedron(checks.choice("base", base, lattices.BASES))
    f = resolution.frequency(frequency, vertices, len(faces))
    R = checks.number("radius", radius, 0.0, open_low=True)
    at = checks.array("center", center, (3,))
    points, triangles = lattices.subdivided(corners, faces, f)
    mesh = dual((normalized(points), triangles))
    return mesh.moved(R * normalized(mesh.vertices) + at)


def ellipsoid(
    radii: ArrayLike = (1.0, 1.0, 1.0),
    frequency: int | None = None,
    base: str | None = None,
    *,
    vertices: int | None = None,
    center: ArrayLike = (0.0, 0.0, 0.0),
    axes: ArrayLike | None = None,
) -> SimplexMesh:
    """Return an ellipsoid: a sphere scaled along three axes.

    Parameters
    ----------
    radii : (3,) array of float
        Half the length of each axis.
    frequency, base, vertices
        As for `sphere`.
    center : (3,) array of float
        The center.
    axes : (3, 3) array of float, optional
        The directions of the axes, one per row, orthonormal; x, y, z by default.

    Returns
    -------
    SimplexMesh
        Closed, of genus 0.

    Examples
    --------
    >>> bool(np.isclose(ellipsoid((3, 2, 1), 40).volume, 4 / 3 * np.pi * 6, rtol=2e-3))
    True
    """
    scale = checks.array("radii", radii, (3,))
    if (scale <= 0).any():
        raise ValueError(f"radii must be above 0, not {scale.tolist()}")
    Q = np.eye(3) if axes is None else checks.array("axes", axes, (3, 3))
    if not np.allclose(Q @ Q.T, np.eye(3), atol=1e-6) or np.linalg.det(Q) < 0:
        raise ValueError("axes must be three orthonormal rows of a rotation")
    at = checks.array("center", center, (3,))
    ball = sphere(frequency, base, vertices=vertices)
    return ball.moved((ball.vertices * scale) @ Q + at)


def cylinder(
    around: int | None = None,
    along: int | None = None,
    *,
    vertices: int | None = None,
    radius: float = 1.0,
    height: float = 2.0,
    center: ArrayLike = (0.0, 0.0, 0.0),
    axis: ArrayLike = (0.0, 0.0, 1.0),
) -> SimplexMesh:
    """Return an open cylinder: genus 0, a hole at each end.

    Parameters
    ----------
    around, along : int, optional
        At least 3 and at least 1: the cylinder has `2 * around * (along + 1)` vertices.
    vertices : int, optional
        Approximate number of vertices, instead, with nearly equal edges; 1,280 by default, within 10 % from 200 up.
    radius, height : float
        Distance of all vertices from the axis, and distance of the ends.
    center, axis : (3,) array of float
        The middle, and the direction of the axis.

    Returns
    -------
    SimplexMesh
        With normals away from the axis.

    Examples
    --------
    >>> cylinder(12, 5)
    SimplexMesh(144 vertices, 72 faces, genus 0, 2 holes)
    """
    R = checks.number("radius", radius, 0.0, open_low=True)
    L = checks.number("height", height, 0.0, open_low=True)
    n, m = resolution.cells(CYLINDER, around, along, vertices, 2 * math.pi * R / L)
    uv, triangles = lattices.strip(n, m)
    theta = 2 * math.pi * uv[:, 0]
    mesh = dual((np.stack([np.cos(theta), np.sin(theta), uv[:, 1] - 0.5], axis=1), triangles))
    xy = R * normalized(mesh.vertices[:, :2])
    return mesh.moved(_placed(np.column_stack([xy, L * mesh.vertices[:, 2]]), center, axis))


def plane(
    across: int | None = None,
    along: int | None = None,
    *,
    vertices: int | None = None,
    size: ArrayLike = (1.0, 1.0),
    center: ArrayLike = (0.0, 0.0, 0.0),
    axis: ArrayLike = (0.0, 0.0, 1.0),
) -> SimplexMesh:
    """Return a flat rectangle: genus 0, one hole, which is its border.

    Parameters
    ----------
    across, along : int, optional
        At least 2 each: the rectangle has `(2 * across + 1) * along` vertices inside and one for each border edge.
    vertices : int, optional
        Approximate number of vertices, instead, with nearly equal edges; 1,280 by default, within 10 % from 200 up.
    size : (2,) array of float
        Lengths of the sides; the border vertices lie on them.
    center, axis : (3,) array of float
        The middle, and the normal.

    Returns
    -------
    SimplexMesh
        With normals along `axis`.

    Examples
    --------
    >>> plane(4, 3)
    SimplexMesh(42 vertices, 22 faces, genus 0, 1 holes)
    """
    sides = checks.array("size", size, (2,))
    if (sides <= 0).any():
        raise ValueError(f"size must be above 0, not {sides.tolist()}")
    n, m = resolution.cells(PLANE, across, along, vertices, sides[0] / sides[1])
    uv, triangles = lattices.sheet(n, m)
    flat = np.column_stack([(uv - 0.5) * sides, np.zeros(len(uv))])
    mesh = dual((flat, triangles))
    points = mesh.vertices.copy()
    for _ in range(SMOOTHING_PASSES):
        points[: len(triangles)] = points[mesh.neighbors[: len(triangles)]].mean(axis=1)
    return mesh.moved(_placed(points, center, axis))


def torus(
    around: int | None = None,
    across: int | None = None,
    *,
    vertices: int | None = None,
    radius: float = 1.0,
    tube_radius: float = 0.35,
    center: ArrayLike = (0.0, 0.0, 0.0),
    axis: ArrayLike = (0.0, 0.0, 1.0),
) -> SimplexMesh:
    """Return a torus: closed, of genus 1, all faces hexagons.

    Parameters
    ----------
    around, across : int, optional
        Cells around the axis, at least 3, and around the tube, even and at least 4: the torus has
        `2 * around * across` vertices.
    vertices : int, optional
        Approximate number of vertices, instead, with nearly equal edges; 1,280 by default, within 10 % from 200 up.
    radius, tube_radius : float
        All vertices are at `tube_radius` from the circle of radius `radius` about the axis; `tube_radius < radius`.
    center, axis : (3,) array of float
        The middle, and the direction of the axis.

    Returns
    -------
    SimplexMesh
        With outward normals.

    Examples
    --------
    >>> torus(20, 8)
    SimplexMesh(320 vertices, 160 faces, genus 1, 0 holes)
    """
    R = checks.number("radius", radius, 0.0, open_low=True)
    r = checks.number("tube_radius", tube_radius, 0.0, open_low=True)
    if r >= R:
        raise ValueError(f"tube_radius must be below radius, {R:g}, not {r:g}")
    n, m = resolution.cells(TORUS, around, across, vertices, R / r)
    if m % 2:
        raise ValueError(f"across must be even, not {m}")
    uv, triangles = lattices.tube(n, m)
    theta, phi = 2 * math.pi * uv.T
    ring = R + r * np.cos(phi)
    mesh = dual((np.stack([ring * np.cos(theta), ring * np.sin(theta), r * np.sin(phi)], axis=1), triangles))
    on_circle = R * normalized(mesh.vertices * [1, 1, 0])
    return mesh.moved(_placed(on_circle + r * normalized(mesh.vertices - on_circle), center, axis))


def _placed(points: Array, center: ArrayLike, axis: ArrayLike) -> Array:
    """Return points rotated so that z becomes `axis`, then translated to `center`."""
    z = checks.array("axis", axis, (3,))
    if not z.any():
        raise ValueError("axis must have a direction, not [0, 0, 0]")
    z = normalized(z / np.abs(z).max())
    return points @ np.stack([*tangents(z), z]) + checks.array("center", center, (3,))
