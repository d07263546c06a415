"""Models of closed triangles with sharp edges, beside models moved to 40,000 points on them.

Distances are from 50,000 points on the triangles to the model, in percent of the diagonal; volume is over the true one.

Usage: python tests/benchmarks/bench_models_of_triangles.py [vertices] [parts]

The parts are files of the data folder (SIMPLEXMESH_DATA) by default; a number makes so many of random bores, slots and
ribs in a block, by manifold3d.
"""

import os
import sys
import time
import warnings
from pathlib import Path

import manifold3d
import numpy as np

import simplexmesh as sm

PARTS = [
    "abc8.stl",
    "angle_block.stl",
    "featuretype.stl",
    "fixed_top.ply",
    "tray_bottom.stl",
    "anchor.off",
    "fandisk.off",
    "coupling.off",
]


def block(seed):
    """Return a plate or block with ribs, bores, slots and a chamfered boss at random places."""
    rng = np.random.default_rng(seed)
    size = np.array([100.0, rng.uniform(40, 90), rng.uniform(4, 30)])
    solid = manifold3d.Manifold.cube(size)
    for _ in range(rng.integers(1, 4)):
        rib = [rng.uniform(20, 80), rng.uniform(2, 6), rng.uniform(4, 15)]
        solid += manifold3d.Manifold.cube(rib).translate(
            [rng.uniform(0, 20), rng.uniform(5, size[1] - 10), size[2] - 1]
        )
    for _ in range(rng.integers(2, 7)):
        bore = manifold3d.Manifold.cylinder(80, rng.uniform(1.5, 6), circular_segments=48)
        solid -= bore.translate([rng.uniform(8, 92), rng.uniform(8, size[1] - 8), -20])
    slot = manifold3d.Manifold.cube([rng.uniform(10, 30), rng.uniform(3, 8), 60])
    solid -= slot.rotate([0, 0, rng.uniform(0, 90)]).translate([50, size[1] / 2, -20])
    mesh = solid.to_mesh()
    return sm.TriangleMesh(mesh.vert_properties[:, :3].astype(float), mesh.tri_verts)


def distances(points, triangles, diagonal):
    """Return mean and worst distance of points to triangles, in percent."""
    away = np.abs(sm.deviation(points, triangles).distances)
    return 100 * float(np.nanmean(away)) / diagonal, 100 * float(np.nanmax(away)) / diagonal


def compared(name, surface, vertices):
    """Print a row for one part."""
    points, cells = surface.sampled(50_000, rng=1).points, [f"{name} ({surface.n_faces:,})"]
    for given in (surface, surface.sampled(40_000, rng=0)):
        start = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = sm.reconstruct(given, vertices=vertices)
        seconds = time.perf_counter() - start
        mean, worst = distances(points, model.mesh.triangulated(method="fan"), surface.diagonal)
        volume, genus = model.mesh.volume / surface.volume, f"{model.mesh.genus}/{surface.genus}"
        cells += [f"{mean:.4f}", f"{worst:.2f}", f"{volume:.3f}", genus, str(model.tangled), f"{seconds:.1f} s"]
    print("| " + " | ".join(cells) + " |", flush=True)


def main(vertices=4000, parts=None):
    """Compare all parts."""
    columns = ["mean", "worst", "volume", "genus", "tangled", "time"]
    print("| " + " | ".join(["part (triangles)", *columns, *(f"of points: {name}" for name in columns)]) + " |")
    print("|---" + "|--:" * 12 + "|")
    sm.reconstruct(block(99), vertices=500)
    if parts is not None:
        for seed in range(int(parts)):
            compared(f"block {seed}", block(seed), vertices)
        return
    for name in PARTS:
        surface = sm.read(Path(os.environ["SIMPLEXMESH_DATA"]) / name)
        compared(name, surface.welded(report=False).oriented(), vertices)


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]))
