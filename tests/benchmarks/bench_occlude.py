"""How far from their place parts end that `occlude` brings together, beside iterative closest points by trimesh.

Usage: SIMPLEXMESH_DATA=folder python tests/benchmarks/bench_occlude.py [seeds] [hills | femur | guide]; two minutes.

Each seed is a turn about a random axis, a shift aside and a lift. Hills: a field of hills and its mate, of the same or
of other triangles. Femur: a bone of the data folder, cut along hills. Guide: the negative of the crown of a molar from
CT, on the molar it was cut from and on one reconstructed anew. "Off": the farthest that a vertex is from its place.
Trimesh takes each vertex to the closest point and knows of no penetration.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.benchmarks.figures import installed
from tests.recognition.contact.test_occlude import LOWER, UPPER, hills, motion, off, thick

PEERS = installed("trimesh", "rtree")


def spread(values: list[float]) -> str:
    """Return the median, the least and the most."""
    return f"{np.median(values):.2g} ({min(values):.2g} to {max(values):.2g})"


def told(case: str, source: sm.TriangleMesh, target: sm.TriangleMesh, motions: list[np.ndarray], **options) -> None:
    """Print how far off the source ends, its contact and its penetration, over motions away from its place."""
    before, ours, theirs, shares, deep, seconds = ([] for _ in range(6))
    for T in motions:
        moved = source.transformed(T)
        before.append(np.linalg.norm(moved.vertices - source.vertices, axis=1).max())
        began = time.process_time()
        found = sm.occlude(moved, target, **options)
        seconds.append(time.process_time() - began)
        ours.append(off(found, T, source))
        shares.append(found.contact_area / source.area)
        deep.append(found.penetration)
        if len(PEERS) == 2 and shares[-1] > 0.5:  # the peer draws all of the source to the target
            theirs.append(closest_points(moved, source, target))
    peer = f", closest points {spread(theirs)}" if theirs else ""
    print(f"{case}: off {spread(before)} before, {spread(ours)} after{peer}")
    print(f"  in contact {spread(shares)}, penetration {spread(deep)}, {spread(seconds)} s of CPU", flush=True)


def closest_points(moved: sm.TriangleMesh, source: sm.TriangleMesh, target: sm.TriangleMesh) -> float:
    """Return how far off the vertices end by trimesh."""
    _, ended, _ = PEERS["trimesh"].registration.icp(
        moved.vertices, target.to_trimesh(), max_iterations=200, threshold=1e-9, reflection=False, scale=False
    )
    return float(np.linalg.norm(ended - source.vertices, axis=1).max())


def of_hills(seeds: int) -> Iterator[tuple]:
    """Yield a field and its mate, 2 wide, of the same and of other triangles."""
    motions = [
        motion(
            k, degrees=np.interp(k, [0, seeds - 1], [2, 15]), shift=0.1 + 0.1 * k / seeds, lift=0.16 + 0.08 * k / seeds
        )
        for k in range(seeds)
    ]
    yield "hills, the same triangles", UPPER, LOWER, motions, {}
    gentle = [motion(k, degrees=5, shift=0.1, lift=0.2) for k in range(seeds)]
    yield "hills, other triangles", hills(33, facing=-1), LOWER, gentle, {"tolerance": 0.01}


def of_femur(seeds: int) -> Iterator[tuple]:
    """Yield two fragments of a femur, which was cut across along hills, in units of its length."""
    bone = sm.read(Path(os.environ["SIMPLEXMESH_DATA"]) / "femur.off")
    axes = np.linalg.svd(bone.vertices - bone.vertices.mean(axis=0), full_matrices=False)[2][[1, 2, 0]]
    axes[2] *= np.linalg.det(axes)
    bone = sm.TriangleMesh((bone.vertices - bone.vertices.mean(axis=0)) @ axes.T, bone.faces)
    bone = bone.scaled(1 / np.ptp(bone.vertices[:, 2]))
    block = sm.TriangleMesh(*thick(0.4 * LOWER.vertices, LOWER.faces, 2.0))
    below, above = (sm.boolean(bone, block, name) for name in ("intersection", "difference"))
    about = above.vertices[above.vertices[:, 2] < above.vertices[:, 2].min() + 0.1].mean(axis=0)
    motions = [motion(k, degrees=6.3, shift=0.03, lift=0.06, about=about) for k in range(seeds)]
    yield "femur, lengths of it", above, below, motions, {}


def of_guide(seeds: int) -> Iterator[tuple]:
    """Yield a guide without play, and the molar that it was cut from, and that molar reconstructed anew; in voxels."""
    path = Path(os.environ["SIMPLEXMESH_DATA"]) / "tooth.nhdr"
    tooth, anew = (sm.reconstruct(path, level=600, vertices=n).mesh.triangulated("dual") for n in (6000, 5000))
    above = sm.clipped(sm.sphere(12, radius=60, center=(52, 45, 180)), (0, 0, 141), (0, 0, 1), cap=True)
    guide = sm.boolean(above, tooth)
    about = guide.vertices.mean(axis=0)
    motions = [
        motion(
            k,
            degrees=np.interp(k, [0, seeds - 1], [2, 11]),
            shift=5 + 5 * k / seeds,
            lift=5 + 10 * k / seeds,
            about=about,
        )
        for k in range(seeds)
    ]
    yield "guide on its molar", guide, tooth, motions, {"tolerance": 1.0}
    yield "guide on the molar anew", guide, anew, motions, {"tolerance": 1.0}


if __name__ == "__main__":
    warnings.simplefilter("ignore", sm.SimplexMeshWarning)
    count = int(sys.argv[1]) if sys.argv[1:] else 6
    kinds = {"hills": of_hills, "femur": of_femur, "guide": of_guide}
    for kind in sys.argv[2:] or kinds:
        for case, source, target, motions, options in kinds[kind](count):
            told(case, source, target, motions, **options)
