"""Descriptors of points that other libraries offer, none of which has recognition as a function."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from types import ModuleType

import numpy as np

Descriptor = Callable[[np.ndarray], np.ndarray]


def distances(points: np.ndarray) -> np.ndarray:
    """Histogram of the distances of 100,000 random pairs, in 64 parts of 1.2 diagonals."""
    a, b = points[np.random.default_rng(0).integers(0, len(points), (2, 100_000))]
    counts, _ = np.histogram(np.linalg.norm(a - b, axis=1), 64, (0, 1.2))
    return counts / len(a)


def mean_features(o3d: ModuleType, points: np.ndarray) -> np.ndarray:
    """Mean of Open3D's fast point feature histograms at 2.5 % of the size, normals turned away from the middle."""
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)).voxel_down_sample(0.025)
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=0.05, max_nn=30))
    cloud.orient_normals_towards_camera_location(cloud.get_center())
    cloud.normals = o3d.utility.Vector3dVector(-np.asarray(cloud.normals))
    around = o3d.geometry.KDTreeSearchParamHybrid(radius=0.125, max_nn=100)
    features = o3d.pipelines.registration.compute_fpfh_feature(cloud, around).data
    return features.mean(axis=1)


def identifier(trimesh: ModuleType, points: np.ndarray) -> np.ndarray:
    """trimesh's identifier of the convex hull."""
    return trimesh.comparison.identifier_simple(trimesh.PointCloud(points).convex_hull)


def descriptors(libraries: dict[str, ModuleType]) -> dict[str, Descriptor]:
    """Return all there are, by name."""
    found: dict[str, Descriptor] = {"histogram of distances": distances}
    if "open3d" in libraries:
        found["Open3D mean FPFH"] = partial(mean_features, libraries["open3d"])
    if "trimesh" in libraries:
        found["trimesh identifier of the hull"] = partial(identifier, libraries["trimesh"])
    return found
