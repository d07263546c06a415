"""How primitives fit points: deviations, covariance, extent."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh.data.primitives.base import Fit, Primitive
from simplexmesh.data.primitives.circle import Circle

Array = NDArray[np.float64]

SINGULAR = 1e-13
"""Of the largest eigenvalue of a matrix of unit diagonal: parameters below are not told by the points."""


def fit_of(
    primitive: Primitive,
    points: Array,
    *,
    weights: Array | None = None,
    chart: Array | None = None,
    noise: float | None = None,
    **more: Any,
) -> Fit:
    """Return how a primitive that is at the least weighted squared distance from points (n, 3) fits them.

    `chart` (p, q) are the derivatives of its parameters by those that were free, `noise` is the deviation where that is
    known, and `more` is told as it is. The covariance is NaN where the points do not tell all parameters.
    """
    matrix, _, square = primitive.normal_equations(points, weights)
    free = np.eye(len(matrix)) if chart is None else chart
    count, spare = len(points), len(points) * primitive.per_point - free.shape[1]
    shown = float(np.sqrt(square / spare)) if spare > 0 else float("nan")
    covariance = (shown if noise is None else noise) ** 2 * free @ inverse(free.T @ matrix @ free) @ free.T
    covered = primitive.coverage(points) if isinstance(primitive, Circle) else None
    rms = float(np.sqrt(square / count))
    return Fit(rms, shown, covariance, primitive.within(points), count, covered=covered, **more)


def inverse(matrix: Array) -> Array:
    """Return the inverse (p, p) of a normal matrix, whatever the units of its parameters; NaN if it is singular."""
    scale = np.sqrt(np.maximum(np.diagonal(matrix), 1e-300))
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    if not values.min(initial=np.inf) > SINGULAR * values.max(initial=0.0):
        return np.full_like(matrix, np.nan)
    return np.asarray((vectors / values) @ vectors.T / np.outer(scale, scale))
