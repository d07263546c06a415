"""What the data force of points costs during whole reconstructions, far first iterations included, against a kd-tree.

The peer is one `scipy.spatial.cKDTree.query` of the same vertices on a tree of the same points, with all cores, asked
at every tenth iteration. Run: python tests/benchmarks/bench_points_in_motion.py
"""

from __future__ import annotations

import time
import warnings

import numpy as np
from bench_quality import Torus
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.motion.targets.points import SurfelTarget


def main():
    """Print one row per cloud and size of model."""
    warnings.simplefilter("ignore")
    rng = np.random.default_rng(1)
    original, seen = SurfelTarget.gap, []

    def gap(self, vertices, normals, reach):
        start = time.perf_counter()
        answer = original(self, vertices, normals, reach)
        seen.append((time.perf_counter() - start, np.array(vertices)))
        return answer

    SurfelTarget.gap = gap
    for count, noise, sizes in (
        (20_000, 0.0, (4000, 12_000)),
        (20_000, 0.01, (4000, 12_000)),
        (200_000, 0.002, (12_000,)),
    ):
        points = Torus().sampled(count, rng)
        points = points + rng.normal(scale=max(noise, 1e-12) * 3.88, size=points.shape)
        tree = cKDTree(points)
        for vertices in sizes:
            for _ in range(2):
                seen.clear()
                sm.reconstruct(points, vertices=vertices)
            ours = sum(seconds for seconds, _ in seen[::10])
            start = time.perf_counter()
            for _, places in seen[::10]:
                tree.query(places, workers=-1)
            peer = time.perf_counter() - start
            each = 1e9 / vertices / len(seen[::10])
            print(
                f"{count:7,} points, noise {noise:.1%}, {vertices:6,} vertices: {ours * each:4.0f} ns, "
                f"kd-tree {peer * each:4.0f} ns, ratio {peer / ours:.1f}"
            )


if __name__ == "__main__":
    main()
