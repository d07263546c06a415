"""`register` against the registration of Open3D, KISS-Matcher and small_gicp, in one process.

Run: SIMPLEXMESH_DATA=... python tests/benchmarks/bench_register_peers.py [motions] [words of cases] [--store]; half an
hour. The peers are no dependencies: what is not installed is said and left out.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.benchmarks import bench_register as protocol
from tests.benchmarks.figures import Figures, installed
from tests.recognition import reference as reference

PROTOCOL = """Twenty random motions a seed, three seeds of the bunny 0.5, 0.5, one of the other cases; 5,000 points an
object without normals; "0.7" keeps 70 % of it, one side of a random plane; noise in shares of the diagonal. A motion is
found when its rotation is within 5 degrees. Peers are told the size: voxels of 2.5 % of the diagonal for features, with
normals turned away from the middle; 0.5 % for ICP from points to planes and for small_gicp, which begin where the
features end. Processor seconds of all threads, median."""
COARSE, FINE = 0.025, 0.005
"""Voxels, in shares of the diagonal."""

CASES = {
    "bunny 1, 1, 0.2 %": (1, 1, 0.002, 5_000),
    "bunny 1, 1, 1 %": (1, 1, 0.01, 5_000),
    "bunny 1, 0.7, 0.5 %": (1, 0.7, 0.005, 5_000),
    "bunny 1, 0.35, 0.5 %": (1, 0.35, 0.005, 5_000),
    "bunny 0.7, 0.7, 0.5 %": (0.7, 0.7, 0.005, 5_000),
    "bunny 0.5, 0.5, 0.5 %": (0.5, 0.5, 0.005, 5_000),
    "ant 1, 1, 0.2 %": (1, 1, 0.002, 5_000),
    "ant 1, 0.5, 0.5 %": (1, 0.5, 0.005, 5_000),
    "ant 0.7, 0.7, 0.5 %": (0.7, 0.7, 0.005, 5_000),
    "bunny 1, 0.7, 0.2 %, 40,000 points": (1, 0.7, 0.002, 40_000),
    "bun045 on bun000": None,
}
PEERS = ("open3d", "small_gicp", "kiss_matcher")
REPEATED = {"bunny 0.5, 0.5, 0.5 %"}
SEEDS = (11, 12, 13)


def ours(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the motion that `register` finds."""
    return sm.register(source, target).T_target_source


def ransac(o3d: Any, source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the motion that Open3D finds from features."""
    o3d.utility.random.seed(0)
    voxel = COARSE * float(np.linalg.norm(np.ptp(target, axis=0)))
    tools = o3d.pipelines.registration
    clouds, features = [], []
    for points in (source, target):
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.array(points))).voxel_down_sample(voxel)
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=2 * voxel, max_nn=30))
        cloud.orient_normals_towards_camera_location(cloud.get_center())
        cloud.normals = o3d.utility.Vector3dVector(-np.asarray(cloud.normals))
        clouds.append(cloud)
        features.append(
            tools.compute_fpfh_feature(cloud, o3d.geometry.KDTreeSearchParamHybrid(radius=5 * voxel, max_nn=100))
        )
    found = tools.registration_ransac_based_on_feature_matching(
        *(*clouds, *features, True, 1.5 * voxel),
        *(tools.TransformationEstimationPointToPoint(False), 3),
        [
            tools.CorrespondenceCheckerBasedOnEdgeLength(0.9),
            tools.CorrespondenceCheckerBasedOnDistance(1.5 * voxel),
        ],
        tools.RANSACConvergenceCriteria(100_000, 0.999),
    )
    return np.asarray(found.transformation)


def kiss(matcher: Any, source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the motion that KISS-Matcher, which refuses small numbers, finds from features at a size of one."""
    size = float(np.linalg.norm(np.ptp(target, axis=0)))
    points = (np.asarray(each / size, np.float32) for each in (source, target))
    found = matcher.KISSMatcher(COARSE).estimate(*points)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = found.rotation, size * np.asarray(found.translation)
    return T


def icp(o3d: Any, source: np.ndarray, target: np.ndarray, T: np.ndarray) -> np.ndarray:
    """Return the motion after Open3D's ICP, points to planes, from one nearby: coarse, then fine."""
    diagonal = float(np.linalg.norm(np.ptp(target, axis=0)))
    clouds = [
        o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.array(points))).voxel_down_sample(FINE * diagonal)
        for points in (source, target)
    ]
    clouds[1].estimate_normals(o3d.geometry.KDTreeSearchParamKNN(30))
    tools = o3d.pipelines.registration
    for reach in (COARSE * diagonal, 0.5 * COARSE * diagonal):
        estimation = tools.TransformationEstimationPointToPlane()
        T = tools.registration_icp(*clouds, reach, T, estimation).transformation
    return np.asarray(T)


