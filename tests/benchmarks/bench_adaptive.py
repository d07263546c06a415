"""How exact curvature and normals are at no options at all, beside peers run in the same process.

Run: python tests/benchmarks/bench_adaptive.py [--no-peers] [--borders | --random] [--store]; four minutes.
Peers that are not installed are said and left out. What the expected error is worth is the median of actual over
expected error: 1 if errors were normal and the expectation right.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("NUMBA_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # its threads spin for a while when their work is done
sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import simplexmesh as sm
from simplexmesh.bench.truth import discretized
from simplexmesh.bench.truth.graphs import graph
from simplexmesh.bench.truth.noise import noisy
from tests.bench.random_graph import random_graph
from tests.benchmarks.curvature_peers import OPTIONAL, peers, rings
from tests.benchmarks.figures import Figures, installed

PROTOCOL = """Torus of radii 1 and 0.35 with 2,550, 10,200 or 40,800 vertices on it; irregular: vertices moved on the
surface, quads split at random. Gaussian noise in every coordinate, in shares of the mean edge or of the diagonal; three
draws of it at 2.5k and 10k vertices, one at 41k. Relative L2 error of H, mean error of normals, processor time per
vertex on one thread. No parameters for ours, one setting for all columns for the others."""
SIZES = {"2.5k": (85, 30), "10k": (170, 60), "41k": (340, 120)}
COLUMNS = [
    ("regular, clean", False, 0.0, "edge", ("2.5k", "10k", "41k")),
    ("irregular, clean", True, 0.0, "edge", ("2.5k", "10k", "41k")),
    ("irregular, 1 % of an edge", True, 0.01, "edge", ("2.5k", "10k", "41k")),
    ("irregular, 10 % of an edge", True, 0.1, "edge", ("2.5k", "10k", "41k")),
    ("irregular, 1 % of the diagonal", True, 0.01, "diagonal", ("10k",)),
]
NORMAL = 0.6745  # the median of a normal variable's absolute value


def timed(function: Callable[[], object], rounds: int) -> tuple[object, float]:
    """Return the last answer and the least CPU time of a call in seconds."""
    times = []
    for _ in range(rounds):
        start = time.process_time()
        out = function()
        times.append(time.process_time() - start)
    return out, min(times)


def off(found: np.ndarray, exact: np.ndarray) -> float:
    """Relative L2 error over the vertices where there is an answer."""
    there = np.isfinite(found)
    return float(np.linalg.norm((found - exact)[there]) / np.linalg.norm(exact[there]))


def degrees(found: np.ndarray, exact: np.ndarray) -> float:
    """Mean angle between unit vectors."""
    return float(np.degrees(np.arccos(np.clip(np.nansum(found * exact, axis=1), -1, 1))).mean())


def line(name: str, cells: list[str]) -> None:
    """Print a row."""
    print(f"  {name:<16}" + "".join(f"{cell:>20}" for cell in cells), flush=True)


def told(figures: Figures, column: str, truth, meshes: list[sm.TriangleMesh], others: dict) -> None:
    """Keep what everybody finds on meshes that differ by the draw of the noise."""
    n, rows = len(truth.mean), []
    for mesh in meshes:
        found, seconds = timed(lambda: sm.curvature(mesh), 1)  # noqa: B023
        apart = np.abs(found.mean - truth.mean) / np.maximum(found.error, 1e-300)
        errors = off(found.mean, truth.mean), off(found.gauss, truth.gauss), degrees(found.normals, truth.normals)
        rows.append((*errors, np.median(apart) / NORMAL, seconds / n * 1e6))
    units = {"H": "", "K": "", "normals": "degrees", "actual over expected error": "", "time": "us"}
    for (what, unit), values in zip(units.items(), zip(*rows, strict=True), strict=True):
        figures.add(f"{column}, adaptive, {what}", values, unit)
    for name, call in others.items():
        answers = [timed(lambda: call(mesh), 1) for mesh in meshes]  # noqa: B023
        figures.add(f"{column}, {name}, H", [off(mean, truth.mean) for mean, _ in answers], "")
        figures.add(f"{column}, {name}, time", [seconds / n * 1e6 for _, seconds in answers], "us")


def cut_torus() -> tuple[discretized.Discretized, np.ndarray, np.ndarray]:
    """Return the 10k torus, the faces of its half y > -0.1, and the vertices on the rim of that."""
    made = discretized.torus(*SIZES["10k"], irregular=True)
    faces = made.faces[(made.vertices[:, 1] > -0.1)[made.faces].all(axis=1)]
    return made, faces, rim(faces, len(made.vertices))


def rim(faces: np.ndarray, n: int) -> np.ndarray:
    """(n,) mask of vertices on edges of one face."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    once, counts = np.unique(edges, axis=0, return_counts=True)
    out = np.zeros(n, bool)
    out[once[counts == 1].ravel()] = True
    return out


