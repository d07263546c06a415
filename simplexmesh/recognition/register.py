"""Global rigid registration of two surfaces, without an initial guess."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh import _check
from simplexmesh.errors import warn
from simplexmesh.motion.progress import Report, reporting
from simplexmesh.recognition.grid_scoring import GridScorer, grid_scorer
from simplexmesh.recognition.icp import MINIMUM_INLIERS, about_origin, find_correspondences, refined, uncertainty
from simplexmesh.recognition.pose_candidates import pose_candidates
from simplexmesh.recognition.rotation_vectors import rotation_angle
from simplexmesh.recognition.surfaces import Surface, check_units, surface_of
from simplexmesh.recognition.verify import Evaluation, Verifier

Array = NDArray[np.float64]

COARSE_CANDIDATES, FINE_CANDIDATES, EVALUATED = 400, 100, 24
"""Numbers of candidates that are refined coarsely on the grid, finely on the grid, and on the points."""

SAME_ANGLE, SAME_SHIFT = np.radians(12.0), 0.1
"""Poses nearer to each other than this, in angle and shift, are duplicates: one flat minimum of the error."""

MINIMUM_RATIO = 0.6
"""Least ratio of a candidate's score on the grid to the best one's to be refined on the points."""

SAMPLES = 2000
FIRST_ITERATIONS = 8

KEPT_SCORE = 0.6
"""The last refinement is discarded if less than this fraction of the score is left; it uses other surfaces."""

STEP_RATIO = 0.03
"""The last refinement ends when a step is smaller than this fraction of the pose's standard error."""


@dataclass(frozen=True, eq=False, repr=False)
class Pose:
    """A candidate pose of a surface on another.

    Attributes
    ----------
    T_target_source : (4, 4) array of float
    score : float
        At most 1, as in `Registration`.
    equivalent : bool
        Whether the data does not distinguish it from the best pose.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 2, 1), 12)
    >>> [pose.equivalent for pose in sm.register(egg, egg).poses]
    [True, True, True]
    >>> Pose(np.diag([-1.0, -1.0, 1.0, 1.0]), 0.9, True)
    Pose(score 0.90, turned by 180.0 degrees, equivalent)
    """

    T_target_source: Array
    score: float
    equivalent: bool

    def __repr__(self) -> str:
        turn = np.degrees(rotation_angle(self.T_target_source[:3, :3]))
        return f"Pose(score {self.score:.2f}, turned by {turn:.1f} degrees{', equivalent' if self.equivalent else ''})"


@dataclass(frozen=True, eq=False, repr=False)
class Registration:
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
    inside: str = "above",
    minimum_overlap: float = 0.1,
    progress: bool | Report = False,
) -> Registration:
    """Find the rigid motion between two objects, without an initial guess and without scaling.

    Candidates come from votes of point pair features (Drost and others 2010), the principal axes and a covering of all
    rotations. They are refined by point-to-plane steps and scored by how much of both surfaces agrees; the best is
    refined on all points.

    Parameters
    ----------
    source, target : SimplexMesh, TriangleMesh, PointCloud, Volume, array, pyvista or trimesh object, path, or scans
        In one unit. Either may be partial. Missing normals are estimated.
    level, label : number or pair of numbers, optional
        The surface of volumes, for both or for (source, target); as in `reconstruct`.
    inside : {"above", "below"}
        Side of the level on which a volume's object is, as in `reconstruct`; other data ignores it.
    minimum_overlap : float
        The minimum score, as a fraction of the smaller surface; random poses have less than 0.1.
    progress : bool or callable
        True shows a bar; a function is called with the fraction done and a message.

    Returns
    -------
    Registration

    Raises
    ------
    ValueError, TypeError, OSError
        Data that is missing, fewer than 50 points, two units, or no pose with the minimum overlap.

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
    minimum_overlap = _check.number("minimum_overlap", minimum_overlap, 0.0, 1.0)
    _check.choice("inside", inside, ("above", "below"))
    levels, labels = _pair("level", level), _pair("label", label)
    with reporting(progress) as report:
        report(0.0, "reading")
        moving, fixed = (
            surface_of(data, name, level=levels[k], label=labels[k], inside=inside)
            for k, (name, data) in enumerate((("source", source), ("target", target)))
        )
        check_units(moving, fixed)
        found = _registered_with_either_sign(moving, fixed, minimum_overlap, report)
        report(1.0, "done")
    return found


def _registered_with_either_sign(
    moving: Surface, fixed: Surface, minimum_overlap: float, report: Report
) -> Registration:
    """Return the pose; if none fits, and the sign of normals was given, that with the source's normals flipped."""
    try:
        return _registered(moving, fixed, minimum_overlap, report)
    except ValueError:
        if not (moving.given or fixed.given):
            raise
        with suppress(ValueError):
            found = _registered(moving.flipped(), fixed, minimum_overlap, report)
            warn("the normals of source and target are opposite; those of the source were flipped")
            return found
        raise