def gicp(small: Any, source: np.ndarray, target: np.ndarray, T: np.ndarray) -> np.ndarray:
    """Return the motion after small_gicp's refinement from one nearby."""
    diagonal = float(np.linalg.norm(np.ptp(target, axis=0)))
    found = small.align(
        target, source, T, registration_type="GICP", downsampling_resolution=FINE * diagonal,
        max_correspondence_distance=COARSE * diagonal, num_threads=2,
    )  # fmt: skip
    return np.asarray(found.T_target_source)


def methods(libraries: dict[str, Any]) -> dict[str, tuple[str, Callable[..., np.ndarray]]]:
    """Return what there is to be compared: each method with the one that it begins with."""
    out: dict[str, tuple[str, Callable[..., np.ndarray]]] = {"register": ("", ours)}
    o3d, small, matcher = (libraries.get(name) for name in PEERS)
    if o3d:
        o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)
        out["Open3D RANSAC"] = "", partial(ransac, o3d)
        out["Open3D RANSAC, ICP"] = "Open3D RANSAC", partial(icp, o3d)
    if o3d and small:
        out["Open3D RANSAC, small_gicp"] = "Open3D RANSAC", partial(gicp, small)
    if o3d and matcher:
        out["KISS-Matcher"] = "", partial(kiss, matcher)
        out["KISS-Matcher, ICP"] = "KISS-Matcher", partial(icp, o3d)
    return out


def motion_of(name: str, wholes: dict[str, np.ndarray], rng: np.random.Generator):
    """Return source, target and the motion between them."""
    if CASES[name] is not None:
        first, second, noise, protocol.COUNT = CASES[name]
        return protocol.case(wholes[name.split()[0]], (first, second), noise, rng)
    poses = sm.read_poses(protocol.DATA / "bun.conf")
    source, target = (sm.read_points(protocol.DATA / each).points for each in ("bun045.ply", "bun000.ply"))
    T = np.eye(4)
    T[:3, :3] = reference.random_rotation(rng)
    true = np.linalg.inv(poses["bun000.ply"]) @ poses["bun045.ply"] @ np.linalg.inv(T)
    return protocol.reference_moved(T, source), target, true


def compared(name: str, wholes: dict[str, np.ndarray], motions: int, seed: int):
    """Return error, processor and clock seconds (method, motion, 3); what begins with another takes its time too."""
    rng = np.random.default_rng(seed)
    out: dict[str, list[list[float]]] = {method: [] for method in there}
    for _ in range(motions):
        source, target, T = motion_of(name, wholes, rng)
        found: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        for method, (first, call) in there.items():
            start = np.array([time.process_time(), time.perf_counter()])
            begun = [found[first][0]] if first else []
            try:
                motion = call(source, target, *begun)
            except ValueError:  # refused: nothing agrees
                motion = np.full((4, 4), np.nan)
            took = np.array([time.process_time(), time.perf_counter()]) - start
            found[method] = motion, took + (found[first][1] if first else 0.0)
            error = 180.0 if np.isnan(motion).any() else reference.angle(motion[:3, :3], T[:3, :3])
            out[method].append([error, *found[method][1]])
    return {method: np.array(rows) for method, rows in out.items()}


def told(figures: Figures, name: str, wholes: dict[str, np.ndarray], motions: int) -> None:
    """Keep what the methods found of one case."""
    runs = [compared(name, wholes, motions, seed) for seed in (SEEDS if name in REPEATED else SEEDS[:1])]
    for method in there:
        each = [run[method] for run in runs]
        figures.add(f"{name}, {method}, found", [100 * np.mean(run[:, 0] < 5) for run in each], "%")
        figures.add(f"{name}, {method}, median error", [np.median(run[:, 0]) for run in each], "degrees")
        figures.add(f"{name}, {method}, processor time", [np.median(run[:, 1]) for run in each], "s")


if __name__ == "__main__":
    motions = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    wanted = [name for name in CASES if not sys.argv[2:] or any(word in name for word in sys.argv[2:])]
    libraries = installed(*PEERS)
    there = methods(libraries)
    figures = Figures("register_peers", PROTOCOL, list(libraries))
    wholes = {"bunny": protocol.bunny(), "ant": protocol.ant(np.random.default_rng(0))}
    for first, call in there.values():  # warm
        call(*motion_of("bunny 1, 1, 0.2 %", wholes, np.random.default_rng(0))[: 3 if first else 2])
    for name in wanted:
        told(figures, name, wholes, motions)
        figures.keep()
