"""Zones grown by fronts over triangles of like curvature. Arrays in, arrays filled; no checks."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit


@njit(cache=True)
def grow(labels, order, values, tolerance, mates, closed):
    """Label unlabeled triangles by zones from seeds in order, up to `closed` (3t,) edges and other values."""
    zones, queue = 0, np.empty(len(labels), np.int64)
    for seed in order:
        if labels[seed] >= 0:
            continue
        queue[0], head, tail = seed, 0, 1
        labels[seed] = zones
        while head < tail:
            t = queue[head]
            head += 1
            for h in range(3 * t, 3 * t + 3):
                other = mates[h] // 3
                if mates[h] < 0 or closed[h] or labels[other] >= 0:
                    continue
                if abs(values[other] - values[seed]) <= tolerance:
                    labels[other] = zones
                    queue[tail] = other
                    tail += 1
        zones += 1
    return zones
