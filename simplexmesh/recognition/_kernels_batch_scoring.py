"""Score and refine the motions of many models at once. Arrays in, arrays out; no checks.

Motion h belongs to model k = owners[h], whose samples are columns ``starts[k] : starts[k + 1]``.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit
from simplexmesh.recognition._kernels_grid_scoring import refine_motion, score_motion


@njit(cache=True, error_model="numpy", parallel=True)
def score_motions_of_models(motions, owners, samples, starts, grid, low, cell, target, widths, reaches, scores):
    """Score motions (h, 12) as `score_motions` does for one model; `widths` and `reaches` (m,) are per model."""
    for h in prange(len(motions)):
        k = owners[h]
        scores[h] = score_motion(
            motions[h], samples, starts[k], starts[k + 1], grid, low, 1.0 / cell, target, widths[k], reaches[k]
        )


@njit(cache=True, error_model="numpy", parallel=True)
def refine_motions_of_models(motions, owners, samples, starts, grid, low, cell, target, widths):
    """Refine motions (h, 12), in place, as `refine_motions` does for one model; `widths` (m, steps) are per model."""
    for h in prange(len(motions)):
        k = owners[h]
        A, b, x = np.zeros((6, 6)), np.zeros(6), np.zeros(6)
        refine_motion(motions[h], samples, starts[k], starts[k + 1], grid, low, 1.0 / cell, target, widths[k], A, b, x)
