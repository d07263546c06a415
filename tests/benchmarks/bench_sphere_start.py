"""How often a sphere ends at the genus of the data, untangled, when the points are moved a little.

Run as `python tests/benchmarks/bench_sphere_start.py [seeds] [names]`; 20 seeds of all four take half an hour. The
three surfaces are those of the folder named by SIMPLEXMESH_DATA.
"""

from __future__ import annotations

import os
import sys
import warnings
from pathlib import Path

import numpy as np

import simplexmesh as sm

SHAPES = {"torus.stl": (1, 1500), "eight.off": (2, 2000), "elephant.off": (3, 4000), "frame of a cube": (5, 1500)}
"""Genus and number of vertices of the model."""

SHIFTS = 1e-12, 1e-4
"""Standard deviations of the points moved, in diagonals of the data."""


def frame_of_a_cube(step=0.05):
    """Return points on the frame of a cube, its twelve bars square and a fifth of its side wide."""
    grid = np.arange(-0.5 + step / 2, 0.5, step)
    cells = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), axis=-1)
    solid = (np.abs(cells) > 0.3).sum(axis=-1) >= 2
    out = []
    for axis in range(3):
        for side in (-1, 1):
            bare = solid & ~np.roll(np.pad(solid, 1), -side, axis=axis)[1:-1, 1:-1, 1:-1]
            out.append(cells[bare] + side * step / 2 * np.eye(3)[axis])
    return np.concatenate(out)


def model(name, shift, seed):
    """Return the model of a shape, its points moved, from a sphere."""
    if name in {"torus.stl", "eight.off", "elephant.off"}:
        surface = sm.read_triangles(Path(os.environ["SIMPLEXMESH_DATA"]) / name)
        points, faces = surface.vertices, surface.faces
    else:
        points, faces = frame_of_a_cube(), None
    away = shift * float(np.linalg.norm(np.ptp(points, axis=0)))
    points = points + away * np.random.default_rng(seed).normal(size=points.shape)
    data = points if faces is None else sm.TriangleMesh(points, faces)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sm.SimplexMeshWarning)
        return sm.reconstruct(data, init="sphere", vertices=SHAPES[name][1])


def main(seeds=20, names=tuple(SHAPES)):
    """Print, for each shape and shift, how many models have the genus of the data and are untangled."""
    for name in names:
        for shift in SHIFTS:
            models = [model(name, shift, seed) for seed in range(seeds)]
            right = [one.mesh.genus == SHAPES[name][0] for one in models]
            clean = [one.mesh.check(self_intersections=True).ok for one in models]
            wrapped = [one.found is None for one in models]
            counts = f"genus {sum(right)}, untangled {sum(clean)}, both {int(np.logical_and(right, clean).sum())}"
            print(f"{name:14} by {shift:g}: {counts} of {seeds}; wrapped to the end {sum(wrapped)}", flush=True)


if __name__ == "__main__":
    main(*(int(sys.argv[1]),) if len(sys.argv) > 1 else (), **({"names": sys.argv[2:]} if sys.argv[2:] else {}))
