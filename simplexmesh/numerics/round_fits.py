"""Round surfaces by linear algebra, from points and from normals of either sign: where exact fits start.

Points should be centered and of about unit size.
"""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import cross, dot, norm, normalized


def ball(points: Array) -> tuple[Array, float]:
    """Return center (d,) and radius of the circle or sphere through points (n, d) in the sense of Pratt (1987).

    A (x.x) + B.x + C is least in squares where B.B - 4 A C = 1, its squared gradient on the surface: so its values are
    nearly distances, and short arcs are not drawn to smaller radii. Points of a flat have an infinite radius.
    """
    rows = np.column_stack([dot(points, points), points, np.ones(len(points))])
    d = points.shape[1]
    inverse = np.zeros((d + 2, d + 2))
    inverse[1:-1, 1:-1] = np.eye(d)
    inverse[0, -1] = inverse[-1, 0] = -0.5
    values, vectors = np.linalg.eig(inverse @ rows.T @ rows)
    # one of the values is negative, as one of the constraint's is; the next one is the least cost
    a, *b, c = vectors[:, np.argsort(values.real)[1]].real
    with np.errstate(divide="ignore", invalid="ignore"):
        center = -np.array(b) / (2 * a)
        radius = np.sqrt(max(float(np.dot(b, b) - 4 * a * c), 0.0)) / (2 * abs(a))
    return center, float(radius)


def across_normals(normals: Array) -> Array:
    """Return the orthonormal frame (3, 3) whose last row is most perpendicular to normals (n, 3): a cylinder's axis."""
    return np.asarray(np.linalg.eigh(normals.T @ normals)[1].T[::-1])


def cone_apex(points: Array, normals: Array) -> Array:
    """Return the point (3,) nearest to all tangent planes."""
    return np.asarray(np.linalg.lstsq(normals, dot(normals, points), rcond=None)[0], float)


def met_axis(points: Array, normals: Array) -> tuple[Array, Array] | None:
    """Return a point and the unit direction of the line that all normals meet nearly; None where that is at infinity.

    A surface of revolution's normals are in a linear complex with its axis (Pottmann and Randrup 1998).
    """
    lines = np.concatenate([cross(points, normals), normals], axis=1)
    axis, moment = np.split(np.linalg.eigh(lines.T @ lines)[1][:, 0], 2)
    if norm(axis) < 1e-3 * norm(moment):
        return None
    return cross(axis, moment) / dot(axis, axis), normalized(axis)


def from_axis(points: Array, on: Array, axis: Array) -> tuple[Array, Array]:
    """Return the distances (n,) of points from an axis, and their heights (n,) along it."""
    apart = points - on
    along = dot(apart, axis)
    return norm(apart - along[:, None] * axis), along


def between_axes(p: Array, u: Array, q: Array, v: Array) -> tuple[float, float, float, Array]:
    """Return how two lines, by a point and a unit direction each, are nearest: q - p = a u + b v + c across.

    `a` ahead on the one and `b` back on the other one are they `c` apart along the unit direction `across` (3,), last.
    """
    across = normalized(cross(u, v))
    ahead, back, apart = np.linalg.solve(np.stack([u, v, across], axis=1), q - p).tolist()
    return ahead, back, apart, across
