"""Global rigid registration of two surfaces, without an initial guess."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import warn
from simplexmesh._base.html import card
from simplexmesh._base.progress import Progress, reporting
from simplexmesh.data.points import PointCloud
from simplexmesh.data.poses import Posed
from simplexmesh.numerics.rigid import rotation_angle
from simplexmesh.recognition.register import pose_scoring
from simplexmesh.recognition.register._kernels_pose_scoring import TargetGrid
from simplexmesh.recognition.register.icp import (
    MINIMUM_INLIERS,
    about_origin,
    between_frames,
    find_correspondences,
    refined,
    uncertainty,
)
from simplexmesh.recognition.register.oriented_points import OrientedPoints, check_units, oriented_pair
from simplexmesh.recognition.register.pose_candidates import pose_candidates
from simplexmesh.recognition.register.pose_scoring import Source, distinct, target_grid
from simplexmesh.recognition.register.verify import Evaluation, Verifier

SCORED, REFINED, VERIFIED = 400, 700, 2000
"""Numbers of points that motions are scored and refined with on the grid, and verified with on both surfaces."""

COARSE, FINE, EVALUATED = 400, 100, 24
"""Numbers of candidates that are refined coarsely on the grid, finely on the grid, and on the points."""

MAXIMUM_LOSS = 0.4
"""Candidates whose score on the grid is lower than the best one's by more than this fraction are not refined on the
points: twice takes a tenth more time and lists 2.6 times as many poses; none of 22 registrations was found better."""

FEW = 200
"""Of fewer points, not the same ones of both surfaces, many poses are wrong: of 60 all are off by over 10 degrees."""

WHOLE = 0.5
"""Least score, or overlap, of closed surfaces, all of which can agree: coarse models of a body have 0.3 and 0.7, other
bodies at most 0.25 and 0.31, a mirrored femur 0.19 and 0.33; mirror images that hardly differ have more."""

SAME = 0.05
"""In spacings of the points: how near they are in a pose if they are the same ones, measured twice."""


@dataclass(frozen=True, eq=False, repr=False)
class Pose:
    """A candidate pose of a surface on another.

    Attributes
    ----------
    T_target_source : (4, 4) array of float
    score, overlap : float
        As in `Registration`.
    equivalent : bool
        Whether the data does not distinguish it from the best pose.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 2, 1), 12)
    >>> [pose.equivalent for pose in sm.register(egg, egg).poses]
    [True, True, True]
    >>> Pose(np.diag([-1.0, -1.0, 1.0, 1.0]), 0.9, 0.8, True)
    Pose(score 0.90, overlap 80%, turned by 180.0 degrees, equivalent)
    """

    T_target_source: Array
    score: float
    overlap: float
    equivalent: bool

    def __repr__(self) -> str:
        turn = np.degrees(rotation_angle(self.T_target_source))
        said = f"score {self.score:.2f}, overlap {self.overlap:.0%}, turned by {turn:.1f} degrees"
        return f"Pose({said}{', equivalent' if self.equivalent else ''})"


@dataclass(frozen=True, eq=False, repr=False)
class Registration(Posed):
    """The pose of the source on the target; made by `register`.

    Attributes
    ----------
    T_target_source : (4, 4) array of float
        Maps coordinates of the source to the target's frame.
    error : float
        Root mean square distance of the source to the target's tangent planes, where they overlap, in the data's unit.
    overlap : float
        The fraction of the source that lies on the target.
    score : float
        At most 1: the fraction of the smaller surface that agrees with the other in distance and normals, less what is
        near but off it.
    ambiguous : bool
        Whether other poses fit as well: the object, or its common part, is symmetric.
    poses : tuple of Pose
        Other poses, best first; some may be `equivalent`.
    open_motions : (k, 6) array of float
        Small motions in the target's frame, each a rotation vector and a shift, under which the surface slides along
        itself: one for a surface of revolution, two for a cylinder, three for a sphere or a plane.
    covariance : (6, 6) array of float
        Of a small motion after `T_target_source`: a rotation vector in radians about the target's origin, and a shift.
        It accounts for noise, not for ambiguity; open motions have very large variances.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ring = sm.torus(radius=2.0, tube_radius=0.7).triangulated()
    >>> found = sm.register(ring.sampled(2000, rng=0), ring.sampled(2000, rng=1))
    >>> found.ambiguous, len(found.open_motions)
    (True, 1)
    """

    T_target_source: Array
    error: float
    overlap: float
    score: float
    ambiguous: bool
    poses: tuple[Pose, ...]
    open_motions: Array
    covariance: Array
    _points: tuple[Array, ...] = ()  # of source and target, which a notebook shows

    def _repr_html_(self) -> str:
        """Return a picture of the two together and a table of the fit and the motion, as notebooks show."""
        rows = {
            "score, overlap": f"{self.score:.2f}, {self.overlap:.0%}",
            "error": f"{self.error:.3g}",
            "turned by": f"{np.degrees(rotation_angle(self.T_target_source)):.2f} degrees",
            "shifted by": ", ".join(f"{value:.4g}" for value in self.T_target_source[:3, 3]),
            "other poses": f"{sum(pose.equivalent for pose in self.poses)} as good"
            if self.ambiguous
            else "none as good",
        }
        clouds = [PointCloud(points) for points in self._points]
        shown = (clouds[0].transformed(self.T_target_source), clouds[1]) if clouds else ()
        return card("Registration", rows, *shown)

    def __repr__(self) -> str:
        others = sum(pose.equivalent for pose in self.poses)
        said = f", ambiguous: {others} other poses, {len(self.open_motions)} open motions" if self.ambiguous else ""
        return f"Registration(score {self.score:.2f}, overlap {self.overlap:.0%}, error {self.error:.3g}{said})"


def register(
    source: Any,
    target: Any,
    *,
    level: float | tuple[float | None, float | None] | None = None,
    label: int | tuple[int | None, int | None] | None = None,
    inside: str | tuple[str, str] = "above",
    minimum_score: float = 0.1,
    progress: bool | Progress = False,
) -> Registration:
    """Find the rigid motion between two objects, without an initial guess and without scaling.

    Candidates come from votes of point pair features (Drost and others 2010). They are refined by point-to-plane steps
    and scored by how much of both surfaces agrees; the best is refined on all points.

    Parameters
    ----------
    source, target : SimplexMesh, TriangleMesh, PointCloud, Volume, array, pyvista or trimesh object, path, or scans
        In one unit. Either may be partial. Missing normals are estimated.
    level, label, inside : as in `reconstruct`, or pairs of these, optional
        The surface of those of the two that are volumes, or of (source, target).
    minimum_score : float
        The score below which a warning is given; wrong poses of scans without symmetry have less than 0.1. It tells
        these from right ones, which an overlap of points that happen to be near does not.
    progress : bool or callable
        True shows a bar; a function is called with the fraction done and a message.

    Returns
    -------
    Registration

    Raises
    ------
    ValueError, TypeError, OSError
        Data that is missing, fewer than 50 points, two units, or nothing that agrees in any pose.

    Warns
    -----
    SimplexMeshWarning
        The best pose has less than the minimum score, or of closed surfaces a score and an overlap below 0.5, there are
        fewer than 200 points, or the normals of source and target were opposite.

    References
    ----------
    H. Delingette, thesis, 1994, section 6.3.3 (points to planes, equation 6.11); B. Drost, M. Ulrich, N. Navab,
    S. Ilic, *Model globally, match locally*, CVPR 2010 (pairs).

    Examples
    --------
    >>> import numpy as np
    >>> import simplexmesh as sm
    >>> egg = sm.sphere(12)
    >>> egg = egg.moved(egg.vertices * [1.6, 1.3, 1.0] + 0.1 * egg.vertices**2)
    >>> T = np.array([[0, -1.0, 0, 5], [1, 0, 0, 0], [0, 0, 1, -2], [0, 0, 0, 1]])
    >>> moved = egg.vertices @ T[:3, :3].T + T[:3, 3]
    >>> found = sm.register(egg, moved)
    >>> bool(np.allclose(found.T_target_source, T, atol=0.01))
    True
    """
    minimum_score = checks.number("minimum_score", minimum_score, 0.0, 1.0)
    with reporting(progress, "registering") as report:
        report(0.0, "reading")
        moving, fixed = oriented_pair(source, target, level, label, inside)
        check_units(moving, fixed)
        found = _registered(moving, fixed, minimum_score, report)
        report(1.0, "done")
    return replace(found, _points=(moving.points, fixed.points))


def _registered(source: OrientedPoints, target: OrientedPoints, minimum_score: float, report: Progress) -> Registration:
    """Return the pose; if none fits, and the sign of normals was given, that with the source's normals flipped."""
    found = _poses(source, target, report)
    if found.score < minimum_score and (source.given or target.given):
        flipped = _poses(source.flipped(), target, report)
        if flipped.score >= minimum_score:
            warn("the normals of source and target are opposite; those of the source were flipped")
            return flipped
    if not found.score > 0:
        raise ValueError("source and target must agree somewhere; in the best pose found they do not")
    if not np.isfinite(found.error):
        raise ValueError(
            f"source and target must have at least {MINIMUM_INLIERS} points in common; the best pose found has fewer"
        )
    if found.score < minimum_score:
        warn(
            f"the best pose found may be wrong: its score is {found.score:.2f}, its overlap {found.overlap:.0%}, and "
            f"scores below {minimum_score:g} are those of chance"
        )
    elif max(found.score, found.overlap) < WHOLE and source.is_closed and target.is_closed:
        warn(
            f"the best pose found may be wrong: its score is {found.score:.2f}, its overlap {found.overlap:.0%}, and "
            "closed surfaces of one body agree nearly everywhere; mirror images do not, as no rotation makes them one"
        )
    few = min(len(source.points), len(target.points))
    if few < FEW and found.score >= minimum_score and found.error > SAME * source.spacing:
        warn(f"the best pose found may be wrong: {few} points tell little of a shape, {FEW} and more most of it")
    return found


