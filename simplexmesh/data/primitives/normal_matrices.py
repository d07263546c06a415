"""Inverses of the normal matrices of least squares."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array

SINGULAR = 1e-13
"""Of the largest eigenvalue of a matrix of unit diagonal: parameters below are not told by the data."""


def inverse(matrix: Array) -> Array:
    """Return the inverse (p, p) of a normal matrix, whatever the units of its parameters; NaN if it is singular."""
    scale = np.sqrt(np.maximum(np.diagonal(matrix), 1e-300))
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    if not values.min(initial=np.inf) > SINGULAR * values.max(initial=0.0):
        return np.full_like(matrix, np.nan)
    return np.asarray((vectors / values) @ vectors.T / np.outer(scale, scale))
