"""How exact curvature and normals are at no options at all, beside peers run in the same process.

Every column is an irregular or regular torus (R 1, r 0.35; the ellipsoid for K), seeded, with the same noise for all:
relative L2 error of H and K, mean error of normals, what the expected error is worth (the median of actual over
expected error, 1 if errors were normal and the expectation right), and CPU microseconds a vertex on one thread.
Run with `python tests/benchmarks/bench_adaptive.py [--rounds 3] [--no-peers]`; a minute.
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

import igl
import numpy as np

import simplexmesh as sm
from simplexmesh.bench.truth import discretized
from simplexmesh.bench.truth.graphs import graph
from simplexmesh.bench.truth.noise import noisy

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


def peers(mesh: sm.TriangleMesh) -> dict[str, Callable[[], tuple[np.ndarray, np.ndarray]]]:
    """H and K by libigl."""
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)

    def rings(radius: int) -> tuple[np.ndarray, np.ndarray]:
        k1, k2 = igl.principal_curvature(vertices, faces, radius, True)[2:4]
        return (k1 + k2) / 2, k1 * k2

    def cotangents() -> tuple[np.ndarray, np.ndarray]:
        mass = igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_VORONOI).diagonal()
        force = -(igl.cotmatrix(vertices, faces) @ vertices) / mass[:, None] / 2
        mean = np.linalg.norm(force, axis=1) * np.sign((force * mesh.vertex_normals).sum(axis=1))
        return mean, igl.gaussian_curvature(vertices, faces) / mass

    return {"igl, radius 3": lambda: rings(3), "igl, radius 5": lambda: rings(5), "igl cotangents": cotangents}


def line(name: str, cells: list[str]) -> None:
    """Print a row."""
    print(f"  {name:<16}" + "".join(f"{cell:>10}" for cell in cells), flush=True)


def measured(made: discretized.Discretized, mesh: sm.TriangleMesh, *, rounds: int, others: bool) -> None:
    """Print what everybody finds on one mesh."""
    truth, n = made.exact, len(made.vertices)
    found, seconds = timed(lambda: sm.curvature(mesh), rounds)
    apart = np.abs(found.mean - truth.mean) / np.maximum(found.error, 1e-300)
    cells = [f"{off(found.mean, truth.mean):.5f}", f"{off(found.gauss, truth.gauss):.4f}"]
    cells += [f"{degrees(found.normals, truth.normals):.4f}", f"{np.median(apart) / NORMAL:.2f}"]
    line("adaptive", [*cells, f"{seconds / n * 1e6:.1f}"])
    for name, call in peers(mesh).items() if others else ():
        (mean, gauss), seconds = timed(call, 1)
        cells = [f"{off(mean, truth.mean):.3f}", f"{off(gauss, truth.gauss):.3f}", "", ""]
        line(name, [*cells, f"{seconds / n * 1e6:.1f}"])


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
    print("borders" + " " * 11 + "".join(f"{cell:>10}" for cell in ("inside", "rim", "igl 5 in", "igl 5 rim")))
    for name, (vertices, faces, mean, on_rim) in (("cut torus", torus), ("graph", flat)):
        for amount in (0.0, 0.01, 0.1):
            mesh = noisy(sm.TriangleMesh(vertices, faces), amount, rng=1)
            cells = []
            for found in (sm.curvature(mesh).mean, peers(mesh)["igl, radius 5"]()[0]):
                error = (found - mean) / np.sqrt((mean**2).mean())
                cells += [f"{np.sqrt((error[part] ** 2).mean()):.5f}" for part in (~on_rim, on_rim)]
            line(f"{name}, {100 * amount:g} %", cells)


def main(*, rounds: int, others: bool) -> None:
    """Print all columns."""
    sm.curvature(discretized.torus(60, 24, irregular=True).mesh)
    line("", ["H", "K", "normals", "error", "us"])
    for title, irregular, amount, unit, sizes in COLUMNS:
        for size in sizes:
            made = discretized.torus(*SIZES[size], irregular=irregular)
            mesh = noisy(made.mesh, amount, unit=unit, rng=1)
            print(f"{title}, {size}")
            measured(made, mesh, rounds=rounds, others=others)
    for amount in (0.0, 0.1):
        made = discretized.ellipsoid(100, 100, irregular=True)
        print(f"ellipsoid, {100 * amount:g} % of an edge, 10k")
        measured(made, noisy(made.mesh, amount, rng=1), rounds=rounds, others=others)
    at_borders()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--no-peers", action="store_true")
    given = parser.parse_args()
    main(rounds=given.rounds, others=not given.no_peers)
