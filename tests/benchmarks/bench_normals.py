"""What normals cost and how good they are: vertices a second on one core beside peers, mean errors in degrees.

Run with `NUMBA_NUM_THREADS=1 python tests/benchmarks/bench_normals.py`; half a minute.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

os.environ.setdefault("NUMBA_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import igl
import numpy as np
import pyvista

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from simplexmesh.bench.truth.discretized import torus
from simplexmesh.bench.truth.noise import unit_of
from simplexmesh.surface.normals.estimate import METHODS, found_normals
from simplexmesh.surface.sampled_surface import as_sampled_surface

ROUNDS = 7
NOISE = (0.0, 0.01, 0.1)
WIDER = [("quadric", k) for k in (2, 3)] + [("extended_sine", k) for k in (2, 3)] + [("plane", k) for k in (2, 3)]


def seconds(function, rounds: int = ROUNDS) -> float:
    """Return the least time of one call."""
    function()
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def degrees(normals: np.ndarray, truth: np.ndarray) -> float:
    """Return the mean angle between estimates and the truth."""
    cosine = np.clip((np.asarray(normals) * truth).sum(axis=1), -1, 1)
    return float(np.degrees(np.arccos(cosine)).mean())


def of_igl(vertices: np.ndarray, faces: np.ndarray, weighting: int) -> np.ndarray:
    """Return libigl's vertex normals: by area (1) or angle (2)."""
    return igl.per_vertex_normals(vertices, faces, weighting)


def of_pyvista(mesh: pyvista.PolyData) -> np.ndarray:
    """Return VTK's vertex normals as PyVista asks for them."""
    out = mesh.compute_normals(
        cell_normals=False, split_vertices=False, consistent_normals=False, auto_orient_normals=False
    )
    return np.asarray(out.point_data["Normals"])


def print_rates() -> None:
    """Print vertices a second at the one-ring of a torus of 100,000 vertices, neighbors known, and ratios to peers."""
    mesh = sm.torus(400, 250).triangulated("dual")
    samples = as_sampled_surface(mesh)
    around = samples.one_ring
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    polygons = pyvista.PolyData.from_regular_faces(vertices, faces)
    peers = {
        "igl, area": seconds(lambda: of_igl(vertices, faces, 1)),
        "pyvista": seconds(lambda: of_pyvista(polygons)),
    }
    print(f"{len(vertices):,} vertices, one-ring, one core; the time of peers over ours")
    print("| method | vertices a second |", " | ".join(peers), "|\n| --- | --- |" + " --- |" * len(peers))
    cases = [(name, {}) for name in METHODS] + [
        ("plane", {"variant": "svd4"}),
        ("extended_sine", {"solver": "ternary"}),
    ]
    for name, options in cases:
        rounds = 1 if options.get("solver") == "ternary" else ROUNDS
        ours = seconds(lambda name=name, options=options: found_normals(samples, around, name, **options), rounds)
        ratios = " | ".join(f"{theirs / ours:.2f}" for theirs in peers.values())
        print(f"| {' '.join([name, *options.values()])} | {len(vertices) / ours:,.0f} | {ratios} |", flush=True)
    for name, theirs in peers.items():
        print(f"| {name} | {len(vertices) / theirs:,.0f} | |")
    rings = seconds(lambda: as_sampled_surface(mesh).one_ring)
    print(f"ordering the rings: {len(vertices) / rings:,.0f} vertices a second")
    for radius in (1.5, 3.0):
        asked = sm.ball(radius * unit_of(mesh, "edge"), connected=False)
        balls = seconds(lambda asked=asked: samples.around(asked), 3)
        print(f"balls of {radius} edges: {len(vertices) / balls:,.0f} vertices a second")


def print_errors() -> None:
    """Print mean errors on an irregular torus of 10,000 vertices, clean and with noise in mean edges."""
    ring = torus(160, 64, irregular=True)
    step, rng = unit_of(ring.mesh, "edge"), np.random.default_rng(0)
    clouds = [ring.vertices + noise * step * rng.normal(size=ring.vertices.shape) for noise in NOISE]
    print(f"\n{len(ring.vertices):,} vertices, irregular torus: mean error in degrees, noise in mean edges")
    print(
        "| method | rings |",
        " | ".join(f"{noise:.0%}" for noise in NOISE),
        "| failed |\n|" + " --- |" * (3 + len(NOISE)),
    )
    truth = ring.exact.normals
    for name, rings in [*((name, 1) for name in METHODS), *WIDER]:
        wide = {} if rings == 1 else {"neighborhood": sm.rings(rings)}
        errors = []
        for points in clouds:
            samples = as_sampled_surface((points, ring.faces))
            around = samples.around(wide.get("neighborhood", sm.rings(1)))
            found = found_normals(samples, around, name)
            known = found.reasons == 0
            errors.append(degrees(found.normals[known], truth[known]))
            failed = 1 - known.mean()
        print(f"| {name} | {rings} | {' | '.join(f'{error:.2f}' for error in errors)} | {failed:.1%} |", flush=True)
    for name, weighting in (("igl, area", 1), ("igl, angle", 2)):
        errors = [degrees(of_igl(points, np.array(ring.faces), weighting), truth) for points in clouds]
        print(f"| {name} | 1 | {' | '.join(f'{error:.2f}' for error in errors)} | 0.0% |")


def main() -> None:
    print_rates()
    print_errors()


if __name__ == "__main__":
    main()
