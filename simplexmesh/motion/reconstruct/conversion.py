"""Data of any kind as an input of a reconstruction: checked, several scans joined, stray points left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import TopologyError, warn
from simplexmesh._base.vectors import norm
from simplexmesh.data.conversion import as_data, as_triangles
from simplexmesh.data.cutting.separating import separated
from simplexmesh.data.foreign import is_foreign
from simplexmesh.data.points import PointCloud, cloud_of_vertices, warn_of_steps
from simplexmesh.data.poses import read_poses, rigid
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.reconstruct.inputs import Input, PointsInput, TrianglesInput, VolumeInput
from simplexmesh.motion.targets.inward import without_inside_out
from simplexmesh.motion.targets.isosurface import Isosurface
from simplexmesh.orientation.propagation import LEAST_AGREEMENT, agreement

MOST_STRAY = 0.01
"""Largest fraction of stray points: more of them are a part of the object."""


def as_input(
    data: Any,
    *,
    level: float | None = None,
    label: int | None = None,
    inside: str = "above",
    components: str = "largest",
    poses: Any = None,
) -> Input:
    """Return data of any kind as an input: own types, arrays, PyVista or trimesh objects, a path, or scans."""
    if isinstance(data, Input):
        return data
    checks.choice("inside", inside, ("above", "below"))
    if isinstance(data, list | tuple) and not data:
        raise ValueError("data must be at least one scan, not an empty list")
    if are_scans(data) or poses is not None:
        item: Any = joined_scans(data if isinstance(data, list | tuple) else [data], poses)
    elif isinstance(data, tuple) and len(data) == 2:
        item = as_triangles(data, "data")
    else:
        item = as_data(data)
    checks.size("data", item.bounds)
    if isinstance(item, Volume):
        return _volume_input(item, level, label, inside, components)
    components = "largest" if components == "auto" else components
    check_for_no_volume(type(item).__name__, level, label, inside)
    if isinstance(item, SimplexMesh):
        item = item.triangulated()
    if isinstance(item, TriangleMesh):
        item = item if item.shares_vertices else item.welded(report=False)
        walls = components == "all" and item.is_closed  # of cavities
        try:
            item = item.oriented(outward=not walls)
        except TopologyError:
            item = separated(item).oriented(outward=not walls)
        return TrianglesInput(without_inside_out(item) if walls else item, components)
    warn_of_steps(item.points)
    return PointsInput(with_consistent_normals(without_stray_points(item)), components)


def check_for_no_volume(kind: str, level: float | None, label: int | None, inside: str) -> None:
    """Refuse options that choose a surface of a volume for another kind of data."""
    if level is not None or label is not None:
        raise ValueError(f"level and label are for volumes, not for {kind}")
    if inside != "above":
        raise ValueError(f"inside is for a level of a volume, not for {kind}")


def _volume_input(volume: Volume, level: float | None, label: int | None, inside: str, components: str) -> Input:
    """Return the isosurface or the region of a volume."""
    low, high = volume.range
    if low == high and label is None:
        raise ValueError(f"volume must hold an object and its surroundings; it is {low:g} everywhere")
    if level is not None and label is not None:
        raise ValueError("give level or label, not both")
    if level is not None:
        level = Isosurface(volume, level).level  # checked
        if inside == "below":
            values = volume.values
            negated = np.negative(values, dtype=np.result_type(values, np.float32))
            volume, level = replace(volume, values=negated), -level
        return VolumeInput(volume, "largest" if components == "auto" else components, level, None)
    if label is None and not volume.is_labels:
        raise ValueError(
            f"level must be given for a volume of intensities ({low:g} to {high:g}); "
            f"Otsu's threshold would be {otsu_threshold(volume.values):.4g}"
        )
    if inside != "above":
        raise ValueError("inside is for a level of a volume, not for labels")
    if label is None:
        regions = [name for name in volume.labels() if name != 0]
        if not regions:
            raise ValueError("volume must hold a labeled region; it is 0 everywhere")
        if len(regions) != 1:
            raise ValueError(f"label must be given, one of {regions}, for a volume of labels")
        label = regions[0]
    label = checks.integer("label", label, -(2**31))
    volume.mask(label)  # raises if there is none
    return VolumeInput(volume, "all" if components == "auto" else components, None, label)


def otsu_threshold(values: NDArray[Any]) -> float:
    """Return the threshold of the largest between-class variance in a histogram of 256 bins (Otsu 1979)."""
    largest = max(abs(float(values.min())), abs(float(values.max())))
    scale = largest if largest > checks.LARGEST else 1.0  # whose squares would overflow
    flat = values.ravel(order="K")
    counts, edges = np.histogram(flat / scale if scale > 1 else flat, bins=256)
    middles = 0.5 * (edges[:-1] + edges[1:])
    below = np.cumsum(counts)[:-1].astype(float)
    above = counts.sum() - below
    sums = np.cumsum(counts * middles)
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = below * above * (sums[:-1] / below - (sums[-1] - sums[:-1]) / above) ** 2
    return scale * float(edges[1 + int(np.nanargmax(spread))])


def without_stray_points(cloud: PointCloud) -> PointCloud:
    """Return the points without isolated ones two diagonals or more from the center of all but 1 %, with a warning."""
    points = cloud.points
    low, high = np.quantile(points, [MOST_STRAY / 2, 1 - MOST_STRAY / 2], axis=0)
    diagonal = float(norm(high - low))
    if len(points) <= 1 / MOST_STRAY or float(norm(np.ptp(points, axis=0))) <= 4 * diagonal:
        return cloud
    gaps = cKDTree(points).query(points, k=[6], workers=-1)[0][:, 0]
    stray = (norm(points - (low + high) / 2) > 2 * diagonal) & (gaps > 10 * np.median(gaps))
    count = int(np.count_nonzero(stray))
    if not 0 < count <= MOST_STRAY * len(points):
        return cloud
    warn(f"left out {count:,} of {len(points):,} points, isolated and far from all others")
    return cloud.selected(~stray)


def with_consistent_normals(cloud: PointCloud) -> PointCloud:
    """Return the cloud, without normals and with a warning if those of neighboring points contradict each other."""
    if cloud.normals is None:
        return cloud
    agree = agreement(cloud.points, cloud.normals)
    if agree > LEAST_AGREEMENT:
        return cloud
    warn(f"normals of neighboring points contradict each other ({1 - agree:.0%}); they were left out")
    return replace(cloud, normals=None)


def are_scans(data: Any) -> bool:
    """Return whether data is a sequence of scans: paths, clouds, surfaces, or arrays (n, 3) or (n, 6).

    A pair of arrays of which only the second is of integers is vertices and faces, not two scans; so is, as a tuple, a
    pair of integer arrays of which the second are valid indices into the first.
    """
    if not isinstance(data, list | tuple) or not data:
        return False
    if any(isinstance(item, PointCloud | TriangleMesh | SimplexMesh | Volume) for item in data):
        return True  # what is no scan is refused by name
    if all(isinstance(item, str | Path) or is_foreign(item) for item in data):
        return True
    arrays = all(isinstance(item, np.ndarray) and item.ndim == 2 and item.shape[1] in (3, 6) for item in data)
    return arrays and not (len(data) == 2 and _are_faces(data[1], data[0], pair=isinstance(data, tuple)))


def _are_faces(numbers: NDArray[Any], of: NDArray[Any], *, pair: bool) -> bool:
    if numbers.dtype.kind not in "iu" or not numbers.size or numbers.shape[1] != 3:
        return False
    return of.dtype.kind == "f" or (pair and bool(numbers.min() >= 0 and numbers.max() < len(of)))


def joined_scans(scans: Sequence[Any], poses: Any = None) -> PointCloud:
    """Return scans as one cloud in the world; `poses` are a file, T_world_scan by file names, or one per scan."""
    clouds = []
    for place, scan in enumerate(scans):
        item = as_data(scan)
        if isinstance(item, TriangleMesh):
            item = cloud_of_vertices(item)
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
