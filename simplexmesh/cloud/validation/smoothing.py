"""The test whether averages over neighbors keep more of residuals than they do of noise."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array
from simplexmesh.cloud.validation.regression import rounding

NEIGHBORS = 10
"""Over which residuals are averaged, each with itself (Chaperon 2002, section 5.2.6)."""

TRIALS = 399
"""Of the law under the hypothesis: p-values are whole 400ths."""


def nearest_neighbors(points: Array, k: int = NEIGHBORS) -> csr_array:
    """Return the matrix (n, n) that averages (eq. 5.7) over the k nearest points, itself among them; of any dimension.

    Points are to be on the surface: points off it are near where their residuals are alike.
    """
    index = cKDTree(points).query(points, k=range(1, min(k, len(points)) + 1))[1]
    share = np.full(index.size, 1.0 / index.shape[1])
    return csr_array((share, index.ravel(), np.arange(0, index.size + 1, index.shape[1])), shape=(len(points),) * 2)


def smoothed_ratio(residuals: Array, smoothed: Array) -> Array:
    """Return rho (eq. 5.8): squares of smoothed residuals by squares of what smoothing takes away.

    About 1 / (k - 1) for independent residuals of mean 0 and means of k of them with itself, 1 / (k + 1) without;
    columns (n, m) give (m,).
    """
    away = ((residuals - smoothed) ** 2).sum(axis=0)
    kept = (smoothed**2).sum(axis=0)
    return kept / np.maximum(away, rounding(residuals))


def sign_flips(residuals: Array, rng: np.random.Generator, trials: int = TRIALS) -> Array:
    """Return residuals (n, trials) of the hypothesis: each at its place, of random sign.

    Where noise is larger it stays so, as it does not in permutations (the wild bootstrap; Wu 1986).
    """
    return residuals[:, None] * rng.choice(np.array([-1.0, 1.0]), (len(residuals), trials))


def at_least(value: float, law: Array) -> float:
    """Return the p-value of a statistic by trials of its law, itself one of them (Davison and Hinkley 1997, 4.11)."""
    return float((1 + np.count_nonzero(law >= value)) / (1 + len(law)))
