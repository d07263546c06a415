"""The parts of a surface between edges. Arrays in, arrays out; no checks."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit


@njit(cache=True)
def parts(mates, stops):
    """Return labels (t,) of triangles connected across half-edges that do not stop, in the order of the triangles."""
    labels = np.full(len(mates) // 3, -1, np.int64)
    queue = np.empty(len(labels), np.int64)
    count = 0
    for seed in range(len(labels)):
        if labels[seed] >= 0:
            continue
        queue[0], labels[seed], waiting = seed, count, 1
        while waiting:
            waiting -= 1
            t = queue[waiting]
            for half in range(3 * t, 3 * t + 3):
                other = mates[half] // 3
                if mates[half] >= 0 and not stops[half] and labels[other] < 0:
                    labels[other], queue[waiting] = count, other
                    waiting += 1
        count += 1
    return labels
