"""The kinds of data that can be reconstructed: each gives points of its surface, a target and a start."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import counted, warn
from simplexmesh._base.vectors import dot
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume
from simplexmesh.motion.reconstruct.outer_side import are_inward, outward_cloud
from simplexmesh.motion.start.from_points import start_from_points
from simplexmesh.motion.start.from_volume import start_from_volume
from simplexmesh.motion.start.grid_crossings import crossings_of_largest, outer_crossings
from simplexmesh.motion.start.report import Start
from simplexmesh.motion.targets.isosurface import Isosurface
from simplexmesh.motion.targets.labels import LabelSurface
from simplexmesh.motion.targets.points import Points
from simplexmesh.motion.targets.protocol import Target
from simplexmesh.motion.targets.triangles import Triangles

MOST_LEFT_OUT = 0.1
"""Fraction of the surface on omitted components above which a warning is given."""

LEAST_TOLD = 0.001
"""Share of samples on pieces too small for a mesh from which a warning is given: most labels have stray voxels."""

MOST_BARE = 0.9
"""Share of the closed mesh around points that may be far from all of them; few and scattered points show no surface."""

ON_A_LINE = 1e-12
"""Second largest variance of points that lie on a line, up to rounding, in squared diagonals."""

START_SHARE = 0.42
"""Fraction of the vertices in the start when refinement adds the others: 720 of 1,700, as in the thesis."""


class Input(ABC):
    """Data to be reconstructed; nothing about it changes."""

    source: Volume | PointCloud | TriangleMesh
    components: str  # "largest" or "all"
    layered = False  # whether other surfaces may lie close inside the one wanted

    @property
    def oriented(self) -> bool:
        """Whether the normals of `samples` are known to point outwards."""
        return False

    @property
    def leaves_bodies(self) -> bool:
        """Whether the data is known to be of several bodies of which only the largest is wanted."""
        return False

    @cached_property
    def diagonal(self) -> float:
        """Length of the diagonal of the box around the points, in the data's unit."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @property
    @abstractmethod
    def resolution(self) -> float:
        """Distance between neighboring samples, in the data's unit."""

    @property
    @abstractmethod
    def points(self) -> Array:
        """(m, 3) points on the surface wanted, to which distances are measured."""

    @property
    @abstractmethod
    def target(self) -> Target:
        """The target that attracts a mesh, as oriented as the data."""

    @abstractmethod
    def samples(self) -> PointCloud:
        """Return points spread over the surface, with normals where the data has them."""

    @abstractmethod
    def start(self, vertices: int, tunnels: float | None) -> tuple[Start, Target]:
        """Return a mesh near the data with its topology and about this number of vertices, and the target."""

    def without(self, start: Start) -> Input:
        """Return the data without the pieces that a start left out: no distances are measured to them."""
        return self

    def turned_outward(self, *, enclosed: bool = True) -> Input:
        """Return the data with normals away from the centroid of its border; points get some if `enclosed`."""
        return self


@dataclass(frozen=True, eq=False)
class VolumeInput(Input):
    """The isosurface of a volume, its object above the level, or one region of a label volume."""

    source: Volume
    components: str
    level: float | None
    label: int | None
    layered = True

    @property
    def resolution(self) -> float:
        """The smallest spacing."""
        return float(np.min(self.source.spacing))

    @cached_property
    def target(self) -> Isosurface | LabelSurface:
        """The isosurface, or the boundary of the region."""
        return LabelSurface(self.source, self.label) if self.level is None else Isosurface(self.source, self.level)

    @cached_property
    def points(self) -> Array:
        """(m, 3) points where grid lines leave the object, with a warning if many are on components left out."""
        volume, level = self.source, self.level
        if level is None:
            assert self.label is not None
            volume, level = volume.mask(self.label), 0.5
        if self.components == "all":
            return outer_crossings(volume, level)
        largest, left = crossings_of_largest(volume, level)
        if left > MOST_LEFT_OUT:
            warn(f"{left:.0%} of the surface is on smaller pieces that are left out; components='all' keeps them")
        return largest

    def samples(self) -> PointCloud:
        """Return the points, without normals."""
        return PointCloud(self.points)

    def start(self, vertices: int, tunnels: float | None) -> tuple[Start, Target]:
        """Return the dual of a coarse isosurface, of the smoothed region for a label."""
        options: Any = {"components": self.components, "tunnels": tunnels}
        start = start_from_volume(self.source, self.level, self.label, vertices, **options)
        if start.report.share_dropped >= LEAST_TOLD:
            pieces = counted(start.report.components_dropped, "piece", "pieces")
            share = f"{min(100 * start.report.share_dropped, 99):.2g} % of its samples"
            whole = "label" if self.level is None else "object"
            warn(f"left out {pieces} of the {whole}, {share}: too small for a mesh of {vertices:,} vertices")
        return start, self.target

    def without(self, start: Start) -> VolumeInput:
        """Return the region without the pieces that a start left out."""
        if start.left_out is None or self.label is None:
            return self
        kept = self.source.mask(self.label).values.astype(bool) & ~start.left_out
        return replace(self, source=replace(self.source, values=kept.astype(np.uint8)), label=1)


