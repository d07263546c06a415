"""How often and how fast `register` finds random motions, by the protocol of the comparison with other libraries.

Run with `SIMPLEXMESH_DATA=... python tests/benchmarks/bench_register.py [motions] [bunny|ant|scans|symmetric]`. Each
case: so many random motions, 5,000 points a side, "A 1, B 0.7" keeps 70 % of the second, one side of a random plane;
noise in shares of the diagonal; a motion counts as found when the rotation is within 5 degrees. The ant is PyVista's.
A table is printed in Markdown.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.recognition import reference as reference

DATA = Path(os.environ.get("SIMPLEXMESH_DATA", "data"))
BUNNY = ((1, 1, 0.002), (1, 1, 0.01), (1, 0.7, 0.005), (1, 0.35, 0.005), (0.7, 0.7, 0.005), (0.5, 0.5, 0.005))
ANT = ((1, 1, 0.002), (1, 0.5, 0.005), (0.7, 0.7, 0.005))
COUNT = 5_000
SCANS = tuple(f"bun{angle:03d}.ply" for angle in (0, 45, 90, 180, 270, 315))


def bunny() -> np.ndarray:
    """Points of all scans in one frame, thinned to even density."""
    poses = sm.read_poses(DATA / "bun.conf")
    parts = [reference_moved(poses[name], sm.read_points(DATA / name).points) for name in SCANS]
    points = np.concatenate(parts)
    return points[np.unique((points / 7e-4).round().astype(int), axis=0, return_index=True)[1]]


def ant(rng: np.random.Generator) -> np.ndarray:
    """Points on the ant."""
    from pyvista import examples

    return sm.read_triangles(examples.antfile).sampled(60_000, rng=rng).points


def reference_moved(T: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return points (n, 3) after a motion (4, 4)."""
    return points @ T[:3, :3].T + T[:3, 3]


def side(points: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """Return the points on one side of a random plane."""
    if share >= 1:
        return points
    height = points @ rng.normal(size=3)
    return points[height <= np.quantile(height, share)]


def case(whole: np.ndarray, shares: tuple[float, float], noise: float, rng: np.random.Generator):
    """Return source and target points and the motion between them."""
    diagonal = np.linalg.norm(np.ptp(whole, axis=0))
    target, source = (side(whole, share, rng) for share in shares)
    target, source = (part[rng.choice(len(part), COUNT, replace=False)] for part in (target, source))
    target, source = (part + noise * diagonal * rng.normal(size=part.shape) for part in (target, source))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = reference.random_rotation(rng), diagonal * rng.normal(size=3)
    return reference_moved(np.linalg.inv(T), source), target, T


def recall(name: str, whole: np.ndarray, cases, motions: int) -> None:
    """Print how often motions are found: by the best pose, and by the best two."""
    print(
        f"\n| {name} A, B, noise | found | among two | median, degrees | called ambiguous | s |"
        "\n|---|--:|--:|--:|--:|--:|"
    )
    for first, second, noise in cases:
        rng = np.random.default_rng(11)
        errors, twos, spent, ambiguous = [], [], [], 0
        for _ in range(motions):
            source, target, T = case(whole, (first, second), noise, rng)
            start = time.perf_counter()
            try:
                found = sm.register(source, target)
            except ValueError:  # refused: nothing agrees
                errors.append(180.0)
                twos.append(180.0)
                continue
            spent.append(time.perf_counter() - start)
            ambiguous += found.ambiguous
            poses = [found.T_target_source, *(pose.T_target_source for pose in found.poses[:1])]
            each = [reference.angle(pose[:3, :3], T[:3, :3]) for pose in poses]
            errors.append(each[0])
            twos.append(min(each))
        share, of_two = (np.mean(np.array(each) < 5) for each in (errors, twos))
        print(
            f"| {first}, {second}, {noise:.1%} | {share:.0%} | {of_two:.0%} "
            f"| {np.median(errors):.2f} | {ambiguous / motions:.0%} | {np.median(spent):.2f} |",
            flush=True,
        )


def scans() -> None:
    """Print the error of each scan of the bunny against the others fused, and of two neighbors, in degrees."""
    poses = sm.read_poses(DATA / "bun.conf")
    print("\n| scan | against | degrees | overlap | s |\n|---|---|--:|--:|--:|")
    rng = np.random.default_rng(0)
    for name in SCANS:
        fused = np.concatenate([reference_moved(poses[o], sm.read_points(DATA / o).points) for o in SCANS if o != name])
        told(name, "the others", sm.read_points(DATA / name).points, fused, poses[name], rng)
    T = np.linalg.inv(poses["bun000.ply"]) @ poses["bun045.ply"]
    told("bun045.ply", "bun000.ply", *(sm.read_points(DATA / n).points for n in ("bun045.ply", "bun000.ply")), T, rng)


def told(name: str, other: str, source: np.ndarray, target: np.ndarray, T: np.ndarray, rng) -> None:
    """Print one line, the source turned at random before."""
    turn = np.eye(4)
    turn[:3, :3] = reference.random_rotation(rng)
    start = time.perf_counter()
    found = sm.register(reference_moved(turn, source), target)
    spent = time.perf_counter() - start
    error = reference.angle((found.T_target_source @ turn)[:3, :3], T[:3, :3])
    print(f"| {name} | {other} | {error:.2f} | {found.overlap:.0%} | {spent:.1f} |", flush=True)


def symmetric() -> None:
    """Print what is said of symmetric objects, and how far the worst equivalent pose is off the surface."""
    print(
        "\n| object | ambiguous | equivalent poses | open motions | 95 % off, shares of the diagonal |"
        "\n|---|---|--:|--:|--:|"
    )
    for name in ("torus.stl", "ellipsoid.off", "coupling.off"):
        body = sm.read_triangles(DATA / name)
        dense = body.sampled(100_000, rng=0).points
        tree, diagonal = cKDTree(dense), np.linalg.norm(np.ptp(dense, axis=0))
        rng = np.random.default_rng(0)
        source, target, _ = case(dense, (1, 1), 0.002, rng)
        found = sm.register(source, target)
        equal = [pose.T_target_source for pose in found.poses if pose.equivalent]
        off = [np.quantile(tree.query(reference_moved(T, source))[0], 0.95) for T in [found.T_target_source, *equal]]
        print(f"| {name} | {found.ambiguous} | {len(equal)} | {len(found.open_motions)} | {max(off) / diagonal:.4f} |")


if __name__ == "__main__":
    motions = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    wanted = sys.argv[2:] or ["bunny", "ant", "scans", "symmetric"]
    sm.register(sm.sphere(8), sm.sphere(8))
    if "bunny" in wanted:
        recall("bunny", bunny(), BUNNY, motions)
    if "ant" in wanted:
        recall("ant", ant(np.random.default_rng(0)), ANT, motions)
    if "scans" in wanted:
        scans()
    if "symmetric" in wanted:
        symmetric()
