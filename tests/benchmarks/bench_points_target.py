"""Point target against SciPy's kd-tree: nanoseconds per vertex and call, and what building costs.

Run as ``python tests/benchmarks/bench_points_target.py``. Both run in this process, one thread and all; the best of
several rounds counts, since other work on the machine only ever adds.
"""

from __future__ import annotations

import time

import numba
import numpy as np
from scipy.spatial import cKDTree

from simplexmesh.motion.targets.points import Points


def torus(n, rng, R=1.0, r=0.35):
    u, v, w = rng.uniform(0, 2 * np.pi, n), rng.uniform(0, 2 * np.pi, n), rng.uniform(0, 1, n)
    keep = w < (R + r * np.cos(v)) / (R + r)
    u, v = u[keep], v[keep]
    out = np.cos(v), np.sin(v)
    normals = np.stack([out[0] * np.cos(u), out[0] * np.sin(u), out[1]], axis=1)
    ring = np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)
    return R * ring + r * normals, normals


def best(function, rounds):
    wall = []
    for _ in range(rounds):
        start = time.perf_counter()
        function()
        wall.append(time.perf_counter() - start)
    return min(wall)


def sorted_along_curve(points, normals):
    """Vertices as a mesh holds them: neighbors near in memory."""
    u, v = np.arctan2(points[:, 1], points[:, 0]), points[:, 2]
    order = np.lexsort((v, np.floor(u * 40)))
    return points[order], normals[order]


def main():
    rng = np.random.default_rng(0)
    diagonal = float(np.sqrt(2 * 2.7**2 + 0.7**2))
    print(f"{'points':>8} {'noise':>6} {'off':>6} {'threads':>7} {'ours ns':>8} {'kd-tree ns':>10} {'ratio':>6}")
    for n, noise in ((20_000, 0.0), (20_000, 0.002), (20_000, 0.01), (200_000, 0.002)):
        points = torus(2 * n, rng)[0][:n]
        points += rng.normal(size=points.shape) * noise * diagonal
        target, tree = Points(points), cKDTree(points)
        places, normals = sorted_along_curve(*torus(20_000, rng))
        for off in (0.0, 0.02):
            vertices = places + off * diagonal * normals * np.sin(9 * places[:, :1])
            for threads in (1, numba.config.NUMBA_NUM_THREADS):
                numba.set_num_threads(threads)
                workers = 1 if threads == 1 else -1
                target.gap(vertices, normals, 0.3)
                ours = best(lambda t=target, v=vertices, n=normals: t.gap(v, n, 0.3), 40) / len(vertices) * 1e9
                peer = best(lambda t=tree, v=vertices, w=workers: t.query(v, workers=w), 15) / len(vertices) * 1e9
                print(f"{n:8} {noise:6.3f} {off:6.2f} {threads:7} {ours:8.0f} {peer:10.0f} {peer / ours:6.1f}")
        numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
        build = best(lambda p=points: Points(p), 4)
        print(
            f"{n:8} {noise:6.3f} built in {build:.3f} s, {len(target.surfels)} surfels; kd-tree "
            f"{best(lambda p=points: cKDTree(p), 3):.3f} s"
        )


if __name__ == "__main__":
    main()