def _poses(source: OrientedPoints, target: OrientedPoints, report: Progress) -> Registration:
    """Return the best pose of a surface on another, and the others, in the frames and unit of the data."""
    report(0.4, "voting")
    rng = np.random.default_rng(0)
    centers = source.points.mean(axis=0), target.points.mean(axis=0)
    unit = max(source.extent, target.extent)
    moving, fixed = source.normalized_to(centers[0], unit), target.normalized_to(centers[1], unit)
    smooth_moving, smooth_fixed = moving.on_planes(), fixed.on_planes()
    size = min(moving.extent, fixed.extent)
    rows = smooth_moving.sample(SCORED, rng), smooth_moving.sample(REFINED, rng)
    candidates = pose_candidates(smooth_moving, smooth_fixed, size, rng)
    report(0.6, "refining candidates")
    scored = pose_scoring.source_of(smooth_moving, smooth_fixed, rows, size)
    starts = refined_candidates(scored, target_grid(smooth_fixed), candidates)
    verifier = Verifier.of(smooth_moving, smooth_fixed, size, VERIFIED, rng)
    evaluations = evaluated_candidates(verifier, starts)
    report(0.9, "refining")
    return _as_registration(*conclude(verifier, evaluations, moving, fixed), centers, unit)


def refined_candidates(source: Source, grid: TargetGrid, motions: Array) -> Array:
    """Return the motions (h, 12) that the candidates converge to on the grid, distinct and best first."""
    (scores,) = pose_scoring.scores([source], grid, [motions])
    for stage, count in enumerate((COARSE, FINE)):
        order = np.argsort(-scores, kind="stable")[:COARSE]
        order = order[distinct(motions[order], count, source.size)] if stage else order
        (motions,) = pose_scoring.refined([source], grid, [motions[order]], stage=stage)
        (scores,) = pose_scoring.scores([source], grid, [motions], stage=stage + 1)
    order, best = np.argsort(-scores, kind="stable"), scores.max()
    motions = motions[order[scores[order] >= best - MAXIMUM_LOSS * abs(best)]]
    return motions[distinct(motions, EVALUATED, source.size)]


