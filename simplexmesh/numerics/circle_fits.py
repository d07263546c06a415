"""Circles in space: distances from them, the best of a sample of triples, and the robust fit."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import cross, norm, normalized, tangents
from simplexmesh.numerics.robust import robust_scale, robust_weights, weighted_quantiles

SAMPLES = 300
"""Circles through three random points that are scored."""

MAX_SCORED = 2000
"""Most points used for the scores, drawn by their weights."""


def circle_residuals(at: Array, center: Array, normal: Array, radius: float) -> tuple[Array, Array]:
    """Return (n, 2) distances to the circle, in its plane and along its axis, and their (n, 2, 6) Jacobians."""
    u, v = tangents(normal)
    arm = at - center
    height = arm @ normal
    flat = arm - height[:, None] * normal
    length = np.maximum(norm(flat), 1e-300)
    out = flat / length[:, None]
    rows = np.zeros((len(at), 2, 6))
    rows[:, 0, :3], rows[:, 0, 5] = -out, -1.0
    rows[:, 0, 3], rows[:, 0, 4] = -height * (out @ u), -height * (out @ v)
    rows[:, 1, :3] = -normal
    rows[:, 1, 3], rows[:, 1, 4] = arm @ u, arm @ v
    return np.stack([length - radius, height], axis=1), rows


def robust_circle(
    at: Array, weight: Array, center: Array, normal: Array, radius: float
) -> tuple[Array, Array, float, float]:
    """Return the circle after iteratively reweighted Gauss-Newton steps, and the scale of the weights."""
    least = 1e-9  # of the scale, over the extent of the points
    for _ in range(60):
        residual, rows = circle_residuals(at, center, normal, radius)
        off = norm(residual)
        w = np.repeat(weight * robust_weights(off, least), 2)
        flat = rows.reshape(-1, 6)
        x = -np.linalg.pinv((flat * w[:, None]).T @ flat, rcond=1e-12, hermitian=True) @ (
            flat.T @ (w * residual.ravel())
        )
        u, v = tangents(normal)
        center, radius = center + x[:3], abs(radius + float(x[5]))
        normal = normalized(normal + x[3] * u + x[4] * v)
        if np.linalg.norm(x) < 1e-12:
            break
    return center, normal, radius, robust_scale(off, least)


def sampled_circle(at: Array, weight: Array) -> tuple[Array, Array, float] | None:
    """Return the best circle through three of the points, None if all triples are collinear."""
    rng = np.random.default_rng(0)
    if len(at) > MAX_SCORED:
        at, weight = at[rng.choice(len(at), MAX_SCORED, replace=False, p=_probabilities(weight))], np.ones(MAX_SCORED)
    shares, count = _probabilities(weight), SAMPLES if len(at) > 3 else 1
    triples = np.stack([rng.choice(len(at), 3, replace=False, p=shares) for _ in range(count)])
    a, b, c = (at[triples[:, k]] for k in range(3))
    across = cross(b - a, c - a)
    double = norm(across)
    sound = double > 1e-9
    if not sound.any():
        return None
    a, b, c, across, double = a[sound], b[sound], c[sound], across[sound], double[sound]
    normals = across / double[:, None]
    one, other = ((c - a) ** 2).sum(axis=1)[:, None], ((b - a) ** 2).sum(axis=1)[:, None]
    to_centers = (one * cross(across, b - a) + other * cross(c - a, across)) / (2 * double[:, None] ** 2)
    centers, radii = a + to_centers, norm(to_centers)
    # the least weighted median distance, with a penalty on circles much larger than the extent of the points
    off = [
        weighted_quantiles(norm(circle_residuals(at, *circle)[0]), weight, 0.5) + 0.01 * circle[2] * (circle[2] > 2)
        for circle in zip(centers, normals, radii, strict=True)
    ]
    best = int(np.argmin(off))
    return centers[best], normals[best], float(radii[best])


def _probabilities(weight: Array) -> Array:
    shares = weight + 1e-6 * weight.max()
    return np.asarray(shares / shares.sum())
