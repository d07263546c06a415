"""Motions put to the proof on the data: how much of both surfaces agrees, and which motions fit equally well."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import cross, norm
from simplexmesh.recognition.icp import Pairing, information, paired
from simplexmesh.recognition.rotation_vectors import rotation_matrices
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

SURE = 3.0
"""A motion is worse than another when the difference is so many times its standard error, ..."""

SLIGHT = 0.03
"""... and more than this share of what agrees."""

TRIFLE = 0.004
"""Differences of this share of the size of the smaller surface never count much: facets, tolerances."""

OPEN = 0.15
"""Small motions that the normals hold less than this, over what they hold most, may be open."""

SLIDE = 0.1
"""Whether they are is tried by moving so far, in sizes of the smaller surface."""


@dataclass(frozen=True, eq=False)
class Court:
    """Two surfaces and their trees, before which motions are judged.

    Attributes
    ----------
    source, target : Surface
    trees : (cKDTree, cKDTree)
        Of the source's and the target's points.
    samples : tuple of arrays of int
        Points of each surface that are asked.
    width, reach : float
        How far from a plane, and from the nearest point, surfaces that agree may be.
    size : float
    """

    source: Surface
    target: Surface
    trees: tuple[cKDTree, cKDTree]
    samples: tuple[NDArray[np.int64], NDArray[np.int64]]
    width: float
    reach: float
    size: float

    @staticmethod
    def of(source: Surface, target: Surface, size: float, most: int, rng: np.random.Generator,
           trees: tuple[cKDTree, cKDTree] | None = None) -> Court:  # fmt: skip
        """Return the court of two surfaces, asking at most so many points of each."""
        spacing = max(source.spacing, target.spacing)
        width = float(np.hypot(3 * np.hypot(source.noise, target.noise) + 0.1 * spacing, TRIFLE * size))
        trees = trees or (cKDTree(source.points), cKDTree(target.points))
        samples = (source.some(most, rng), target.some(most, rng))
        return Court(source, target, trees, samples, width, max(2.5 * spacing, 2.0 * width), size)

    def pairings(self, T: Array) -> tuple[Pairing, Pairing]:
        """Return what the source's sample lies on in the target, and the target's in the source."""
        back = np.asarray(np.linalg.inv(T), np.float64)
        return (
            paired(self.source, self.target, self.trees[1], T, self.reach, self.samples[0]),
            paired(self.target, self.source, self.trees[0], back, self.reach, self.samples[1]),
        )

    def marks(self, found: Pairing) -> Array:
        """Return how much each point speaks for the motion, or against it: -1 to 1.

        Where one surface runs near the other but not on it, they are not the same surface.
        """
        near = np.clip(1 - (found.lack / self.width) ** 2, -1, None)
        return np.asarray(np.where(found.common, near * found.alike, 0.0))

    def judged(self, T: Array) -> Verdict:
        """Return how well a motion fits."""
        there, back = self.pairings(T)
        areas = np.array([self.source.area, self.target.area])
        weights = areas / areas.min() / 2
        marks = (self.marks(there), self.marks(back))
        score = float(min(1.0, sum(w * m.mean() for w, m in zip(weights, marks, strict=True))))
        on = there.common & (np.abs(there.lack) < self.width)
        error = float(np.sqrt((there.lack[on] ** 2).mean())) if on.any() else float("inf")
        return Verdict(T, score, float(on.mean()), error, marks, weights)

    def open_motions(self, T: Array) -> Array:
        """Return (k, 6) the small motions after T under which the surface slides along itself, if there are any.

        Each is a rotation vector and a shift about the target's zero, of any length. The normals tell which may be:
        those that hardly change any distance to a plane. Then they are tried.
        """
        found = self.pairings(T)[0]
        on = found.common & (np.abs(found.lack) < self.width)
        if np.count_nonzero(on) < 12:
            return np.zeros((0, 6))
        at = found.at[on]
        middle = at.mean(axis=0)
        arm = float(norm(at - middle).mean())
        _, matrix = information((at - middle) / arm, self.target.normals[found.near[on]], np.ones(len(at)))
        values, vectors = np.linalg.eigh(matrix)
        kept = []
        for k in np.flatnonzero(values < OPEN * values[-1]):
            turn, shift = vectors[:3, k] / arm, vectors[3:, k]
            length = SLIDE * self.size / float(np.sqrt((norm(cross(turn[None], at - middle) + shift) ** 2).mean()))
            if all(self._slides(T, turn * sign, shift * sign, middle, found) for sign in (length, -length)):
                kept.append(np.concatenate([turn, shift - np.cross(turn, middle)]))
        return np.array(kept).reshape(-1, 6)

    def _slides(self, T: Array, turn: Array, shift: Array, middle: Array, before: Pairing) -> bool:
        """Whether points that still meet the target after a motion fit it as well as before."""
        step = np.eye(4)
        step[:3, :3] = rotation_matrices(turn[None])[0]
        step[:3, 3] = middle + shift - step[:3, :3] @ middle
        after = paired(self.source, self.target, self.trees[1], step @ T, 2 * self.reach, self.samples[0])
        both = before.common & np.isfinite(after.lack) & (after.near >= 0)
        inside = both & (norm(after.at - self.target.points[after.near]) < 2 * self.reach)
        if np.count_nonzero(inside) < 0.5 * np.count_nonzero(before.common):
            return False
        worse = self.marks(before)[inside] - self.marks(after)[inside]
        return bool(worse.mean() < 0.1 * self.marks(before)[inside].mean())


@dataclass(frozen=True, eq=False)
class Verdict:
    """How well a motion fits.

    Attributes
    ----------
    T : (4, 4) array of float
    score : float
        At most 1: the share of the smaller surface that agrees with the other, less what runs near it but not on it.
    overlap : float
        The share of the source that lies on the target.
    error : float
        Root mean square distance to the target's planes, there.
    marks : tuple of arrays of float
    weights : (2,) array of float
    """

    T: Array
    score: float
    overlap: float
    error: float
    marks: tuple[Array, Array]
    weights: Array

    def equals(self, best: Verdict) -> bool:
        """Whether it fits about as well as the best: worse by no more than chance would have it, or by a trifle."""
        lack = variance = whole = 0.0
        for weight, mine, others in zip(self.weights, self.marks, best.marks, strict=True):
            difference = others - mine
            lack += weight * float(difference.mean())
            variance += weight**2 * float(difference.var()) / len(difference)
            whole += weight * float(others.mean())
        return lack < max(SURE * variance**0.5, SLIGHT * whole)
