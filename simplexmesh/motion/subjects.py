"""What is to be reconstructed, made ready: a target to move to, points on its surface, and a start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.data.convert import as_data, as_triangles
from simplexmesh.data.points import PointCloud
from simplexmesh.data.reading import read_poses
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume
from simplexmesh.motion.crossings import outer_crossings
from simplexmesh.motion.initial.indicator import Indicator
from simplexmesh.motion.initial.start import Start
from simplexmesh.motion.state import Target

Array = NDArray[np.float64]

MOST_POINTS = 200_000
"""Distances from the data to the mesh are taken from at most so many points."""


class Subject(Protocol):
    """Data made ready for reconstruction.

    Attributes
    ----------
    resolution : float
        The distance between neighbouring samples, in the data's unit.
    encloses : bool
        Whether the data may hold surfaces inside the one wanted.
    """

    resolution: float
    encloses: bool

    @property
    def target(self) -> Target:
        """What the mesh is drawn to."""

    @property
    def points(self) -> Array:
        """(m, 3) points on the surface wanted."""

    @property
    def facing(self) -> Array | None:
        """(3,) the mean of the data's normals, or None when it has none or they cancel."""

    def start(self, vertices: int, tunnels: float | None) -> Start:
        """Return a mesh of about so many vertices, of the right topology and near the data."""


class VolumeSubject:
    """A level of a volume."""

    encloses = True
    facing = None

    def __init__(self, volume: Volume, level: float | None, inside: str, components: str) -> None:
        from simplexmesh.motion.targets.isosurface import Isosurface

        if level is None:
            low, high = volume.range
            raise ValueError(
                f"level must be given for a volume of intensities ({low:g} to {high:g}); "
                f"Otsu's threshold would be {otsu_threshold(volume.values):.4g}"
            )
        self.volume, self.components = volume, components
        self.target: Target = Isosurface(volume, level, inside=inside)
        self.level, self.inside = self.target.level, inside
        self.resolution = float(np.min(volume.spacing))

    @cached_property
    def points(self) -> Array:
        """(m, 3) where grid lines leave the object."""
        sign = 1.0 if self.inside == "above" else -1.0
        return outer_crossings(self.volume, self.level, sign=sign, largest=self.components == "largest")

    def start(self, vertices: int, tunnels: float | None) -> Start:
        """Return the dual of a coarse isosurface."""
        from simplexmesh.motion.initial.from_volume import start_from_volume

        if self.inside == "above":
            return start_from_volume(
                self.volume, self.level, None, vertices, components=self.components, tunnels=tunnels
            )
        dark = replace(self.volume, values=-self.volume.values.astype(np.float32))
        return start_from_volume(dark, -self.level, None, vertices, components=self.components, tunnels=tunnels)


class LabelSubject:
    """One region of a label volume."""

    encloses = True
    facing = None

    def __init__(self, volume: Volume, label: int | None, components: str) -> None:
        from simplexmesh.motion.targets.labels import LabelSurface

        if label is None:
            regions = [name for name in volume.labels() if name != 0]
            if len(regions) != 1:
                raise ValueError(f"label must be given, one of {regions}, for a volume of labels")
            label = regions[0]
        self.volume, self.components = volume, components
        self.label = _check.integer("label", label, -(2**31))
        self.target: Target = LabelSurface(volume, self.label)
        self.resolution = float(np.min(volume.spacing))

    @cached_property
    def points(self) -> Array:
        """(m, 3) the middles of the grid lines' steps between the region and its surroundings."""
        return outer_crossings(self.volume.mask(self.label), 0.5, largest=self.components == "largest")

    def start(self, vertices: int, tunnels: float | None) -> Start:
        """Return the dual of a coarse isosurface of the smoothed region."""
        from simplexmesh.motion.initial.from_volume import start_from_volume

        return start_from_volume(self.volume, None, self.label, vertices, components=self.components, tunnels=tunnels)


class PointsSubject:
    """A cloud of points, with or without normals."""

    encloses = False

    def __init__(self, cloud: PointCloud, components: str) -> None:
        self.cloud, self.components = cloud, components
        self._indicator: Indicator | None = None
        extent = float(np.linalg.norm(np.ptp(cloud.points, axis=0)))
        self.resolution = extent / max(np.sqrt(len(cloud.points)), 1.0)

    @cached_property
    def target(self) -> Target:
        """The surface behind the points; which side is out is known once a start was found."""
        from simplexmesh.motion.targets.points import Points

        if self._indicator is None or self.cloud.normals is not None:
            return Points(self.cloud)
        inward = self._indicator.at(self.cloud.points)[1]
        known = inward.any(axis=1)
        return Points(PointCloud(self.cloud.points[known], -inward[known]))

    @property
    def facing(self) -> Array | None:
        """(3,) the mean of the normals, or None when there are none."""
        return None if self.cloud.normals is None else np.asarray(self.cloud.normals.mean(axis=0))

    @property
    def points(self) -> Array:
        """(m, 3) the points themselves."""
        return self.cloud.points

    def start(self, vertices: int, tunnels: float | None) -> Start:
        """Return the dual of a coarse surface around the points."""
        from simplexmesh.motion.initial.from_points import start_from_points

        start = start_from_points(self.cloud, vertices, components=self.components, tunnels=tunnels or 0.0)
        self._indicator = start.indicator
        return start