@dataclass(frozen=True, eq=False)
class PointsInput(Input):
    """A point cloud, with or without normals."""

    source: PointCloud
    components: str

    @property
    def resolution(self) -> float:
        """The diagonal over the square root of the number of points."""
        return self.diagonal / max(float(np.sqrt(len(self.points))), 1.0)

    @property
    def points(self) -> Array:
        """(m, 3) the points themselves."""
        return self.source.points

    @cached_property
    def target(self) -> Points:
        """The surface of the points."""
        return Points(self.source)

    def samples(self) -> PointCloud:
        """Return the points themselves."""
        return self.source

    def start(self, vertices: int, tunnels: float | None) -> tuple[Start, Target]:
        """Return the dual of a coarse surface around the points, and the target with normals that point out of it."""
        cloud = self.source
        sides = np.linalg.eigvalsh(np.cov((cloud.points / self.diagonal).T))
        if sides[1] <= ON_A_LINE:
            raise ValueError("data must have points of a surface: those given lie on a line")
        options: Any = {"components": self.components, "tunnels": tunnels or 0.0}
        start = start_from_points(cloud, vertices, **options)
        if start.report.openness > 2 * MOST_BARE:
            raise ValueError("data must have more points, or more evenly spaced ones: those given show no surface")
        if start.report.is_open and cloud.normals is not None:
            other = start_from_points(replace(cloud, normals=None), vertices, **options)
            if not other.report.is_open:
                start, cloud = other, replace(cloud, normals=None)
                warn("the points' normals bound no solid and were left out")
        elif start.report.is_open:
            more = int(vertices * max(1.0, START_SHARE / (1 - start.report.openness / 2)))  # many are on lids
            doubled = start.report.doubled
            start = start_from_points(outward_cloud(cloud, is_open=True), more, **options)
            start = replace(start, report=replace(start.report, doubled=doubled))
        assert start.indicator is not None
        inward = start.indicator.at(cloud.points)[1]
        if cloud.normals is None:
            known = inward.any(axis=1)
            cloud = replace(cloud.selected(known), normals=-inward[known])
        elif (inward * cloud.normals).sum() > 0:
            warn("the points' normals point inwards and were flipped")
            cloud = replace(cloud, normals=-cloud.normals)
        return start, Points(cloud)

    def turned_outward(self, *, enclosed: bool = True) -> PointsInput:
        """Return the points with normals away from the center of their openings."""
        if self.source.normals is None and not enclosed:
            return self
        return replace(self, source=outward_cloud(self.source))


@dataclass(frozen=True, eq=False)
class TrianglesInput(Input):
    """A triangulated surface."""

    source: TriangleMesh
    components: str

    @property
    def resolution(self) -> float:
        """Half a percent of the diagonal."""
        return float(np.linalg.norm(np.ptp(self.source.vertices, axis=0))) / 200

    @property
    def oriented(self) -> bool:
        """Whether the surface is closed: its triangles then have been turned outward."""
        return not self.source.topology.n_borders

    @property
    def leaves_bodies(self) -> bool:
        """Whether the surface has several components, and only the largest is wanted."""
        return self.components != "all" and self.source.n_components > 1

    @cached_property
    def points(self) -> Array:
        """(m, 3) the vertices used by faces, and even samples of the surface."""
        used = np.unique(self.source.faces)
        return np.concatenate([self.source.vertices[used], self._sampled.points])

    @cached_property
    def target(self) -> Triangles:
        """The surface itself."""
        return Triangles(self.source)

    @cached_property
    def _sampled(self) -> PointCloud:
        return self.source.sampled(40_000, rng=0)

    def samples(self) -> PointCloud:
        """Return even samples of the surface with normals, always the same."""
        return self._sampled

    def start(self, vertices: int, tunnels: float | None) -> tuple[Start, Target]:
        """Return the dual of a coarse surface around even samples of the triangles, and these facing out of it."""
        options: Any = {"components": self.components, "tunnels": tunnels or 0.0, "cavities": self.components == "all"}
        start = start_from_points(self._sampled, vertices, **options)
        known = self.source.topology
        if known.n_components == 1 and not known.n_borders and known.genus != start.report.genus and not tunnels:
            lost = start.report.genus < known.genus
            why = "finer handles are lost" if lost else "handles came about where it meets itself"
            told = f"the surface has genus {known.genus}, the start of the model {start.report.genus}"
            warn(f"{told}: {why}; more vertices may help")
        points, normals = self._sampled.points, self._sampled.normals
        assert start.indicator is not None
        assert normals is not None
        if dot(start.indicator.at(points)[1], normals).sum() <= 0:
            return start, self.target
        warn("the triangles face inwards and were flipped")
        return start, self._flipped.target

    def turned_outward(self, *, enclosed: bool = True) -> TrianglesInput:
        """Return an open surface with its triangles turned away from the centroid of its border."""
        border, surface = self.target.border.points, self.source
        if not len(border):
            return self
        centers = surface.vertices[surface.faces].mean(axis=1)
        if not are_inward(centers, surface.face_vectors, border.mean(axis=0)):
            return self
        return self._flipped

    @property
    def _flipped(self) -> TrianglesInput:
        return replace(self, source=replace(self.source, faces=self.source.faces[:, ::-1]))
