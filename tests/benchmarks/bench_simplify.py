"""Simplification within a tolerance beside decimations to as many triangles: the worst place, and the time.

Usage: SIMPLEXMESH_DATA=folder python tests/benchmarks/bench_simplify.py
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import igl
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from simplexmesh.motion.targets.triangles import surface_distance

FILES = {"fandisk.off": 1e-3, "spot.obj": 2e-3, "elephant.off": 2e-3, "fran_face.vtk": 2e-3, "part_scan.ply": 2e-3}
"""Tolerances in shares of the diagonal."""

NOISE = (0.0, 0.1, 0.2)  # of a torus of 102,000 triangles, in edges; the tolerance is half an edge


def bodies():
    """Return (name, surface, tolerance) of files and of tori with noise."""
    for name, share in FILES.items():
        mesh = sm.read_triangles(Path(os.environ["SIMPLEXMESH_DATA"]) / name).welded(report=False)
        yield name, mesh, share * mesh.diagonal
    ring, rng = sm.torus(300, 170).triangulated("dual"), np.random.default_rng(0)
    edge = float(np.sqrt(4 * ring.area / (np.sqrt(3) * ring.n_faces)))
    for noise in NOISE:
        moved = ring.vertices + noise * edge * rng.normal(size=ring.vertices.shape)
        yield f"torus, {noise:.0%}", sm.TriangleMesh(moved, ring.faces), edge / 2


def timed(function):
    """Return a result and the seconds of the fastest of three calls after a first one."""
    function()
    seconds = []
    for _ in range(3):
        began = time.perf_counter()
        out = function()
        seconds.append(time.perf_counter() - began)
    return out, min(seconds)


def peers(mesh, faces):
    """Return functions that decimate a surface to a number of triangles, to vertices and triangles."""
    poly = mesh.to_pyvista()
    vertices, triangles = np.array(mesh.vertices), np.array(mesh.faces)

    def of_vtk(method):
        out = getattr(poly, method)(1 - faces / mesh.n_faces)
        return np.asarray(out.points, float), out.regular_faces

    return {
        "VTK quadric": lambda: of_vtk("decimate"),
        "VTK pro": lambda: of_vtk("decimate_pro"),
        "libigl": lambda: igl.decimate(vertices, triangles, faces)[:2],
    }


def main() -> None:
    print("largest distance of a given vertex from the result, in tolerances, and seconds")
    for name, mesh, tolerance in bodies():
        out, seconds = timed(lambda mesh=mesh, tolerance=tolerance: sm.simplify(mesh, tolerance))
        away = surface_distance(mesh.vertices, out.vertices, out.faces).max() / tolerance
        row = [f"{name:14s} {mesh.n_faces:7,} -> {out.n_faces:6,}: ours {away:5.2f} {seconds:6.2f} s"]
        for peer, function in peers(mesh, out.n_faces).items():
            (vertices, faces), seconds = timed(function)
            away = surface_distance(mesh.vertices, vertices, faces).max() / tolerance if len(faces) else np.nan
            row.append(f"{peer} {away:5.2f} {seconds:6.2f} s ({len(faces):,})")
        print("; ".join(row), flush=True)


if __name__ == "__main__":
    main()
