"""For the choice of scales: the probe nearest to each vertex."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit


@njit(cache=True)
def nearest_probe(offsets, members, points, probes):
    """Return the row of the probe fewest edges from each vertex, of several the nearest; -1 where unconnected."""
    n = offsets.shape[0] - 1
    out, distance = np.full(n, -1, np.int64), np.zeros(n, np.int64)
    queue = np.empty(n, np.int64)
    stop = probes.shape[0]
    for row in range(stop):
        out[probes[row]] = row
        queue[row] = probes[row]
    start = 0
    while start < stop:
        i = queue[start]
        start += 1
        for m in range(offsets[i], offsets[i + 1]):
            j = members[m]
            if out[j] < 0:
                out[j], distance[j] = out[i], distance[i] + 1
                queue[stop] = j
                stop += 1
            elif distance[j] == distance[i] + 1 and out[j] != out[i]:
                now = then = 0.0
                for axis in range(3):
                    now += (points[probes[out[j]], axis] - points[j, axis]) ** 2
                    then += (points[probes[out[i]], axis] - points[j, axis]) ** 2
                if then < now:
                    out[j] = out[i]
    return out
