"""How far off the poses of fifteen views of bodies are, that `register_all` finds, and how long it takes.

Run with `SIMPLEXMESH_DATA=... python tests/benchmarks/bench_register_all.py [names]`.
Views are 24 degrees apart around a body: the nearest of 600,000 points of its surface in each pixel of 150 along the
diagonal, of which 6,000 are drawn, with noise of 0.2 % of the diagonal, each view in a random frame. They are given in
the order taken and in a random one. Bunny: the six scans of Stanford, against `bun.conf`. Errors are angles between a
pose and the truth, in the frame of the first scan; doubtful: scans whose poses are told to be so, as those of the
coupling, which is nearly symmetric, must be where they are wrong. Of the bunny also how far its scans are from each
other, here and with the published poses: the median distance from the planes of points of another scan within 2 mm.
Tables are printed in Markdown.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from itertools import permutations
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.numerics.plane_fits import planes
from tests.recognition.reference import random_rotation

DATA = Path(os.environ.get("SIMPLEXMESH_DATA", "data"))
NAMES = ("spot.obj", "fandisk.off", "elephant.off", "lion_head.off", "bunny", "coupling.off")
SAMPLED, DRAWN, PIXELS, NOISE, COUNT = 600_000, 6_000, 150, 0.002, 15


def visible(cloud: sm.PointCloud, direction: np.ndarray, pixel: float) -> np.ndarray:
    """Return the rows of the points that are seen from a direction, in front of all others of their pixel."""
    across = np.linalg.svd(direction[None])[2][1:]
    _, cell = np.unique(np.floor(cloud.points @ across.T / pixel), axis=0, return_inverse=True)
    depth, nearest = cloud.points @ direction, np.full(cell.max() + 1, -np.inf)
    np.maximum.at(nearest, cell.ravel(), depth)
    return np.flatnonzero((depth > nearest[cell.ravel()] - 3 * pixel) & (cloud.normals @ direction > 0.15))


def views(name: str, rng: np.random.Generator) -> tuple[list[np.ndarray], np.ndarray]:
    """Return the views of a body, and T_body_view (n, 4, 4) of each."""
    body = sm.read_triangles(DATA / name)
    cloud = body.sampled(SAMPLED, rng=rng)
    scans, poses = [], np.tile(np.eye(4), (COUNT, 1, 1))
    for T, angle in zip(poses, 2 * np.pi * np.arange(COUNT) / COUNT, strict=True):
        direction = np.array([np.cos(angle), np.sin(angle), 0.35]) / np.hypot(1, 0.35)
        rows = visible(cloud, direction, body.diagonal / PIXELS)
        rows = rng.choice(rows, min(DRAWN, len(rows)), replace=False)
        points = cloud.points[rows] + NOISE * body.diagonal * rng.normal(size=(len(rows), 3))
        T[:3, :3], T[:3, 3] = random_rotation(rng), body.diagonal * rng.normal(size=3)
        scans.append((points - T[:3, 3]) @ T[:3, :3])
    return scans, poses


def bunny() -> tuple[list[Path], np.ndarray]:
    """Return the scans of the bunny, and their published poses."""
    known = sm.read_poses(DATA / "bun.conf")
    paths = [DATA / f"bun{angle}.ply" for angle in ("000", "045", "090", "180", "270", "315")]
    return paths, np.array([known[path.name] for path in paths])


def apart(scans: list[sm.PointCloud], poses: np.ndarray, within: float) -> float:
    """Return the median distance of points of scans from the planes of those near them in other scans."""
    points = [scan.points @ T[:3, :3].T + T[:3, 3] for scan, T in zip(scans, poses, strict=True)]
    normals = [planes(scan.points).normals @ T[:3, :3].T for scan, T in zip(scans, poses, strict=True)]
    out = []
    for i, j in permutations(range(len(scans)), 2):
        distance, near = cKDTree(points[j]).query(points[i], distance_upper_bound=within)
        rows = np.flatnonzero(np.isfinite(distance))
        rows = rows[np.abs((normals[i][rows] * normals[j][near[rows]]).sum(axis=1)) > 0.9]
        out.append(np.abs(((points[i][rows] - points[j][near[rows]]) * normals[j][near[rows]]).sum(axis=1)))
    return float(np.median(np.concatenate(out)))


def main(names: tuple[str, ...]) -> None:
    """Print a row for each body and order."""
    warnings.simplefilter("ignore")
    print("| scans | order | groups | worst error, degrees | doubtful | processor time, s |\n|---|---|---|---|---|---|")
    for name in names:
        scans, poses = bunny() if name == "bunny" else views(name, np.random.default_rng(0))
        for kind in ("as taken", "random"):
            order = np.arange(len(scans))
            order = np.random.default_rng(5).permutation(order) if kind == "random" else order
            began = time.process_time()
            found = sm.register_all([scans[k] for k in order])
            seconds = time.process_time() - began
            true = np.linalg.solve(poses[order[0]], poses[order])[:, :3, :3]
            errors = [Rotation.from_matrix(R.T @ S[:3, :3]).magnitude() for R, S in zip(true, found.poses, strict=True)]
            groups = ", ".join(str(len(group)) for group in found.groups)
            worst, doubtful = np.degrees(max(errors)), len(found.doubtful)
            print(f"| {name} | {kind} | {groups} | {worst:.3f} | {doubtful} | {seconds:.1f} |", flush=True)
            if name == "bunny":
                clouds = [sm.read_points(scans[k]) for k in order]
                lie = [1e3 * apart(clouds, at, 0.002) for at in (found.poses, poses[order])]
                print(f"scans of the bunny are {lie[0]:.4f} mm apart here, {lie[1]:.4f} mm as published", flush=True)


if __name__ == "__main__":
    main(tuple(sys.argv[1:]) or NAMES)
