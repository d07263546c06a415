"""Scans of one object, merged to one point cloud in world coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh.data.conversion import as_data
from simplexmesh.data.io.reading import read_poses
from simplexmesh.data.points import PointCloud
from simplexmesh.data.poses import rigid
from simplexmesh.data.triangles import TriangleMesh

Array = NDArray[np.float64]


def are_scans(data: Any) -> bool:
    """Return whether data is a sequence of scans: paths, point clouds, surfaces, or arrays (n, 3) or (n, 6).

    A pair of arrays of which only the second is of integers is vertices and faces, not two scans; so is, as a tuple, a
    pair of integer arrays of which the second are valid indices into the first.
    """
    if not isinstance(data, list | tuple) or not data:
        return False
    if all(isinstance(item, str | Path | PointCloud | TriangleMesh) for item in data):
        return True
    arrays = all(isinstance(item, np.ndarray) and item.ndim == 2 and item.shape[1] in (3, 6) for item in data)
    return arrays and not (len(data) == 2 and _are_faces(data[1], data[0], pair=isinstance(data, tuple)))


def _are_faces(numbers: NDArray[Any], of: NDArray[Any], *, pair: bool) -> bool:
    if numbers.dtype.kind not in "iu" or not numbers.size or numbers.shape[1] != 3:
        return False
    return of.dtype.kind == "f" or (pair and bool(numbers.min() >= 0 and numbers.max() < len(of)))


def joined_scans(scans: Sequence[Any], poses: Any = None) -> PointCloud:
    """Return several scans as one cloud in world coordinates, with normals if every scan has them.

    `poses` is a file, a mapping from file names (or stems) to T_world_scan (4, 4), or one matrix per scan.
    """
    clouds = []
    for place, scan in enumerate(scans):
        item = as_data(scan)
        if isinstance(item, TriangleMesh):
            item = PointCloud(item.vertices, item.vertex_normals)
        if not isinstance(item, PointCloud):
            raise TypeError(f"scans must be point clouds or surfaces; scan {place} is a {type(item).__name__}")
        clouds.append(item)
    if poses is not None:
        table = read_poses(poses) if isinstance(poses, str | Path) else poses
        if not isinstance(table, Mapping | Sequence | np.ndarray):
            raise TypeError(f"poses must be a path, matrices by name or one per scan, not {type(poses).__name__}")
        if not isinstance(table, Mapping) and len(table) != len(scans):
            raise ValueError(f"poses must be one per scan; there are {len(table)} for {len(scans)} scans")
        clouds = [
            cloud.transformed(_pose(table, scan, place))
            for place, (cloud, scan) in enumerate(zip(clouds, scans, strict=True))
        ]
    return clouds[0] if len(clouds) == 1 else PointCloud.joined(clouds)


def _pose(table: Any, scan: Any, place: int) -> Array:
    """Return T_world_scan of one scan from a mapping by name or a sequence in order."""
    if isinstance(table, Mapping):
        if not isinstance(scan, str | Path):
            raise TypeError(f"poses by name need scans given as paths; scan {place} is a {type(scan).__name__}")
        path = Path(scan)
        for name in (path.name, path.stem):
            if name in table:
                return rigid(f"poses[{name!r}]", table[name])
        raise ValueError(f"poses must have an entry for {path.name}; it has {', '.join(map(str, table))}")
    return rigid(f"poses[{place}]", table[place])
