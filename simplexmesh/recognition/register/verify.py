"""Refine and evaluate motions on the data: how much of both surfaces agrees, and which motions are equivalent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import cross, norm
from simplexmesh.numerics.rigid import plane_jacobian, small_motion
from simplexmesh.recognition.register.icp import Correspondences, find_correspondences, refined
from simplexmesh.recognition.register.oriented_points import OrientedPoints

SAME_SCORE = 0.03
"""A motion is worse if its score is lower by three standard errors and by more than this fraction of the score: more
of a surface than that is off where a coupling is turned by its most symmetric half turn."""

TOLERANCE = 0.004
"""Distance, relative to the size of the smaller surface, that facets and manufacturing tolerances account for."""

TEST_MOTION = 0.1
"""Length of the motion that tests whether a surface slides, relative to the size of the smaller surface."""


@dataclass(frozen=True, eq=False)
class Verifier:
    """Two surfaces, the trees of their points and samples of their rows, for the evaluation of motions (4, 4)."""

    source: OrientedPoints
    target: OrientedPoints
    trees: tuple[cKDTree, cKDTree]
    samples: tuple[Indices, Indices]
    width: float  # largest distance of agreeing points from the plane
    reach: float  # and from the nearest point
    size: float  # extent of the smaller surface

    @staticmethod
    def of(
        source: OrientedPoints, target: OrientedPoints, size: float, count: int, rng: np.random.Generator,
        target_tree: cKDTree | None = None,
    ) -> Verifier:  # fmt: skip
        """Return the verifier of two surfaces, with at most `count` sample points of each."""
        trees = cKDTree(source.points), target_tree or cKDTree(target.points)
        samples = source.sample(count, rng), target.sample(count, rng)
        return Verifier(source, target, trees, samples, *Verifier.tolerances(source, target, size), size)

    @staticmethod
    def tolerances(source: OrientedPoints, target: OrientedPoints, size: float) -> tuple[float, float]:
        """Return the width and the reach between two surfaces; `size` is the extent of the smaller."""
        spacing = max(source.spacing, target.spacing)
        width = float(np.hypot(3 * np.hypot(source.noise, target.noise) + 0.1 * spacing, TOLERANCE * size))
        return width, max(2.5 * spacing, 2.0 * width)

    def settled(self, motion: Array, iterations: int) -> Evaluation:
        """Return the evaluation of a motion (12,) after so many steps of refinement on the source's sample."""
        start = np.vstack([motion.reshape(3, 4), [0, 0, 0, 1]])
        T = refined(
            self.source, self.target, self.trees[1], start, 2 * self.reach,
            chosen=self.samples[0], iterations=iterations,
        )  # fmt: skip
        return self.evaluated(T)

    def correspondences(self, T: Array, reach: float) -> Correspondences:
        """Return the correspondences of the source's sample in the target."""
        return find_correspondences(self.source, self.target, self.trees[1], T, reach, self.samples[0])

    def point_scores(self, found: Correspondences) -> Array:
        """Return a score for each point, negative where the surfaces are near but do not coincide: at least -1."""
        distance_score = np.clip(1 - (found.residual / self.width) ** 2, -1, None)
        return np.asarray(np.where(found.inlier, distance_score * found.cosine, 0.0))

    def evaluated(self, T: Array) -> Evaluation:
        """Return the evaluation of a motion."""
        forward, T_source_target = self.correspondences(T, self.reach), np.asarray(np.linalg.inv(T), np.float64)
        backward = find_correspondences(
            self.target, self.source, self.trees[0], T_source_target, self.reach, self.samples[1]
        )
        areas = np.array([self.source.area, self.target.area])
        weights = areas / areas.min() / 2
        point_scores = (self.point_scores(forward), self.point_scores(backward))
        score = float(min(1.0, sum(w * m.mean() for w, m in zip(weights, point_scores, strict=True))))
        agreeing = forward.inlier & (np.abs(forward.residual) < self.width)
        error = float(np.sqrt((forward.residual[agreeing] ** 2).mean())) if agreeing.any() else float("inf")
        return Evaluation(T, score, float(agreeing.mean()), error, point_scores, weights)

    def open_motions(self, T: Array) -> Array:
        """Return (k, 6) small motions after T, of any length, under which the surface slides along itself, if any."""
        found = self.correspondences(T, self.reach)
        agreeing = found.inlier & (np.abs(found.residual) < self.width)
        if np.count_nonzero(agreeing) < 12:
            return np.zeros((0, 6))
        points = found.points[agreeing]
        center = points.mean(axis=0)
        radius = float(norm(points - center).mean())
        rows = plane_jacobian((points - center) / radius, self.target.normals[found.nearest[agreeing]])
        kept = []
        for vector in np.linalg.eigh(rows.T @ rows)[1].T:
            turn, shift = vector[:3] / radius, vector[3:]
            moved = float(np.sqrt((norm(cross(turn[None], points - center) + shift) ** 2).mean()))
            length = TEST_MOTION * self.size / moved
            if all(self._slides(T, turn * sign, shift * sign, center, found) for sign in (length, -length)):
                kept.append(np.concatenate([turn, shift - np.cross(turn, center)]))
        return np.array(kept).reshape(-1, 6)

    def _slides(self, T: Array, turn: Array, shift: Array, center: Array, before: Correspondences) -> bool:
        """Whether points that still meet the target after a small motion fit it as well as before."""
        step = small_motion(turn, shift, center)
        after = self.correspondences(step @ T, 2 * self.reach)
        inside = before.inlier & (norm(after.points - self.target.points[after.nearest]) < 2 * self.reach)
        if np.count_nonzero(inside) < 0.5 * np.count_nonzero(before.inlier):
            return False
        loss = self.point_scores(before)[inside] - self.point_scores(after)[inside]
        return bool(loss.mean() < 0.1 * self.point_scores(before)[inside].mean())


@dataclass(frozen=True, eq=False)
class Evaluation:
    """How well a motion T (4, 4) fits."""

    T: Array
    score: float  # at most 1: the fraction of the smaller surface that agrees, less what is near but off the other
    overlap: float  # the fraction of the source that lies on the target
    error: float  # root mean square distance to the target's planes there
    point_scores: tuple[Array, Array]  # of the samples of source and target
    weights: Array  # (2,) of source and target in the score

    def is_equivalent(self, best: Evaluation) -> bool:
        """Whether the score is within the statistical or the practical tolerance of the best one's."""
        loss = variance = score = 0.0
        for weight, mine, theirs in zip(self.weights, self.point_scores, best.point_scores, strict=True):
            difference = theirs - mine
            loss += weight * float(difference.mean())
            variance += weight**2 * float(difference.var()) / len(difference)
            score += weight * float(theirs.mean())
        return loss < max(3 * variance**0.5, SAME_SCORE * score)
