"""Point target against SciPy's kd-tree: nanoseconds per vertex and call, and what building costs.

Run as ``python tests/benchmarks/bench_points_target.py``. Both run in this process by turns, one thread and all, on the
same vertices, which are `off` the surface and make a `step` in a random direction before each call, both in diagonals.
The best of several rounds counts, since other work on the machine only ever adds; `median` is that of the rounds'
ratios. `first` is the ratio for vertices never asked about.
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


def walk(places, step, rounds, rng):
    """Return where vertices are in each round."""
    moves = rng.normal(size=(rounds, *places.shape))
    moves *= step / np.linalg.norm(moves, axis=2, keepdims=True)
    return places + np.cumsum(moves, axis=0)


def compared(target, tree, rounds, normals, workers):
    """Return nanoseconds per vertex, in each round, of ours and of the tree."""
    out = np.zeros((len(rounds), 2))
    for i, vertices in enumerate(rounds):
        start = time.perf_counter()
        target.gap(vertices, normals, 0.3)
        middle = time.perf_counter()
        tree.query(vertices, workers=workers)
        out[i] = middle - start, time.perf_counter() - middle
    return out * 1e9 / len(normals)


def main():
    rng, every = np.random.default_rng(0), numba.config.NUMBA_NUM_THREADS
    diagonal = float(np.sqrt(2 * 2.7**2 + 0.7**2))
    print("  points  noise   off   step threads  ours ns  kd-tree ns  ratio  median  first")
    for n, noise in ((20_000, 0.0), (20_000, 0.002), (20_000, 0.01), (200_000, 0.002)):
        points = torus(2 * n, rng)[0][:n]
        points += rng.normal(size=points.shape) * noise * diagonal
        target, tree = Points(points), cKDTree(points)
        places, normals = sorted_along_curve(*torus(20_000, rng))
        for off, step in ((0.0, 0.0), (0.0, 0.001), (0.02, 0.0), (0.02, 0.001)):
            vertices = places + off * diagonal * normals * np.sin(9 * places[:, :1])
            for threads in (1, every):
                numba.config.NUMBA_NUM_THREADS = threads
                target.gap(vertices[:1], normals[:1], 0.3)  # forgets the others
                rounds = walk(vertices, step * diagonal, 30, rng)
                each = compared(target, tree, rounds, normals, 1 if threads == 1 else -1)
                ours, peer = each[1:].min(axis=0)
                ratio = each[:, 1] / each[:, 0]
                print(
                    f"{n:8} {noise:6.3f} {off:5.2f} {step:6.3f} {threads:7} {ours:8.0f} {peer:11.0f} "
                    f"{peer / ours:6.1f} {np.median(ratio[1:]):7.1f} {ratio[0]:6.1f}"
                )
        build = best(lambda p=points: Points(p), 4)
        print(
            f"{n:8} {noise:6.3f} built in {build:.3f} s, {len(target._surfels.table)} surfels; kd-tree "
            f"{best(lambda p=points: cKDTree(p), 3):.3f} s"
        )


if __name__ == "__main__":
    main()
