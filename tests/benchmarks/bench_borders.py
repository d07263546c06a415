"""How near the curvature at borders comes to the best that any estimate can do.

Heights are random surfaces, stationary Gaussian processes with the covariance a^2 exp(-r^2 / 2 l^2), for which the best
estimate of H from noisy heights is known: the linear one of least variance, which is told the covariance (kriging).
Its error in the interior and on a straight border is set beside that of `sm.curvature`, all as shares of the root mean
square of H. Before that come cuts through the torus of the peers' table, and graphs, for which no best estimate is
known. Run with `python tests/benchmarks/bench_borders.py`; two minutes.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[2]))

import igl
import numpy as np
from scipy.linalg import cho_factor, cho_solve

import simplexmesh as sm
from simplexmesh.surface.truth import discretized
from simplexmesh.surface.truth.graphs import graph, random_graph
from simplexmesh.surface.truth.noise import noisy, unit_of

SEEDS = 3
NOISES = (0.0, 0.003, 0.01, 0.03, 0.1)
ROWS = 80
SPACING = 2 / ROWS
BENDING = 1 / 40  # standard deviation of second derivatives across the spacing
REACH, REACH_PER_LENGTH = 16, 1.6  # spacings around the point that the best estimate sees, at least
WITHIN = 12  # spacings from the border where the interior begins
CUTS = {"through the axis": (1.0, 0.0, 0.0), "through it, turned": (0.6, 0.8, 0.0), "aslant": (0.5, 0.3, 0.8)}


def best_possible(made: discretized.Discretized, length: float, noise: float, *, border: bool) -> float:
    """Error of the best linear estimate of H at the middle of the mesh or of its lower border, as a share of H.

    H is taken to be half the Laplacian, as at small slopes (here 0.09 to 0.26, the more the larger the length). Without
    noise a little is assumed, as the system is singular then.
    """
    places = made.vertices[:, :2] / SPACING
    target = np.array([0.0, places[:, 1].min() if border else 0.0])
    places = places - places[((places - target) ** 2).sum(axis=1).argmin()]
    reach = max(REACH, REACH_PER_LENGTH * length)
    places = places[(places**2).sum(axis=1) <= reach**2]
    squares = ((places[:, None] - places) ** 2).sum(axis=2)
    size = BENDING * length**2 / np.sqrt(3)
    deviation = max(noise * unit_of(made.mesh, "edge") / SPACING, 1e-5)
    heights = size**2 * np.exp(-squares / (2 * length**2)) + deviation**2 * np.eye(len(places))
    away = (places**2).sum(axis=1) / length**2
    shared = size**2 * np.exp(-away / 2) * (away - 2) / (2 * length**2)
    whole = 2 * size**2 / length**4
    return float(np.sqrt(max(1 - shared @ cho_solve(cho_factor(heights), shared) / whole, 0.0)))


def errors(
    made: discretized.Discretized, noise: float, inside: np.ndarray, rim: np.ndarray, seed: int, *, peers: bool = False
) -> np.ndarray:
    """Root mean square errors of H inside and on the rim, as shares of that of H; then of igl's inside."""
    mesh = noisy(made.mesh, noise, rng=seed + 1) if noise else made.mesh
    found = sm.curvature(mesh)
    error, there = found.mean - made.exact.mean, ~found.failed
    parts = [error[inside & there], error[rim & there]]
    for radius in (3, 5) if peers else ():
        k1, k2 = igl.principal_curvature(np.array(mesh.vertices), np.array(mesh.faces), radius, True)[2:4]
        parts.append(((k1 + k2) / 2 - made.exact.mean)[inside])
    return np.array([np.sqrt((part**2).mean()) for part in parts]) / np.sqrt((made.exact.mean**2).mean())


def on_random_surfaces() -> None:
    """Print errors beside igl's and the best possible ones."""
    print(f"{'random surfaces':>24}{'inside':>10}{'rim':>10}{'ratio':>8}   igl 3, 5 inside | best: inside, rim, ratio")
    for length in (6.0, 9.0, 12.0, 18.0):
        for noise in NOISES:
            rows = []
            for seed in range(SEEDS):
                made = discretized.sawtooth(random_graph(length * SPACING, BENDING / SPACING, seed), ROWS)
                x, y = np.abs(made.vertices[:, :2]).T
                reach_x, reach_y = (x.max() - x) / SPACING, (y.max() - y) / SPACING
                near, far = np.minimum(reach_x, reach_y), np.maximum(reach_x, reach_y)
                rim = ~made.inner & (far > WITHIN)
                rows.append(errors(made, noise, near > WITHIN, rim, seed, peers=True))
            inside, rim, third, fifth = np.mean(rows, axis=0)
            best = [best_possible(made, length, noise, border=border) for border in (False, True)]
            print(
                f"{f'l = {length:g}, {100 * noise:g} %':>24}{inside:10.5f}{rim:10.4f}{rim / inside:8.1f}"
                f"   {third:.4f} {fifth:.4f} | {best[0]:.4f} {best[1]:.4f} {best[1] / best[0]:.1f}",
                flush=True,
            )


def on_cut_tori_and_graphs() -> None:
    """Print errors on half an irregular torus (R 1, r 0.35) and on known graphs."""
    for name, normal in CUTS.items():
        for noise in NOISES:
            rows = []
            for seed in range(SEEDS):
                ring = discretized.torus(168, 60, irregular=True, rng=seed)
                made = discretized.cut(ring, ring.vertices @ np.array(normal) > 0)
                rows.append(errors(made, noise, made.inner, ~made.inner, seed))
            inside, rim = np.mean(rows, axis=0)
            print(f"{f'{name}, {100 * noise:g} %':>24}{inside:10.4f}{rim:10.4f}{rim / inside:8.1f}")
    for name in ("trigonometric", "exponential", "monkey_saddle"):
        made = discretized.split_square(graph(name), ROWS)
        for noise in NOISES:
            inside, rim = np.mean([errors(made, noise, made.inner, ~made.inner, s) for s in range(SEEDS)], axis=0)
            print(f"{f'{name}, {100 * noise:g} %':>24}{inside:10.4f}{rim:10.4f}{rim / inside:8.1f}")


if __name__ == "__main__":
    on_cut_tori_and_graphs()
    on_random_surfaces()
