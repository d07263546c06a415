"""Where rays from one point meet quadrics and tori, in their own frames."""

from __future__ import annotations

import numpy as np


def quadric(start, along, weights, level):
    """The two distances (n, 2) along directions (n, 3) to where weights . (x², y², z²) is a level; NaN for none."""
    weights = np.asarray(weights, float)
    a, b, c = along**2 @ weights, along @ (weights * start), start**2 @ weights - level
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(b**2 - a * c)
        q = -(b + np.where(b >= 0, root, -root))
        return np.stack([q / a, c / q], axis=1)


def torus(start, along, radius, tube_radius):
    """The four distances (n, 4) along unit directions (n, 3) to a torus about the z axis, NaN where there is none."""
    middle = -(along @ start)
    at = start + middle[:, None] * along
    ways = np.full((len(along), 4), np.nan)
    near = np.flatnonzero((at**2).sum(axis=1) < (radius + tube_radius) ** 2)
    at, way = at[near], along[near]
    level = (at**2).sum(axis=1) + radius**2 - tube_radius**2
    across = 4 * radius**2
    companion = np.zeros((len(near), 4, 4))
    companion[:, [1, 2, 3], [0, 1, 2]] = 1
    companion[:, 0, 3] = across * (at[:, :2] ** 2).sum(axis=1) - level**2
    companion[:, 1, 3] = 2 * across * (at[:, :2] * way[:, :2]).sum(axis=1)
    companion[:, 2, 3] = across * (way[:, :2] ** 2).sum(axis=1) - 2 * level
    roots = np.linalg.eigvals(companion)
    ways[near] = np.where(roots.imag == 0, roots.real, np.nan) + middle[near, None]
    return ways
