"""Where one surface lies on another: the rigid motion between two objects, without a first guess."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh import _check
from simplexmesh.motion.progress import Report, reporting
from simplexmesh.recognition.arena import Arena, arena_of
from simplexmesh.recognition.icp import FEWEST, about_zero, paired, refined, uncertainty
from simplexmesh.recognition.starts import begun
from simplexmesh.recognition.surfaces import Surface, comparable, surface_of
from simplexmesh.recognition.verify import Court, Verdict

Array = NDArray[np.float64]

FOLLOWED, AGAIN, TRIED = 400, 100, 24
"""So many motions are followed on the grid, so many of these more exactly, and so many on the points."""

APART, FAR = np.radians(12.0), 0.1
"""Poses nearer to each other than this, in turn and shift, are one: a valley without a clear lowest place."""

PROMISING = 0.6
"""Motions are tried on the points whose score on the grid is at least so much of the best."""

ASKED = 2000
FIRST_ROUNDS = 8

LOST = 0.6
"""The last refinement has lost its way if less than this share of the score is left; surfaces differ a little there."""

SETTLED = 0.03
"""The last refinement ends when a step is smaller than this share of the pose's own uncertainty."""


@dataclass(frozen=True, eq=False, repr=False)
class Pose:
    """One way in which a surface may lie on another.

    Attributes
    ----------
    T_target_source : (4, 4) array of float
    score : float
        At most 1, as in `Registration`.
    equivalent : bool
        Whether the data does not tell it from the best.

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
        turn = np.degrees(np.arccos(np.clip((np.trace(self.T_target_source[:3, :3]) - 1) / 2, -1.0, 1.0)))
        return f"Pose(score {self.score:.2f}, turned by {turn:.1f} degrees{', equivalent' if self.equivalent else ''})"


@dataclass(frozen=True, eq=False, repr=False)
class Registration:
    """Where the source lies on the target; made by `register`.

    Attributes
    ----------
    T_target_source : (4, 4) array of float
        Takes coordinates of the source to the target's frame.
    error : float
        Root mean square distance of the source to the target's tangent planes, where they overlap, in the data's unit.
    overlap : float
        The share of the source that lies on the target.
    score : float
        At most 1: the share of the smaller surface that agrees with the other, by distance and normals, less what
        runs near it but not on it.
    ambiguous : bool
        Whether other poses fit as well: the object is symmetric, or what both show of it is.
    poses : tuple of Pose
        Other poses, best first; of those some may be `equivalent`.
    open_motions : (k, 6) array of float
        Small motions in the target's frame, each a rotation vector and a shift, under which the surface slides along
        itself: one of a surface of revolution, two of a cylinder, three of a sphere or a plane.
    covariance : (6, 6) array of float
        Of a small motion after `T_target_source`: a rotation vector in radians about the target's zero, and a shift.
        It knows noise, not ambiguity, and of open motions only that they are very uncertain.

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
    """Find the rigid motion that brings one object to another, without a first guess and without any scale.

    Pairs of points whose distance and normals are alike vote for motions (Drost and others 2010); the principal axes
    and turns all around add theirs. The likeliest are followed to where points lie on tangent planes, judged by how
    much of both surfaces agrees, and the best is refined on all points.

    Parameters
    ----------
    source, target : SimplexMesh, TriangleMesh, PointCloud, Volume, array, pyvista or trimesh object, path, or scans
        In one unit. Either may show only a part of the object. Points without normals get some.
    level, label : number or pair of numbers, optional
        The surface meant where the data are volumes, for both or for (source, target); as in `reconstruct`.
    inside : {"above", "below"}
        Where a volume's object is, as in `reconstruct`; other data takes no notice.
    minimum_overlap : float
        The least score, as a share of the smaller surface; poses found by chance have less than 0.1.
    progress : bool or callable
        True shows a bar; a function is called with the share done and a message.

    Returns
    -------
    Registration

    Raises
    ------
    ValueError, TypeError, OSError
        Data that is not there, fewer than 50 points, two units, no pose with the overlap asked for.

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
    levels, labels = _both("level", level), _both("label", label)
    with reporting(progress) as report:
        report(0.0, "reading")
        here, there = (
            surface_of(data, name, level=levels[k], label=labels[k], inside=inside)
            for k, (name, data) in enumerate((("source", source), ("target", target)))
        )
        comparable(here, there)
        report(0.4, "voting")
        rng = np.random.default_rng(0)
        arena, middle, unit = arena_of(here, there, rng)
        report(0.6, "following")
        starts = followed(arena, begun(arena, rng))
        court = Court.of(arena.source, arena.target, arena.size, ASKED, rng)
        verdicts = tried(arena, court, starts)
        _fits(verdicts[0] if verdicts else None, minimum_overlap)
        report(0.9, "refining")
        raw = (here.placed(here.points.mean(axis=0), unit), there.placed(middle, unit))
        found = concluded(court, verdicts, *raw)
        _fits(found[0], minimum_overlap)
        report(1.0, "done")
    return _told(*found, middle, here.points.mean(axis=0), unit)


def followed(arena: Arena, motions: Array) -> Array:
    """Return the motions (h, 12), distinct and best first, that the most promising ones lead to."""
    scores = arena.scores(motions)
    for stage, count in enumerate((FOLLOWED, AGAIN)):
        order = np.argsort(-scores, kind="stable")[:FOLLOWED]
        order = order[arena.distinct(motions[order], count)] if stage else order
        motions = arena.followed(motions[order], stage=stage)
        scores = arena.scores(motions, stage=stage + 1)
    order = np.argsort(-scores, kind="stable")
    motions = motions[order[scores[order] >= PROMISING * scores[order[0]]]]
    return motions[arena.distinct(motions, TRIED)]


def tried(arena: Arena, court: Court, motions: Array) -> list[Verdict]:
    """Return verdicts on motions (h, 12) refined on some of the points, distinct and best first."""
    found = []
    for motion in motions:
        start = np.vstack([motion.reshape(3, 4), [0, 0, 0, 1]])
        T = refined(court.source, court.target, court.trees[1], start, 2 * court.reach,
                    chosen=court.samples[0], rounds=FIRST_ROUNDS)  # fmt: skip
        found.append(court.judged(T))
    found.sort(key=lambda verdict: -verdict.score)
    ends = np.array([verdict.T[:3].ravel() for verdict in found]).reshape(-1, 12)
    return [found[k] for k in arena.distinct(ends, TRIED, APART, FAR)]


def concluded(
    court: Court, verdicts: list[Verdict], source: Surface, target: Surface
) -> tuple[Verdict, list[tuple[Verdict, bool]], Array, Array]:
    """Return the best verdict, the others with whether they equal it, open motions and covariance.

    The best is refined on all points, on surfaces through their neighbors: these know more than one point does. It
    stays where it was if it loses the target there, as sparse data may have it. What it leaves uncertain is told from
    the points as they were measured.
    """
    first, here, there = verdicts[0], source.drawn(), target.drawn()
    tree = cKDTree(there.points)
    best = court.judged(refined(here, there, tree, first.T, court.reach, still=SETTLED))
    best = best if best.score > LOST * first.score else first
    T = best.T
    covariance, error = uncertainty(source, target, paired(here, there, tree, T, court.reach), T)
    others = [(each, each.equals(first)) for each in verdicts[1:]]
    return replace(best, error=error), others, court.open_motions(T), covariance


def _fits(best: Verdict | None, minimum_overlap: float) -> None:
    """Refuse what does not fit, or on so few points that it tells nothing."""
    score = max(0.0, best.score) if best else 0.0
    if best is None or best.score < minimum_overlap:
        raise ValueError(
            f"source and target must agree on at least {minimum_overlap:.0%} of the smaller; the best pose found has "
            f"{score:.1%}"
        )
    if not np.isfinite(best.error):
        raise ValueError(
            f"source and target must have at least {FEWEST} points in common; the best pose found has less"
        )


def _told(
    best: Verdict, others: list[tuple[Verdict, bool]], sliding: Array, covariance: Array, middle: Array, start: Array,
    unit: float,
) -> Registration:  # fmt: skip
    """Return the result in the data's frames and unit."""

    def back(T: Array) -> Array:
        out = np.eye(4)
        out[:3, :3] = T[:3, :3]
        out[:3, 3] = middle + unit * T[:3, 3] - T[:3, :3] @ start
        return _check.frozen(out)

    A = about_zero(middle) @ np.diag([1.0] * 3 + [unit] * 3)
    poses = tuple(Pose(back(each.T), each.score, bool(same)) for each, same in others)
    return Registration(
        T_target_source=back(best.T),
        error=best.error * unit,
        overlap=best.overlap,
        score=best.score,
        ambiguous=bool(len(sliding)) or any(pose.equivalent for pose in poses),
        poses=poses,
        open_motions=_check.frozen(sliding @ A.T),
        covariance=_check.frozen(A @ covariance @ A.T),
    )


def _both(name: str, value: Any) -> tuple[Any, Any]:
    """Return what is meant for source and target."""
    if isinstance(value, tuple | list):
        if len(value) != 2:
            raise ValueError(f"{name} must be one number or a pair (source, target), not {len(value)} of them")
        return value[0], value[1]
    return value, value
