"""Two of several scans: prepared once per scan, registered without a guess, refined from a guess, and compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.units import common_unit
from simplexmesh._base.vectors import dot, norm
from simplexmesh.recognition.register._kernels_pose_scoring import TargetGrid
from simplexmesh.recognition.register.icp import MINIMUM_COSINE, find_correspondences, refined, uncertainty
from simplexmesh.recognition.register.oriented_points import OrientedPoints, are_inside_out, oriented_points
from simplexmesh.recognition.register.pose_candidates import pose_candidates
from simplexmesh.recognition.register.pose_scoring import source_of, target_grid
from simplexmesh.recognition.register.register import (
    REFINED,
    SCORED,
    VERIFIED,
    evaluated_candidates,
    refined_candidates,
)
from simplexmesh.recognition.register.verify import Evaluation, Verifier

Pair = tuple[int, int]
"""The numbers of a source and its target among the scans."""

MATCHED = 5_000
"""Points of each scan that are matched in refinements: more change poses by less than their error."""

WIDEST = 0.03
"""Widest reach of a refinement, in extents of the smaller scan: farther points belong to something else."""

COARSE_STRIDE, COARSE_STEPS, FINE_STEPS = 5, 10, 20
"""Which of these points, and how many steps, make a refinement with a wide reach; and the steps with a narrow one."""

NEIGHBORS, BORDER = 32, 0.2
"""Points around one, and how far off the mean of these is at a border, in their radii."""

MOST_EVALUATED = 12
"""Poses of a pair that are refined on its points: other pairs make up for one that is missed, so fewer than for two."""


@dataclass(frozen=True, eq=False)
class Scan:
    """A scan about its center, in the unit of all scans, with all that does not depend on what it is compared with."""

    surface: OrientedPoints
    center: Array  # (3,) in the frame of the data
    unit: float  # length in the data that is 1 here
    turned: bool = False  # whether its normals are opposite to those of the data

    @staticmethod
    def all_of(scans: list[Any], names: tuple[str, ...]) -> list[Scan]:
        """Return data of any kind as scans in one unit, with normals that seem to be outward."""
        surfaces = [oriented_points(scan, name) for scan, name in zip(scans, names, strict=True)]
        common_unit("scans", surfaces)
        largest = max(range(len(surfaces)), key=lambda k: surfaces[k].extent)
        unit = surfaces[largest].extent
        for surface, name in zip(surfaces, names, strict=True):
            if max(surface.spacing, surfaces[largest].spacing) > 0.5 * surface.extent:
                raise ValueError(
                    f"scans must be in one unit: {name} has an extent of {surface.extent:.3g}, "
                    f"{names[largest]} of {unit:.3g}"
                )
        centers = [surface.points.mean(axis=0) for surface in surfaces]
        scans = [
            Scan(surface.normalized_to(center, unit), center, unit)
            for surface, center in zip(surfaces, centers, strict=True)
        ]
        return [scan.flipped if scan.is_inside_out else scan for scan in scans]

    @cached_property
    def flipped(self) -> Scan:
        """The scan with opposite normals."""
        out = Scan(self.surface.flipped(), self.center, self.unit, not self.turned)
        out.__dict__["flipped"] = self
        return out

    @property
    def is_inside_out(self) -> bool:
        """Whether the normals were given and seem to be inward."""
        points = self.surface.points
        return self.surface.given and are_inside_out(points, self.surface.normals, points)

    @cached_property
    def extent(self) -> float:
        """Diagonal of the bounding box of the points."""
        return self.surface.extent

    @cached_property
    def smooth(self) -> OrientedPoints:
        """The points on planes through their neighbors."""
        return self.surface.on_planes()

    @cached_property
    def fine(self) -> OrientedPoints:
        """The points on quadrics through their neighbors."""
        return self.surface.on_quadrics()

    @cached_property
    def rows(self) -> tuple[Indices, Indices, Indices]:
        """Points to score, refine and verify motions with."""
        rng = np.random.default_rng(0)
        scored, refining, verified = (self.surface.sample(count, rng) for count in (SCORED, REFINED, VERIFIED))
        return scored, refining, verified

    @cached_property
    def matched(self) -> tuple[OrientedPoints, OrientedPoints]:
        """The points to match in refinements, as measured and on quadrics, in random order."""
        rows = np.random.default_rng(1).permutation(self.surface.sample(MATCHED, np.random.default_rng(1)))
        measured, fine = (
            replace(each, points=each.points[rows], normals=each.normals[rows], fine=None)
            for each in (self.surface, self.fine)
        )
        return measured, fine

    @cached_property
    def grid(self) -> TargetGrid:
        """The grid of nearest points."""
        return target_grid(self.smooth)

    @cached_property
    def tree(self) -> cKDTree:
        """The tree of the smooth points."""
        return cKDTree(self.smooth.points)

    @cached_property
    def fine_tree(self) -> cKDTree:
        """The tree of the fine points."""
        return cKDTree(self.fine.points)

    @cached_property
    def inward(self) -> Array:
        """(n, 3) where the neighbors of fine points are in the mean, in radii of these: 0.42 long at a border."""
        points = self.fine.points
        distances, near = self.fine_tree.query(points, k=min(NEIGHBORS, len(points)), workers=-1)
        return np.asarray((points[near].mean(axis=1) - points) / np.maximum(distances[:, -1:], 1e-300))


@dataclass(frozen=True, eq=False)
class Measured:
    """The pose (4, 4) of one scan on another, and how well they fit, in the unit of all scans."""

    T: Array
    covariance: Array  # (6, 6) of a small motion after T
    error: float  # root mean square distance that remains
    near: float  # fraction of the smaller scan near the other
    agreement: float  # fraction of those that lie on it


def verifier_of(source: Scan, target: Scan) -> Verifier:
    """Return what evaluates poses of one scan on another."""
    size = min(source.extent, target.extent)
    width, reach = Verifier.tolerances(source.smooth, target.smooth, size)
    samples = source.rows[2], target.rows[2]
    return Verifier(source.smooth, target.smooth, (source.tree, target.tree), samples, width, reach, size)


def search(source: Scan, target: Scan) -> list[Evaluation]:
    """Return poses of one scan on another, without a guess, best first."""
    verifier = verifier_of(source, target)
    candidates = pose_candidates(source.smooth, target.smooth, verifier.size, np.random.default_rng(0))
    scored = source_of(source.smooth, target.smooth, source.rows[:2], verifier.size)
    starts = refined_candidates(scored, target.grid, candidates)
    return evaluated_candidates(verifier, starts[:MOST_EVALUATED])


def measure(source: Scan, target: Scan, T: Array, *, wider: Sequence[float] = (1.0,)) -> Measured:
    """Return the pose of one scan on another near T (4, 4), refined on the points within so many reaches in turn."""
    reach = verifier_of(source, target).reach
    measured, fine = source.matched
    for factor in wider:
        stride, steps = (COARSE_STRIDE, COARSE_STEPS) if factor > 1 else (1, FINE_STEPS)
        within = max(reach, min(factor * reach, WIDEST * min(source.extent, target.extent)))
        rows = slice(None, None, stride)
        T = refined(fine, target.fine, target.fine_tree, T, within, chosen=rows, iterations=steps)
    found = find_correspondences(fine, target.fine, target.fine_tree, T, reach)
    return Measured(T, *uncertainty(measured, target.surface, found, T), *contact(source, target, T))


def contact(source: Scan, target: Scan, T: Array, *, wider: float = 1.0) -> tuple[float, float]:
    """Return the fraction of the smaller scan that T (4, 4) brings near the other, and the share of it that agrees.

    Beyond the border of the other scan, farther along its surface from a point there than points are apart, nothing is
    near; between its lines, and where it is sparse, points of both sides are around.
    """
    if source.surface.area > target.surface.area:
        source, target, T = target, source, np.asarray(np.linalg.inv(T), np.float64)
    verifier = verifier_of(source, target)
    found = find_correspondences(
        source.fine, target.fine, target.fine_tree, T, wider * verifier.reach, verifier.samples[0]
    )
    ways = found.points - target.fine.points[found.nearest]
    spacing = max(source.surface.spacing, target.surface.spacing)
    along = norm(ways) ** 2 - found.residual**2
    outward = -dot(ways, target.inward[found.nearest]) > BORDER * norm(ways)
    near = found.near & ~(outward & (along > spacing**2))
    near &= found.cosine > -MINIMUM_COSINE  # the other side of a thin wall speaks neither for nor against
    agreeing = near & found.inlier & (np.abs(found.residual) < verifier.width)
    return float(near.mean()), float(agreeing.sum() / max(near.sum(), 1))
