"""Adapters of data to be reconstructed: each provides a target, points on the surface, and a start."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.data.convert import as_data, as_triangles
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume
from simplexmesh.errors import TopologyError, warn
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.consistent_normals import with_consistent_normals
from simplexmesh.motion.crossings import outer_crossings
from simplexmesh.motion.initial.indicator import Indicator
from simplexmesh.motion.initial.start import Start
from simplexmesh.motion.scans import are_scans, joined_scans
from simplexmesh.motion.state import Target
from simplexmesh.motion.stray_points import without_stray_points
from simplexmesh.motion.threshold import otsu_threshold

Array = NDArray[np.float64]

MOST_POINTS = 200_000
"""Maximum number of points for distances from the data to the mesh."""

MOST_LEFT_OUT = 0.1
"""Fraction of the surface on omitted components above which a warning is given."""


class Subject(Protocol):
    """Data adapted for reconstruction.

    Attributes
    ----------
    resolution : float
        Distance between neighboring samples, in the data's unit.
    encloses : bool
        Whether there may be other surfaces inside the one wanted.
    components : {"largest", "all"}
        Which components are wanted.
    """

    resolution: float
    encloses: bool
    components: str

    @property
    def target(self) -> Target:
        """The target that attracts the mesh."""

    @property
    def points(self) -> Array:
        """(m, 3) points on the surface wanted."""

    @property
    def facing(self) -> Array | None:
        """(3,) the mean of the data's normals, or None when it has none or they cancel."""

    def start(self, vertices: int, tunnels: float | None) -> Start:
        """Return a start near the data, with its topology and about this number of vertices."""


class VolumeSubject:
    """An isosurface of a volume."""

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
        """(m, 3) points where grid lines leave the object."""
        return _outer_points(self.volume, self.level, 1.0 if self.inside == "above" else -1.0, self.components)

    def start(self, vertices: int, tunnels: float | None) -> Start:
        """Return the dual of a coarse isosurface."""
        from simplexmesh.motion.initial.from_volume import start_from_volume

        if self.inside == "above":
            return start_from_volume(
                self.volume, self.level, None, vertices, components=self.components, tunnels=tunnels
            )
        values = self.volume.values
        dark = replace(self.volume, values=-values.astype(np.result_type(values, np.float32)))
        return start_from_volume(dark, -self.level, None, vertices, components=self.components, tunnels=tunnels)


def _outer_points(volume: Volume, level: float, sign: float, components: str) -> Array:
    """Return points on the components wanted, with a warning if many are on others."""
    points = outer_crossings(volume, level, sign=sign)
    if components == "all":
        return points
    largest = outer_crossings(volume, level, sign=sign, largest=True)
    left = 1 - len(largest) / max(len(points), 1)
    if left > MOST_LEFT_OUT:
        message = f"{left:.0%} of the surface is on smaller pieces that are left out; components='all' keeps them"
        warn(message)
    return largest


class LabelSubject:
    """One region of a label volume."""

    encloses = True
    facing = None

    def __init__(self, volume: Volume, label: int | None, components: str) -> None:
        from simplexmesh.motion.targets.labels import LabelSurface

        if label is None:
            regions = [name for name in volume.labels() if name != 0]
            if not regions:
                raise ValueError("volume must hold a labeled region; it is 0 everywhere")
            if len(regions) != 1:
                raise ValueError(f"label must be given, one of {regions}, for a volume of labels")
            label = regions[0]
        self.volume, self.components = volume, components
        self.label = _check.integer("label", label, -(2**31))
        volume.mask(self.label)  # raises if there is none
        self.target: Target = LabelSurface(volume, self.label)
        self.resolution = float(np.min(volume.spacing))

    @cached_property
    def points(self) -> Array:
        """(m, 3) midpoints between grid points of the region and of its surroundings."""
        return _outer_points(self.volume.mask(self.label), 0.5, 1.0, self.components)

    def start(self, vertices: int, tunnels: float | None) -> Start:
        """Return the dual of a coarse isosurface of the smoothed region."""
        from simplexmesh.motion.initial.from_volume import start_from_volume

        return start_from_volume(self.volume, None, self.label, vertices, components=self.components, tunnels=tunnels)


