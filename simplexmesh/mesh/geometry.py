"""Closed-form geometry at the vertices of a simplex mesh (Delingette 1994, chapter 3), zero at collinear neighbors.

A vertex P has neighbors A, B, C, ccw seen from outside, in a plane of normal `n`, on a circle of center `C0` and radius
`r`; `F` is its foot on the plane, `h = (P - F) . n` its height, `d = |F - C0|`. Nothing is divided by that area.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base.arrays import Array, Indices32
from simplexmesh._base.vectors import cross, dot, norm, normalized

COLLINEAR_SINE = 1e-14
"""Neighbors count as collinear where the sine of their angle at A is below this."""


def _relative_to_first(vertices: Array, neighbors: Indices32) -> tuple[Array, Array, Array, Array]:
    """Return `P - A`, `B - A`, `C - A` and `(B - A) x (C - A)`, the last exactly zero for collinear neighbors."""
    origin = vertices[neighbors[:, 0]]
    b = vertices[neighbors[:, 1]] - origin
    c = vertices[neighbors[:, 2]] - origin
    w = cross(b, c)
    w[dot(w, w) <= COLLINEAR_SINE**2 * dot(b, b) * dot(c, c)] = 0.0
    return vertices - origin, b, c, w


def _divided(numerator: Array, denominator: Array, otherwise: float) -> Array:
    """Return the elementwise quotient, `otherwise` where the denominator is zero."""
    out = np.full(np.broadcast_shapes(numerator.shape, denominator.shape), otherwise)
    return np.divide(numerator, denominator, out=out, where=denominator != 0)


def normals(vertices: Array, neighbors: Indices32) -> Array:
    """Return the outward unit normals (n, 3), zero where the neighbors are collinear (equation 3.30)."""
    return normalized(_relative_to_first(vertices, neighbors)[3])


def circumcircle(vertices: Array, neighbors: Indices32) -> tuple[Array, Array]:
    """Return center (n, 3) and radius (n,) of the circle through the neighbors; NaN and infinite if collinear."""
    _, b, c, w = _relative_to_first(vertices, neighbors)
    ww = dot(w, w)
    offset = cross(dot(b, b)[:, None] * c - dot(c, c)[:, None] * b, w)
    center = vertices[neighbors[:, 0]] + _divided(offset, 2 * ww[:, None], np.nan)
    radius = _divided(norm(b) * norm(c) * norm(b - c), 2 * np.sqrt(ww), np.inf)
    return center, radius


def simplex_angle(vertices: Array, neighbors: Indices32) -> Array:
    """Return the simplex angle (n,) in (-pi, pi], the elevation of each vertex above the plane of its neighbors.

    `phi = atan2(2 h r, r^2 - d^2 - h^2)` is constant on either side of a sphere through the neighbors. With the foot
    outside the circle, |phi| exceeds pi/2, and is pi in the plane. Thesis, 3.3.1; IJCV 32 (1999) 111, 3.2.
    """
    exponent = np.frexp(np.abs(vertices).max(initial=0.0))[1]  # the sixth powers of lengths are compared below
    p, b, c, w = _relative_to_first(np.ldexp(vertices, -exponent), neighbors)
    toward_center = cross(dot(b, b)[:, None] * c - dot(c, c)[:, None] * b, w)
    sine = dot(p, w) * norm(b) * norm(c) * norm(b - c)
    cosine = dot(p, toward_center) - dot(p, p) * dot(w, w)
    return np.arctan2(sine, cosine)


def sphere_curvature(vertices: Array, neighbors: Indices32) -> Array:
    """Return the curvature (n,) of the sphere through each vertex and its neighbors, in 1 / unit.

    `H = sin(phi) / r = 2 h / sqrt(4 h^2 r^2 + (r^2 - d^2 - h^2)^2)` (thesis, section 3.3) is the mean curvature of the
    surface on a sphere only; elsewhere it depends on the directions of the neighbors, however near they are.
    """
    p, b, c, w = _relative_to_first(vertices, neighbors)
    sphere = dot(p, p)[:, None] * w + dot(b, b)[:, None] * cross(c, p) + dot(c, c)[:, None] * cross(p, b)
    return _divided(2 * dot(p, w), norm(sphere), 0.0)


def metric_parameters(vertices: Array, neighbors: Indices32) -> Array:
    """Return the barycentric coordinates (n, 3) of the foot F, `F = e1 A + e2 B + e3 C`; 1/3 if collinear (3.49)."""
    p, b, c, w = _relative_to_first(vertices, neighbors)
    ww = dot(w, w)
    second = _divided(dot(cross(p, c), w), ww, 1 / 3)
    third = _divided(dot(cross(b, p), w), ww, 1 / 3)
    return np.stack([1 - second - third, second, third], axis=1)


def height_of_angle(radius: ArrayLike, distance: ArrayLike, angle: ArrayLike, *, far: bool = True) -> Array:
    """Return the height L(r, d, phi) of a vertex with a simplex angle, NaN where none exists: `|d sin(phi)| > r`.

    For a foot inside the circle, `d <= r`, there is exactly one. For a foot outside, |phi| exceeds pi/2 and two heights
    `L` and `(d^2 - r^2) / L` have that angle: `far` selects the larger, which continues the first case and is the one
    of the thesis (equations 3.7 and 3.10, rearranged to avoid cancellation).
    """
    r, d, phi = np.broadcast_arrays(*(np.asarray(x, float) for x in (radius, distance, angle)))
    sine, cosine = np.sin(phi), np.cos(phi)
    power = (r - d) * (r + d)
    inside = (r - d * np.abs(sine)) * (r + d * np.abs(sine))
    q = np.sqrt(np.where(inside >= 0, inside, np.nan))
    long = q - r * cosine
    shallow = _divided(power * sine, r * cosine + q, 0.0)
    steep = _divided(long, sine, np.inf)
    if not far:
        steep = np.where(power < 0, _divided(-power * sine, long, 0.0), steep)
    return np.where(cosine >= 0, shallow, steep)[()]