def at_borders() -> None:
    """Print errors of H on and off the rim, as shares of the root mean square of H."""
    made, faces, on_rim = cut_torus()
    used = np.zeros(len(on_rim), bool)
    used[faces.ravel()] = True
    shift = np.cumsum(used) - 1
    torus = (made.vertices[used], shift[faces], made.exact.mean[used], on_rim[used])
    square = discretized.split_square(graph("trigonometric"), 80)
    flat = (square.vertices, square.faces, square.exact.mean, ~square.inner)
    line("", ["inside", "rim", "igl 5 in", "igl 5 rim", "of told", "rim"])
    for name, (vertices, faces, mean, on_rim) in (("cut torus", torus), ("graph", flat)):
        mesh, parts = sm.TriangleMesh(vertices, faces), (~on_rim, on_rim)
        for amount in (0.0, 0.01, 0.1):
            draws = [noisy(mesh, amount, rng=draw) for draw in ((1, 2, 3) if amount else (1,))]
            line(f"{name}, {100 * amount:g} %", spread([beside_igl(each, mean, parts) for each in draws]))


def beside_igl(mesh: sm.TriangleMesh, mean: np.ndarray, parts: tuple[np.ndarray, ...]) -> list[float]:
    """Return relative errors of H in parts of a mesh, then libigl's, then actual over expected errors."""
    ours, size = sm.curvature(mesh), np.sqrt((mean**2).mean())
    apart = np.abs(ours.mean - mean) / np.maximum(ours.error, 1e-300) / NORMAL
    errors = [(found - mean) / size for found in (ours.mean, rings(mesh, 5))]
    return [np.sqrt((each[part] ** 2).mean()) for each in errors for part in parts] + [
        np.median(apart[part]) for part in parts
    ]


def spread(rows: list[list[float]]) -> list[str]:
    """Return the least and most of each column."""
    return [f"{min(each):.2g} to {max(each):.2g}" for each in zip(*rows, strict=True)]


def on_random_surfaces() -> None:
    """Print errors of H inside random graphs, by the edges over which heights vary, three of each."""
    line("", ["adaptive", "igl 5", "of told"])
    for amount in (0.0, 0.01, 0.1):
        for edges in (6, 9, 12, 18):
            rows = []
            for seed in range(3):
                made = discretized.sawtooth(random_graph(0.025 * edges, 1.0, seed), 80)
                inner = np.abs(made.vertices[:, :2]).max(axis=1) < 0.7
                rows.append(beside_igl(noisy(made.mesh, amount, rng=seed), made.exact.mean, (inner,)))
            line(f"{edges} edges, {100 * amount:g} %", spread(rows))


def main(*, others: bool) -> None:
    """Tell all columns."""
    sm.curvature(discretized.torus(60, 24, irregular=True).mesh)
    libraries = installed(*OPTIONAL) if others else {}
    programs = peers(libraries) if others else {}
    figures = Figures("adaptive", PROTOCOL, ["libigl", "vtk", *libraries] if others else [])
    for title, irregular, amount, unit, sizes in COLUMNS:
        for size in sizes:
            made = discretized.torus(*SIZES[size], irregular=irregular)
            draws = (1, 2, 3) if amount and size != "41k" else (1,)
            meshes = [noisy(made.mesh, amount, unit=unit, rng=draw) for draw in draws]
            told(figures, f"{title}, {size}", made.exact, meshes, programs)
            figures.keep()
    for amount in (0.0, 0.1):
        made = discretized.ellipsoid(100, 100, irregular=True)
        told(
            figures, f"ellipsoid, {100 * amount:g} % of an edge, 10k", made.exact, [noisy(made.mesh, amount, rng=1)], {}
        )
    figures.keep()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--no-peers", action="store_true")
    parser.add_argument("--borders", action="store_true", help="only the errors at borders")
    parser.add_argument("--random", action="store_true", help="only the errors on random surfaces")
    given = parser.parse_args()
    if given.borders or given.random:
        at_borders() if given.borders else on_random_surfaces()
    else:
        main(others=not given.no_peers)