class PointsSubject:
    """A point cloud, with or without normals."""

    encloses = False

    def __init__(self, cloud: PointCloud, components: str) -> None:
        cloud = without_stray_points(cloud)
        self.cloud, self.components = with_consistent_normals(cloud), components
        self._indicator: Indicator | None = None
        extent = float(np.linalg.norm(np.ptp(cloud.points, axis=0)))
        self.resolution = extent / max(np.sqrt(len(cloud.points)), 1.0)

    @cached_property
    def target(self) -> Target:
        """The surface of the points, oriented once a start has been computed."""
        from simplexmesh.motion.targets.points import Points

        if self._indicator is None or self.cloud.normals is not None:
            return Points(self.cloud)
        inward = self._indicator.at(self.cloud.points)[1]
        known = inward.any(axis=1)
        return Points(PointCloud(self.cloud.points[known], -inward[known]))

    @property
    def facing(self) -> Array | None:
        """(3,) the mean of the normals, or None without any."""
        return None if self.cloud.normals is None else np.asarray(self.cloud.normals.mean(axis=0))

    @property
    def points(self) -> Array:
        """(m, 3) the points themselves."""
        return self.cloud.points

    def start(self, vertices: int, tunnels: float | None) -> Start:
        """Return the dual of a coarse surface around the points."""
        from simplexmesh.motion.initial.from_points import start_from_points

        try:
            start = start_from_points(self.cloud, vertices, components=self.components, tunnels=tunnels or 0.0)
        except TopologyError:
            if self.cloud.normals is None:
                raise
            start = start_from_points(
                PointCloud(self.cloud.points), vertices, components=self.components, tunnels=tunnels or 0.0
            )
            warn("the points' normals bound no solid and were left out")
            self.cloud = PointCloud(self.cloud.points)
        self._indicator = start.indicator
        if self.cloud.normals is not None and start.indicator is not None:
            inward = start.indicator.at(self.cloud.points)[1]
            if (inward * self.cloud.normals).sum() > 0:
                warn("the points' normals point inwards and were flipped")
                self.cloud = PointCloud(self.cloud.points, -self.cloud.normals)
        return start


class TrianglesSubject:
    """A triangulated surface."""

    encloses = False

    def __init__(self, triangles: TriangleMesh, components: str) -> None:
        from simplexmesh.motion.targets.triangles import Triangles

        self.triangles, self.components = triangles.oriented(), components
        self.target: Target = Triangles(self.triangles)
        self.resolution = float(np.linalg.norm(np.ptp(triangles.vertices, axis=0))) / 200

    @cached_property
    def sampled(self) -> PointCloud:
        """Even samples of the surface with normals, always the same."""
        return self.triangles.sampled(40_000, rng=0)

    @property
    def facing(self) -> Array | None:
        """(3,) the mean of the normals."""
        return None if self.sampled.normals is None else np.asarray(self.sampled.normals.mean(axis=0))

    @property
    def points(self) -> Array:
        """(m, 3) the vertices used by faces, and even samples of the surface."""
        used = np.unique(self.triangles.faces)
        return np.concatenate([self.triangles.vertices[used], self.sampled.points])

    def start(self, vertices: int, tunnels: float | None) -> Start:
        """Return the dual of a coarse surface around even samples of the triangles."""
        from simplexmesh.motion.initial.from_points import start_from_points

        start = start_from_points(self.sampled, vertices, components=self.components, tunnels=tunnels or 0.0)
        known = self.triangles.topology
        if known.n_components == 1 and not known.n_borders and known.genus != start.report.genus and not tunnels:
            warn(
                f"the surface has genus {known.genus}, the model has {start.report.genus}: handles finer than the "
                "resolution of its start are lost; more vertices may keep them"
            )
        return start


def as_subject(
    data: Any, *, level: float | None, label: int | None, inside: str, components: str, poses: Any = None
) -> Subject:
    """Return the adapter for data of any kind: own types, arrays, PyVista or trimesh objects, a path, or scans.

    Raises
    ------
    ValueError, TypeError, OSError
        For invalid data, or a level or label that does not fit it.
    """
    if isinstance(data, list | tuple) and not data:
        raise ValueError("data must be at least one scan, not an empty list")
    if are_scans(data) or poses is not None:
        scans = data if isinstance(data, list | tuple) else [data]
        item: Any = joined_scans(scans, poses)
    elif isinstance(data, tuple) and len(data) == 2:
        item = as_triangles(data, "data")
    else:
        item = as_data(data)
    if isinstance(item, SimplexMesh):
        item = item.triangulated()
    _check.size("data", item.bounds)
    if isinstance(item, Volume):
        if item.range[0] == item.range[1] and label is None:
            raise ValueError(f"volume must hold an object and its surroundings; it is {item.range[0]:g} everywhere")
        if level is not None and label is not None:
            raise ValueError("give level or label, not both")
        if label is not None or (level is None and item.is_labels):
            if inside != "above":
                raise ValueError("inside is for a level of a volume, not for labels")
            return LabelSubject(item, label, components)
        return VolumeSubject(item, level, inside, components)
    if level is not None or label is not None:
        raise ValueError(f"level and label are for volumes, not for {type(item).__name__}")
    if inside != "above":
        raise ValueError(f"inside is for a level of a volume, not for {type(item).__name__}")
    if isinstance(item, TriangleMesh):
        return TrianglesSubject(item, components)
    return PointsSubject(item, components)
