"""The test whether a polynomial of the surface coordinates explains more of residuals than it does of noise."""

from __future__ import annotations

import numpy as np
from scipy.special import fdtrc

from simplexmesh._base.arrays import Array
from simplexmesh.cloud.validation.outcome import Outcome

DEGREE = 4
"""Of the polynomial, in total: 15 terms (Chaperon 2002, section 5.2.5)."""


def polynomial_terms(unfolded: Array, degree: int = DEGREE) -> Array:
    """Return the values (n, (degree + 1) (degree + 2) / 2) of a basis of the polynomials of a total degree.

    Products of Legendre polynomials of coordinates in [-1, 1], the constant first.
    """
    one, other = (np.polynomial.legendre.legvander(unfolded[:, k], degree) for k in range(2))
    return np.stack([one[:, j - i] * other[:, i] for j in range(degree + 1) for i in range(j + 1)], axis=1)


def nested_model_test(residuals: Array, full: Array, null: Array) -> Outcome:
    """Test whether the columns of `full` (n, p) explain residuals better than those of `null` (n, q) alone.

    The gain of squares for each further column, by the squares left for each degree of freedom, has the law
    F(p - q, n - p); columns that depend on others do not count (Chaperon 2002, eq. 5.5).
    """
    inner, outer = orthonormal(null), orthonormal(np.column_stack([null, full]))
    more, free = outer.shape[1] - inner.shape[1], len(residuals) - outer.shape[1]
    if more < 1 or free < 1:
        raise ValueError(f"{len(residuals)} residuals cannot test {outer.shape[1]} columns against {inner.shape[1]}")
    statistic = float(nested_model_statistic(residuals, outer, inner))
    return Outcome(statistic, float(fdtrc(more, free, statistic)))


def nested_model_statistic(residuals: Array, outer: Array, inner: Array) -> Array:
    """Return F of residuals (n,) or (n, m) for orthonormal bases (n, p) of a model and (n, q) of one within it."""
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


def regression_test(residuals: Array, unfolded: Array, degree: int = DEGREE) -> Outcome:
    """Test residuals against a polynomial of surface coordinates (n, 2) in [-1, 1] (Chaperon 2002, eq. 5.6).

    Residuals of a fit have lost what its parameters explain, so that F is less than 1: `nested_model_test` with the
    derivatives of the distances as null model has the exact law.
    """
    return nested_model_test(residuals, polynomial_terms(unfolded, degree), np.ones((len(residuals), 1)))
