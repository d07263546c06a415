"""The tables of `docs/saliency.md`, and times beside windows of straight distance from a tree, as in the paper.

Run as `python tests/benchmarks/bench_saliency.py [times | points | classes | foramen]`; two minutes. Noise is of every
coordinate, in edges, three seeds: least to most. Points: of bumps on a ball, their places in the list of those found.
Classes: a vertex is right if its class is that of the exact H and K, where an H within a tenth of the curvedness of
zero, or a K within a tenth of its square, may be called zero too. Foramen: a bore with a rounded rim, five picks.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from simplexmesh.bench.truth.discretized import Discretized, split_square, torus, uv_cylinder
from simplexmesh.bench.truth.graphs import graph
from simplexmesh.bench.truth.noise import noisy
from simplexmesh.surface.saliency import hk_classes as hk
from simplexmesh.surface.saliency.diffusion import Diffusion
from simplexmesh.surface.saliency.noise import smallest_window
from simplexmesh.surface.sampled_surface import as_sampled_surface
from tests.surface.landmarks.test_landmarks import sheet_with_a_hole
from tests.surface.saliency.test_saliency import ball, bump_of, bumpy, turned

SEEDS = range(3)


def timed(function, repeats=3):
    """The least time of several runs, in seconds."""
    best = np.inf
    for _ in range(repeats):
        began = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - began)
    return best


def straight(mesh, field, scales):
    """Means over all vertices within two widths, weighted by exp(-d^2 / 2 s^2): a tenth of the vertices."""
    tree, some = cKDTree(mesh.vertices), np.arange(0, mesh.n_vertices, 10)
    for scale in scales:
        for i, near in zip(some, tree.query_ball_point(mesh.vertices[some], 2 * scale, workers=-1), strict=True):
            weights = np.exp(-((mesh.vertices[near] - mesh.vertices[i]) ** 2).sum(axis=1) / (2 * scale**2))
            weights @ field[near] / weights.sum()


def points() -> None:
    """Print which bumps are found on balls, and how much is found where there are none."""
    for frequency in (24, 48):
        for noise in (0.0, 0.1):
            found = [sm.salient_points(noisy(bumpy(frequency), noise, rng=seed), of="mean") for seed in SEEDS]
            places = [bump_of(each.points) for each in found]
            print(f"bumps, {ball(frequency).n_vertices:,} vertices, noise {noise:.0%}: {places}", flush=True)
    for noise in (0.01, 0.1, 0.3):
        for of in ("magnitude", "saliency"):
            found = [len(sm.salient_points(noisy(ball(32), noise, rng=seed), of=of)) for seed in SEEDS]
            print(f"no bumps, {ball(32).n_vertices:,} vertices, noise {noise:.0%}, of {of}: {found}", flush=True)


def surfaces() -> dict[str, Discretized]:
    """Return the surfaces that are classified."""
    return {
        "torus, 560 vertices": torus(40, 14, irregular=True, rng=0),
        "torus, 2,520": torus(84, 30, irregular=True, rng=0),
        "thin torus, 1,000": torus(100, 10, tube_radius=0.1, irregular=True, rng=0),
        "monkey saddle, 529": split_square(graph("monkey_saddle"), 22),
        "thin tube, 8,100": uv_cylinder(48, 168, 0.5, 10.0),
    }


def right(made: Discretized, noise: float, seed: int) -> float:
    """Return the share of the vertices that are called what they are."""
    H, K = made.exact.mean, made.exact.gauss
    near = 0.1 * np.sqrt(np.maximum(2 * H**2 - K, 0))
    labels = sm.hk_classes(noisy(made.mesh, noise, rng=seed)).labels
    zero = np.zeros_like(H)
    exact = [hk.signs(h, k, zero + 1e-9, zero + 1e-9) for h in (H, np.where(abs(H) < near, 0, H))
             for k in (K, np.where(abs(K) < 10 * near**2, 0, K))]  # fmt: skip
    return float(np.any([labels == each for each in exact], axis=0)[made.inner].mean())


def classes() -> None:
    """Print the shares of vertices that are classified rightly, in %."""
    for name, made in surfaces().items():
        cells = []
        for noise in (0.0, 0.01, 0.1, 0.2):
            shares = [100 * right(made, noise, seed) for seed in (SEEDS if noise else (0,))]
            cells.append(f"{min(shares):.0f} to {max(shares):.0f}")
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def foramen() -> None:
    """Print how far the center of a rim is off, in radii of the hole, with picks around it."""
    off = []
    for tilt in range(5):
        mesh, center, axis = sheet_with_a_hole(tilt=tilt)
        found = sm.rim_circle(mesh, center + 0.1 * turned(tilt + 5)[0], radius=0.8)
        away = found.center - center
        off.append(float(np.linalg.norm(away - (away @ axis) * axis)) / 0.5)
    print(f"rim of a hole: center off by {np.mean(off):.2%} ({min(off):.2%} to {max(off):.2%}) of its radius")


def times():
    for around, across in ((200, 100), (400, 250)):
        mesh = sm.torus(around, across).triangulated("dual")
        curvature = sm.curvature(mesh, "sine")
        diffusion = Diffusion(as_sampled_surface(mesh))
        smallest = smallest_window(diffusion)
        scales = [smallest * k for k in (1, 1.5, 2, 2.5, 3, 4, 5, 6)]
        n = mesh.n_vertices
        ours = timed(lambda mesh=mesh, curvature=curvature: sm.saliency(mesh, curvature=curvature))
        peer = 10 * timed(lambda mesh=mesh, field=curvature.mean, scales=scales: straight(mesh, field, scales), 1)
        points = timed(lambda mesh=mesh, curvature=curvature: sm.salient_points(mesh, curvature=curvature))
        kinds = timed(lambda mesh=mesh, curvature=curvature: sm.hk_classes(mesh, curvature=curvature))
        per = 1e9 / n
        print(f"{n:,} vertices, smallest window {smallest / diffusion.spacing:.1f} edges")
        print(f"  saliency {ours * per:7.0f} ns   windows from a tree {peer * per:9.0f} ns   ratio {peer / ours:.0f}")
        print(f"  salient points {points * per:7.0f} ns   HK classes {kinds * per:7.0f} ns")


if __name__ == "__main__":
    parts = {"times": times, "points": points, "classes": classes, "foramen": foramen}
    for part in sys.argv[1:] or parts:
        parts[part]()