class TrianglesSubject:
    """A triangulated surface, scanned or CAD."""

    encloses = False

    def __init__(self, triangles: TriangleMesh, components: str) -> None:
        from simplexmesh.motion.targets.triangles import Triangles

        self.triangles, self.components = triangles, components
        self.target: Target = Triangles(triangles)
        self.resolution = float(np.linalg.norm(np.ptp(triangles.vertices, axis=0))) / 200

    @cached_property
    def sampled(self) -> PointCloud:
        """Even samples of the surface, with its normals; the same every time."""
        return self.triangles.sampled(40_000, rng=0)

    @property
    def facing(self) -> Array | None:
        """(3,) the mean of the normals."""
        return None if self.sampled.normals is None else np.asarray(self.sampled.normals.mean(axis=0))

    @property
    def points(self) -> Array:
        """(m, 3) the vertices and even samples of the surface."""
        return np.concatenate([self.triangles.vertices, self.sampled.points])

    def start(self, vertices: int, tunnels: float | None) -> Start:
        """Return the dual of a coarse surface around even samples of the triangles."""
        from simplexmesh.motion.initial.from_points import start_from_points

        return start_from_points(self.sampled, vertices, components=self.components, tunnels=tunnels or 0.0)


def otsu_threshold(values: NDArray[Any]) -> float:
    """Return the level that splits a histogram of the values with the largest variance between the halves (Otsu 1979).

    Examples
    --------
    >>> 2 < otsu_threshold(np.array([0, 1, 1, 2, 9, 10, 10, 11])) < 9
    True
    """
    counts, edges = np.histogram(values, bins=256)
    middles = 0.5 * (edges[:-1] + edges[1:])
    below = np.cumsum(counts)[:-1].astype(float)
    above = counts.sum() - below
    sums = np.cumsum(counts * middles)
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = below * above * (sums[:-1] / below - (sums[-1] - sums[:-1]) / above) ** 2
    return float(edges[1 + int(np.nanargmax(spread))])


def as_subject(
    data: Any, *, level: float | None, label: int | None, inside: str, components: str, poses: Any = None
) -> Subject:
    """Return the data made ready, whatever it came as: own types, arrays, pyvista, trimesh, a path, several scans.

    Raises
    ------
    ValueError, TypeError, OSError
        One sentence on what is wrong with the data or with the choice of level and label.
    """
    if isinstance(data, list | tuple):
        if not data:
            raise ValueError("data must be at least one scan, not an empty list")
        if isinstance(data, tuple) and len(data) == 2 and all(isinstance(item, np.ndarray) for item in data):
            return TrianglesSubject(as_triangles(data, "data"), components)
        if all(isinstance(item, str | Path | PointCloud | TriangleMesh) for item in data):
            return PointsSubject(joined_scans(data, poses), components)
    if poses is not None:
        return PointsSubject(joined_scans([data], poses), components)
    item = as_data(data)
    if isinstance(item, Volume):
        if level is not None and label is not None:
            raise ValueError("give level or label, not both")
        if label is not None or (level is None and item.is_labels):
            return LabelSubject(item, label, components)
        return VolumeSubject(item, level, inside, components)
    if level is not None or label is not None:
        raise ValueError(f"level and label are for volumes, not for {type(item).__name__}")
    if isinstance(item, TriangleMesh):
        return TrianglesSubject(item, components)
    return PointsSubject(item, components)


def joined_scans(scans: Sequence[Any], poses: Any = None) -> PointCloud:
    """Return several scans as one cloud in the world's frame.

    Parameters
    ----------
    scans : sequence of paths, point clouds or triangle meshes
    poses : path, mapping or sequence, optional
        A file of poses, a mapping from a scan's file name (with or without suffix) to its T_world_scan (4, 4), or one
        such matrix per scan, in order.

    Returns
    -------
    PointCloud
        With normals when every scan has them.
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
                return _check.array(f"poses[{name!r}]", table[name], (4, 4))
        raise ValueError(f"poses must hold one for {path.name}; it names {', '.join(map(str, table))}")
    if place >= len(table):
        raise ValueError(f"poses must be one per scan; there are {len(table)} for scan number {place + 1}")
    return _check.array(f"poses[{place}]", table[place], (4, 4))
