"""Cost of the data force of points in whole reconstructions, including the first iterations from afar.

The peer is one `scipy.spatial.cKDTree.query` of the same vertices on a tree of the same points, with all cores, right
after each of our calls; both are summed over all iterations. The median of the ratios of single calls is less affected
by other load on the machine. Run: python tests/benchmarks/bench_points_in_motion.py, with
SIMPLEXMESH_DATA set for the kitten.
"""

from __future__ import annotations

import os
import time
import warnings
from pathlib import Path

import numpy as np
from bench_quality import Torus
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.motion.targets.points import SurfelTarget


def clouds(rng):
    """Yield name, points and sizes of model of each job."""
    for count, noise, sizes in (
        (20_000, 0.0, (1000, 4000, 12_000)),
        (20_000, 0.01, (4000, 12_000)),
        (200_000, 0.002, (12_000,)),
    ):
        points = Torus().sampled(count, rng)
        points = points + rng.normal(scale=max(noise, 1e-12) * 3.88, size=points.shape)
        yield f"{count:7,} points, noise {noise:.1%}", points, sizes
    if folder := os.environ.get("SIMPLEXMESH_DATA"):
        yield "kitten, 5,210 points     ", sm.read_points(Path(folder) / "kitten.xyz"), (3000,)


def timed(function, *arguments, **options):
    """Return the seconds a call takes, and its answer."""
    start = time.perf_counter()
    answer = function(*arguments, **options)
    return time.perf_counter() - start, answer


def main():
    """Print one row per cloud and size of model."""
    warnings.simplefilter("ignore")
    original, trees, seen = SurfelTarget.gap, [], []

    def gap(self, vertices, normals, reach):
        ours, answer = timed(original, self, vertices, normals, reach)
        peer, _ = timed(trees[-1].query, np.array(vertices), workers=-1)
        seen.append((ours / len(vertices), peer / len(vertices)))
        return answer

    SurfelTarget.gap = gap
    for name, points, sizes in clouds(np.random.default_rng(1)):
        trees.append(cKDTree(points if isinstance(points, np.ndarray) else points.points))
        for vertices in sizes:
            for _ in range(2):
                seen.clear()
                sm.reconstruct(points, vertices=vertices)
            each = 1e9 * np.array(seen)
            ours, peer = each.mean(axis=0)
            print(
                f"{name}, {vertices:6,} vertices, {len(seen)} calls: {ours:4.0f} ns, kd-tree {peer:4.0f} ns, "
                f"ratio {peer / ours:.1f}, median {np.median(each[:, 1] / each[:, 0]):.1f}, first call "
                f"{each[0, 1] / each[0, 0]:.1f}"
            )


if __name__ == "__main__":
    main()