def evaluated_candidates(verifier: Verifier, motions: Array) -> list[Evaluation]:
    """Return the evaluations of motions (h, 12), refined on a sample of the points, distinct and best first."""
    found = sorted((verifier.settled(motion, 8) for motion in motions), key=lambda evaluation: -evaluation.score)
    ends = np.array([evaluation.T[:3].ravel() for evaluation in found])
    return [found[k] for k in distinct(ends, EVALUATED, verifier.size, factor=1.5)]  # flat minima are wide


def conclude(
    verifier: Verifier, evaluations: list[Evaluation], source: OrientedPoints, target: OrientedPoints
) -> tuple[Evaluation, list[tuple[Evaluation, bool]], Array, Array]:
    """Return the best evaluation, the others with whether they are equivalent, open motions and covariance."""
    first, moving, fixed = evaluations[0], source.on_quadrics(), target.on_quadrics()
    tree = cKDTree(fixed.points)
    best = verifier.evaluated(refined(moving, fixed, tree, first.T, verifier.reach))
    T = best.T
    covariance, error = uncertainty(source, target, find_correspondences(moving, fixed, tree, T, verifier.reach), T)
    others = [(each, each.is_equivalent(first)) for each in evaluations[1:]]
    return replace(best, error=error), others, verifier.open_motions(T), covariance


def _as_registration(
    best: Evaluation, others: list[tuple[Evaluation, bool]], open_motions: Array, covariance: Array,
    centers: tuple[Array, Array], unit: float,
) -> Registration:  # fmt: skip
    """Return the result in the frames and unit of the data, whose centers are those of source and target."""

    def in_data_frame(T: Array) -> Array:
        return checks.frozen(between_frames(T, *centers, unit))

    A = about_origin(centers[1]) @ np.diag([1.0] * 3 + [unit] * 3)
    poses = tuple(Pose(in_data_frame(each.T), each.score, each.overlap, bool(same)) for each, same in others)
    return Registration(
        T_target_source=in_data_frame(best.T),
        error=best.error * unit,
        overlap=best.overlap,
        score=best.score,
        ambiguous=bool(len(open_motions)) or any(pose.equivalent for pose in poses),
        poses=poses,
        open_motions=checks.frozen(open_motions @ A.T),
        covariance=checks.frozen(A @ covariance @ A.T if np.isfinite(best.error) else covariance),
    )