def _registered(moving: Surface, fixed: Surface, minimum_overlap: float, report: Report) -> Registration:
    """Return the pose of a surface on another.

    Raises
    ------
    ValueError
        No pose agrees with the minimum.
    """
    report(0.4, "voting")
    rng = np.random.default_rng(0)
    scorer, center, unit = grid_scorer(moving, fixed, rng)
    report(0.6, "refining candidates")
    starts = refined_candidates(scorer, pose_candidates(scorer, rng))
    verifier = Verifier.of(scorer.source, scorer.target, scorer.size, SAMPLES, rng)
    evaluations = evaluated_candidates(scorer, verifier, starts)
    _check_fit(evaluations[0] if evaluations else None, minimum_overlap)
    report(0.9, "refining")
    normalized = (moving.normalized_to(moving.points.mean(axis=0), unit), fixed.normalized_to(center, unit))
    found = conclude(verifier, evaluations, *normalized)
    _check_fit(found[0], minimum_overlap)
    return _as_registration(*found, center, moving.points.mean(axis=0), unit)


def refined_candidates(scorer: GridScorer, motions: Array) -> Array:
    """Return the motions (h, 12) that the candidates converge to on the grid, distinct and best first."""
    scores = scorer.scores(motions)
    for stage, count in enumerate((COARSE_CANDIDATES, FINE_CANDIDATES)):
        order = np.argsort(-scores, kind="stable")[:COARSE_CANDIDATES]
        order = order[scorer.distinct(motions[order], count)] if stage else order
        motions = scorer.refined(motions[order], stage=stage)
        scores = scorer.scores(motions, stage=stage + 1)
    order = np.argsort(-scores, kind="stable")
    motions = motions[order[scores[order] >= MINIMUM_RATIO * scores[order[0]]]]
    return motions[scorer.distinct(motions, EVALUATED)]


def evaluated_candidates(scorer: GridScorer, verifier: Verifier, motions: Array) -> list[Evaluation]:
    """Return the evaluations of motions (h, 12), refined on a sample of the points, distinct and best first."""
    found = []
    for motion in motions:
        start = np.vstack([motion.reshape(3, 4), [0, 0, 0, 1]])
        T = refined(
            verifier.source, verifier.target, verifier.trees[1], start, 2 * verifier.reach,
            chosen=verifier.samples[0], iterations=FIRST_ITERATIONS,
        )  # fmt: skip
        found.append(verifier.evaluated(T))
    found.sort(key=lambda evaluation: -evaluation.score)
    ends = np.array([evaluation.T[:3].ravel() for evaluation in found]).reshape(-1, 12)
    return [found[k] for k in scorer.distinct(ends, EVALUATED, SAME_ANGLE, SAME_SHIFT)]


def conclude(
    verifier: Verifier, evaluations: list[Evaluation], source: Surface, target: Surface
) -> tuple[Evaluation, list[tuple[Evaluation, bool]], Array, Array]:
    """Return the best evaluation, the others with whether they are equivalent, open motions and covariance.

    The best pose is refined on all points, projected to quadrics, which reduces noise. The refinement is discarded if
    it loses the target, as can happen with sparse data. The covariance is that of the
    points as measured.
    """
    first, moving, fixed = evaluations[0], source.on_quadrics(), target.on_quadrics()
    tree = cKDTree(fixed.points)
    best = verifier.evaluated(refined(moving, fixed, tree, first.T, verifier.reach, tolerance=STEP_RATIO))
    best = best if best.score > KEPT_SCORE * first.score else first
    T = best.T
    covariance, error = uncertainty(source, target, find_correspondences(moving, fixed, tree, T, verifier.reach), T)
    others = [(each, each.is_equivalent(first)) for each in evaluations[1:]]
    return replace(best, error=error), others, verifier.open_motions(T), covariance


def _check_fit(best: Evaluation | None, minimum_overlap: float) -> None:
    """Require a minimum score, and enough points in common."""
    score = max(0.0, best.score) if best else 0.0
    if best is None or best.score < minimum_overlap:
        raise ValueError(
            f"source and target must agree on at least {minimum_overlap:.0%} of the smaller; the best pose found has "
            f"{score:.1%}"
        )
    if not np.isfinite(best.error):
        raise ValueError(
            f"source and target must have at least {MINIMUM_INLIERS} points in common; the best pose found has fewer"
        )


def _as_registration(
    best: Evaluation, others: list[tuple[Evaluation, bool]], open_motions: Array, covariance: Array,
    target_center: Array, source_center: Array, unit: float,
) -> Registration:  # fmt: skip
    """Return the result in the frames and unit of the data."""

    def in_data_frame(T: Array) -> Array:
        out = np.eye(4)
        out[:3, :3] = T[:3, :3]
        out[:3, 3] = target_center + unit * T[:3, 3] - T[:3, :3] @ source_center
        return _check.frozen(out)

    A = about_origin(target_center) @ np.diag([1.0] * 3 + [unit] * 3)
    poses = tuple(Pose(in_data_frame(each.T), each.score, bool(same)) for each, same in others)
    return Registration(
        T_target_source=in_data_frame(best.T),
        error=best.error * unit,
        overlap=best.overlap,
        score=best.score,
        ambiguous=bool(len(open_motions)) or any(pose.equivalent for pose in poses),
        poses=poses,
        open_motions=_check.frozen(open_motions @ A.T),
        covariance=_check.frozen(A @ covariance @ A.T),
    )


def _pair(name: str, value: Any) -> tuple[Any, Any]:
    """Return the values for source and target."""
    if isinstance(value, tuple | list):
        if len(value) != 2:
            raise ValueError(f"{name} must be one number or a pair (source, target), not {len(value)} of them")
        return value[0], value[1]
    return value, value
