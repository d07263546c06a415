"""Cost of the mesh: nanoseconds per vertex, against peers run in the same process.

Run with `python tests/benchmarks/bench_mesh.py`; half a minute.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from simplexmesh.mesh import geometry
from simplexmesh.mesh.triangles.self_intersection import crossing_triangles, self_intersections
from simplexmesh.mesh.triangulation import dual_triangles, fan


def best(function: Callable[[], object], rounds: int = 3) -> float:
    """Return the smallest time of one call in seconds, after a warm-up."""
    function()
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def main(vertices: int = 1_000_000) -> None:
    mesh = sm.sphere(vertices=vertices)
    n, twin = mesh.n_vertices, mesh.connectivity.twin
    points, triangles = dual_triangles(mesh.vertices, mesh.connectivity)
    rng = np.random.default_rng(0)
    shuffled = rng.permutation(triangles)

    def everything() -> sm.Connectivity:
        c = sm.Connectivity(twin)
        _ = c.face_vertices, c.face_sizes, c.edge_faces, c.edge_vertices, c.genus
        return c

    def row(name: str, seconds: float, count: int = n) -> None:
        print(f"| {name} | {1e9 * seconds / count:.0f} | {seconds:.3f} |")

    print(f"| {n} vertices | ns per vertex | s |\n| --- | --- | --- |")
    row("darts to faces, edges, genus", best(everything))
    row("neighborhoods of two edges", best(lambda: mesh.connectivity.rings(2)))
    row("dual of a triangulation", best(lambda: sm.dual((points, triangles))))
    row("the same, triangles in random order", best(lambda: sm.dual((points, shuffled))))
    for name in ("normals", "simplex_angle", "sphere_curvature", "metric_parameters"):
        row(name, best(lambda name=name: getattr(geometry, name)(mesh.vertices, mesh.neighbors)))
    row("area, volume", best(lambda: (mesh.moved(mesh.vertices).area, mesh.moved(mesh.vertices).volume)))
    row("sphere of that size", best(lambda: sm.sphere(vertices=vertices), 1))

    small = sm.sphere(vertices=8000)
    row("check, 8,000 vertices", best(small.check), small.n_vertices)
    ours = best(lambda: self_intersections(small.vertices, small.connectivity))
    row("crossings, 8,000 vertices", ours, small.n_vertices)

    import pyvista

    fans = fan(small.vertices, small.connectivity)
    other = (fans[0] + np.array([0.7, 0.02, 0.01]), fans[1])
    both = np.concatenate([fans[0], other[0]]), np.concatenate([fans[1], other[1] + len(fans[0])])
    first, second = (pyvista.PolyData.from_regular_faces(*pair) for pair in (fans, other))
    ours, theirs = best(lambda: crossing_triangles(*both)), best(lambda: first.collision(second), 1)
    print(f"\ncrossings of two such spheres: {theirs / ours:.1f} times faster than VTK's collision filter")


if __name__ == "__main__":
    main()
