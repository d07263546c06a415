"""How often a sphere ends at the genus of the data, untangled, when the points are moved a little; tables of the pages.

Run as `python tests/benchmarks/bench_sphere_start.py [seeds] [names]`; 20 seeds of all four take half an hour. With
`closed` and `open` in place of seeds, the tables of `docs/topology.md` and `docs/reconstruction.md`: of each figure,
in % of the diagonal, the least and most of three runs, the points as they are and moved by 1e-6 of it, twice. Ends
are those along lines of at least 5 % of it.
SIMPLEXMESH_DATA names the folder of the data.
"""

from __future__ import annotations

import os
import sys
import warnings
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.motion.reconstruct.conversion import as_input

SHAPES = {"torus.stl": (1, 1500), "eight.off": (2, 2000), "elephant.off": (3, 4000), "frame of a cube": (5, 1500)}
"""Genus and number of vertices of the model."""

SHIFTS = 1e-12, 1e-4
"""Standard deviations of the points moved, in diagonals of the data."""

CLOSED = {"torus.stl": 1500, "eight.off": 3000, "elephant.off": 8000, "anchor.off": 4000, "frame of a cube": 2000,
          "knot1.off": 3000, "coupling.off": 4000, "femur.off": 4000}  # fmt: skip
OPEN = {"fran_face.vtk": 1700, "rabbit_scan.vtk": 2000, "part_scan.ply": 1500, "lion_head.off": 2000,
        "mannequin.off": 2000, "bun000.ply": 2000}  # fmt: skip


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
    return from_sphere(moved(name, shift, seed), SHAPES[name][1])


def moved(name, shift, seed):
    """Return the data of a name, its points moved."""
    frame = name == "frame of a cube"
    data = sm.PointCloud(frame_of_a_cube()) if frame else sm.read(Path(os.environ["SIMPLEXMESH_DATA"]) / name)
    points = data.vertices if isinstance(data, sm.TriangleMesh) else data.points
    points = points + shift * data.diagonal * np.random.default_rng(seed).normal(size=points.shape)
    if isinstance(data, sm.TriangleMesh):
        return sm.TriangleMesh(points, data.faces)
    return sm.PointCloud(points, data.normals)


def from_sphere(data, vertices):
    """Return the model of data from a sphere."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sm.SimplexMeshWarning)
        return sm.reconstruct(data, init="sphere", vertices=vertices)


def along_rims(mesh):
    """Return points along the edges of holes, sixteen an edge."""
    c = mesh.connectivity
    loops = np.split(c.face_vertices, c.face_offsets[1:-1])
    rims = [mesh.vertices[loops[face]] for face in np.flatnonzero(c.face_is_hole)]
    ahead = [np.roll(rim, -1, axis=0) - rim for rim in rims]
    return np.concatenate([rim + t * step for rim, step in zip(rims, ahead, strict=True) for t in np.arange(16) / 16])


def table(sizes):
    """Print how far data and model are apart, and their ends where both have some, with genus, holes, and tangles."""
    for name, size in sizes.items():
        rows = []
        for shift, seed in ((0, 0), (1e-6, 1), (1e-6, 2)):
            data = moved(name, shift, seed)
            one = from_sphere(data, size)
            mesh, percent = one.mesh, 100 / float(np.linalg.norm(np.ptp(one.mesh.vertices, axis=0)))
            row = {"apart": percent * one.distance.data_to_mesh.mean, "genus": mesh.genus, "holes": mesh.n_holes,
                   "tangled": one.tangled}  # fmt: skip
            if mesh.n_holes:
                ends = as_input(data).target.border.wider(0.05 * data.diagonal)
                rim = along_rims(mesh)
                row["rim to ends"] = percent * cKDTree(ends).query(rim)[0].mean()
                row["back"] = percent * cKDTree(rim).query(ends)[0].mean()
            rows.append(row)
        told = {what: [row.get(what, np.nan) for row in rows] for what in rows[0]}
        cells = [f"{what} {min(each):.3g} to {max(each):.3g}" for what, each in told.items()]
        print(f"{name}, {size:,} vertices: {', '.join(cells)}", flush=True)


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
    if {"closed", "open"} & set(sys.argv):
        for what, sizes in (("closed", CLOSED), ("open", OPEN)):
            table(sizes if what in sys.argv else {})
        sys.exit()
    main(*(int(sys.argv[1]),) if len(sys.argv) > 1 else (), **({"names": sys.argv[2:]} if sys.argv[2:] else {}))
