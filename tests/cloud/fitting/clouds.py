"""Points on primitives with known ends, and noise along the normals."""

from __future__ import annotations

import numpy as np

import simplexmesh as sm

P = sm.primitives
TILTED = [1.0, 2.0, 0.3]
PRIMITIVES = {
    "plane": (P.Plane([1, 2, 3], TILTED), [[0, 2.5], [-2, 2]]),
    "sphere": (P.Sphere([1, 2, 3], 2.0), [[0, 2.5], [-0.5, 1.0]]),
    "cylinder": (P.Cylinder([1, 2, 3], TILTED, 2.0), [[0, 2.5], [-3, 3]]),
    "cone": (P.Cone([1, 2, 3], TILTED, 0.3), [[0, 2.5], [3, 9]]),
    "torus": (P.Torus([1, 2, 3], TILTED, 4.0, 1.0), [[0, 2.5], [-2, 2]]),
    "line": (P.Line([1, 2, 3], TILTED), [[0, 1], [-2, 2]]),
    "circle": (P.Circle([1, 2, 3], TILTED, 2.0), [[0, 2.5], [0, 1]]),
}
"""One of each kind, and the ends of its surface coordinates."""

SURFACES = ["plane", "sphere", "cylinder", "cone", "torus"]


def exact(kind, count=400, seed=0):
    """Return a primitive and points (n, 3) on it."""
    primitive, ends = PRIMITIVES[kind]
    low, high = np.array(ends, float).T
    return primitive, primitive.at(np.random.default_rng(seed).uniform(low, high, (count, 2)))


def noisy(kind, count=400, noise=0.02, seed=0):
    """Return a primitive and points (n, 3) near it: off a surface along the normals, off a curve in all directions."""
    primitive, points = exact(kind, count, seed)
    return primitive, moved(primitive, points, noise, np.random.default_rng(seed + 1000))


def moved(primitive, points, noise, rng):
    """Return points (n, 3) with noise."""
    if primitive.kind in ("line", "circle"):
        return points + noise * rng.normal(size=points.shape)
    return points + noise * rng.normal(size=(len(points), 1)) * primitive.gradient(points)


def with_outliers(points, share, rng):
    """Return points (n, 3) of which a share is anywhere in their box, enlarged, and which those are."""
    out = rng.random(len(points)) < share
    low, high = points.min(axis=0) - 1, points.max(axis=0) + 1
    return np.where(out[:, None], rng.uniform(low, high, points.shape), points), out


def same(a, b, tolerance=1e-6):
    """Return whether two primitives of a kind are the same surface or curve, near the origin."""
    probe = np.random.default_rng(5).normal(size=(50, 3)) * 5
    return np.allclose(np.abs(a.distance(probe)), np.abs(b.distance(probe)), atol=tolerance)
