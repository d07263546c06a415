"""The test whether a polynomial of the surface coordinates explains more of residuals than it does of noise."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array

DEGREE = 4
"""Of the polynomial, in total: 15 terms (Chaperon 2002, section 5.2.5)."""


def polynomial_terms(unfolded: Array, degree: int = DEGREE) -> Array:
    """Return the values (n, (degree + 1) (degree + 2) / 2) of a basis of the polynomials of a total degree.

    Products of Legendre polynomials of coordinates in [-1, 1], the constant first.
    """
    one, other = (np.polynomial.legendre.legvander(unfolded[:, k], degree) for k in range(2))
    return np.stack([one[:, j - i] * other[:, i] for j in range(degree + 1) for i in range(j + 1)], axis=1)


def nested_model_statistic(residuals: Array, outer: Array, inner: Array) -> Array:
    """Return F of residuals (n,) or (n, m) for orthonormal bases (n, p) of a model and (n, q) of one within it.

    The gain of squares for each further column, by those left for each degree of freedom (Chaperon 2002, eq. 5.5).
    """
    rest = residuals - inner @ (inner.T @ residuals)
    explained = ((outer.T @ rest) ** 2).sum(axis=0)
    left = np.maximum((rest**2).sum(axis=0) - explained, rounding(residuals))
    return (explained / (outer.shape[1] - inner.shape[1])) / (left / (len(residuals) - outer.shape[1]))


def rounding(residuals: Array) -> Array:
    """Return a sum of squares that is of rounding only, above 0, for residuals (n,) or (n, m)."""
    return np.finfo(float).eps ** 2 * (residuals**2).sum(axis=0) + np.finfo(float).tiny


def orthonormal(columns: Array) -> Array:
    """Return an orthonormal basis (n, rank) of what columns (n, p) span, whatever their scales."""
    scale = np.linalg.norm(columns, axis=0)
    u, s, _ = np.linalg.svd(columns[:, scale > 0] / scale[scale > 0], full_matrices=False)
    return u[:, s > 1e-10 * s.max(initial=0.0)]
