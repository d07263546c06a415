"""Motions of many models judged and followed at once. Arrays in, arrays out; no checks.

Motion h is one of model `owners[h]`, whose samples are those from ``starts`` of it to the next.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit
from simplexmesh.recognition._kernels_register import followed, judged


@njit(cache=True, error_model="numpy", parallel=True)
def judge_all(motions, owners, samples, starts, grid, low, cell, target, widths, reaches, scores):
    """Score motions (h, 12) as `judge` does those of one model; `widths` and `reaches` (m,) are the models'."""
    for h in prange(len(motions)):
        k = owners[h]
        scores[h] = judged(
            motions[h], samples, starts[k], starts[k + 1], grid, low, 1.0 / cell, target, widths[k], reaches[k]
        )


@njit(cache=True, error_model="numpy", parallel=True)
def follow_all(motions, owners, samples, starts, grid, low, cell, target, widths):
    """Move motions (h, 12), in place, as `follow` does those of one model; `widths` (m, steps) are the models'."""
    for h in prange(len(motions)):
        k = owners[h]
        A, b, x = np.zeros((6, 6)), np.zeros(6), np.zeros(6)
        followed(motions[h], samples, starts[k], starts[k + 1], grid, low, 1.0 / cell, target, widths[k], A, b, x)
