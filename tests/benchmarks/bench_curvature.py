"""What curvature costs: vertices a second, rings and normals included, against peers run in the same process.

Run with `python tests/benchmarks/bench_curvature.py [method ...] [--million]`; half a minute, on one thread unless
NUMBA_NUM_THREADS says otherwise. With `--million` the mesh has a million vertices, and memory is told too.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("NUMBA_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[2]))

import igl
import numpy as np
import pyvista

import simplexmesh as sm
from simplexmesh.surface.curvature.estimate import METHODS
from simplexmesh.surface.sampled_surface import as_sampled_surface


def best(function: Callable[[], object], rounds: int = 3) -> float:
    """Return the least time of one call in seconds, after a warm-up."""
    function()
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def peers(mesh: sm.TriangleMesh) -> dict[str, Callable[[], object]]:
    """Other programs' estimators, on the same triangles."""
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    poly = pyvista.PolyData.from_regular_faces(vertices, faces)

    def cotangents() -> object:
        laplacian, mass = igl.cotmatrix(vertices, faces), igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_VORONOI)
        return laplacian @ vertices / mass.diagonal()[:, None], igl.gaussian_curvature(vertices, faces)

    return {
        "igl.principal_curvature, 2 rings": lambda: igl.principal_curvature(vertices, faces, 2),
        "igl.principal_curvature, 5 rings": lambda: igl.principal_curvature(vertices, faces, 5),
        "igl cotangents and angle defects": cotangents,
        "VTK mean curvature": lambda: poly.curvature("mean"),
        "VTK Gaussian curvature": lambda: poly.curvature("gaussian"),
    }


def main(names: list[str], *, million: bool) -> None:
    around, across = (1250, 800) if million else (400, 250)
    mesh = sm.torus(around, across).triangulated("dual")
    n, rounds = len(mesh.vertices), 1 if million else 3
    threads = os.environ["NUMBA_NUM_THREADS"]
    print(f"torus of {n:,} vertices, {threads} thread\n\n| method | ns per vertex | vertices a second |")
    print("| --- | ---: | ---: |")

    def row(name: str, seconds: float) -> float:
        print(f"| {name} | {1e9 * seconds / n:,.0f} | {n / seconds:,.0f} |", flush=True)
        return seconds

    row("rings alone", best(lambda: as_sampled_surface(mesh).one_ring, rounds))
    ours = {name: row(name, best(lambda name=name: sm.curvature(mesh, name), rounds)) for name in names}
    theirs = {} if million else {name: row(name, best(call, 1)) for name, call in peers(mesh).items()}
    for peer, seconds in theirs.items():
        ratios = ", ".join(f"{name} {seconds / own:.1f}" for name, own in ours.items())
        print(f"\n{peer}: its time over ours: {ratios}")
    if million:
        print(f"\ngreatest memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.2f} GiB")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("methods", nargs="*", default=[name for name in METHODS if not METHODS[name].own_scale])
    parser.add_argument("--million", action="store_true", help="a million vertices; no peers")
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    main(asked.methods, million=asked.million)
