"""Rank the models of a library for a scan: cheap comparisons select candidates, the data decides.

Motions of each model are scored and refined on the scan's grid, the best on the points of both, as in `register`.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.progress import Progress
from simplexmesh.recognition.library.model_index import ModelIndex
from simplexmesh.recognition.library.scene import Scene
from simplexmesh.recognition.register import pose_scoring
from simplexmesh.recognition.register.pose_scoring import Source, distinct
from simplexmesh.recognition.register.verify import Evaluation, Verifier

BY_DESCRIPTOR, BY_IMAGES, MORE_BY_IMAGES = 8, 6, 40
"""Numbers of models that are tried for their global descriptor, for their images, and for their images if needed."""

SUFFICIENT_SCORE, NEAR_DESCRIPTOR = 0.5, 0.15
"""More models are tried if the best has a lower score, or a descriptor farther from the scan's, as one of a part is."""

AREA_TOLERANCE = 1.5
"""Factor by which noise may enlarge the apparent area of a scan; smaller models cannot explain all of it."""

COARSE_MODELS, FINE_MODELS, EVALUATED_MODELS = 30, 16, 8
"""Numbers of models that are refined coarsely and finely on the grid, and, if the scan is a part, on the points."""

SCORED_MOTIONS, COARSE_MOTIONS, FINE_MOTIONS = 100, 8, 3
"""Numbers of a model's motions that are scored with all points, refined coarsely, and finely."""

VERIFIED, STEPS = 600, 5
"""Number of points of model and scan that a motion is verified with, and of the last steps of refinement: with eight
the pose follows the noise of so few points, and errs 3 % more."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model in a scene: its row in the index, its best motions (h, 12), and the score of the first on the grid."""

    row: int
    source: Source
    motions: Array
    score: float


def explainable_fraction(model_area: float, scan_area: float) -> float:
    """Return the largest fraction of a scan that a model can explain; a small one fits somewhere on any large scan."""
    return min(1.0, float(AREA_TOLERANCE * model_area / scan_area))


def best_candidates(scene: Scene, index: ModelIndex, which: Indices, count: int) -> list[Candidate]:
    """Return at least `count` of the models `which`, if there are, with refined motions, best first."""
    every = list(index.models.values())
    models = [every[k] for k in which]
    sources = [scene.source(model) for model in models]
    motions = scene.motions(models, sources, index.image_index(scene.octave), which)
    scores = pose_scoring.scores(sources, scene.grid, motions, every=4)
    motions = [each[_best(values, SCORED_MOTIONS)] for each, values in zip(motions, scores, strict=True)]
    scores = pose_scoring.scores(sources, scene.grid, motions)
    candidates = _with_best(scene, which.tolist(), sources, motions, scores, 3 * COARSE_MOTIONS)
    for stage, kept in enumerate((COARSE_MODELS, max(FINE_MODELS, count))):
        candidates = _refined(scene, candidates[:kept], stage)
    return candidates


def _refined(scene: Scene, candidates: list[Candidate], stage: int) -> list[Candidate]:
    """Return models with their motions refined, coarsely (stage 0) or finely (1), the best of them kept."""
    rows, sources = [each.row for each in candidates], [each.source for each in candidates]
    motions = [each.motions for each in candidates]
    if stage == 0:
        motions = [each.motions[distinct(each.motions, COARSE_MOTIONS, each.source.size)] for each in candidates]
    motions = pose_scoring.refined(sources, scene.grid, motions, stage=stage)
    scores = pose_scoring.scores(sources, scene.grid, motions, stage=stage + 1)
    return _with_best(scene, rows, sources, motions, scores, FINE_MOTIONS)


def _best(scores: Array, count: int) -> Indices:
    return np.argsort(-scores, kind="stable")[:count]


def _with_best(
    scene: Scene, rows: list[int], sources: list[Source], motions: list[Array], scores: list[Array], count: int
) -> list[Candidate]:
    """Return models with the best `count` of their motions, best first by scores relative to the smaller surface."""
    candidates = []
    for row, source, each, values in zip(rows, sources, motions, scores, strict=True):
        model, scan = source.surface.area, scene.surface.area
        factor = explainable_fraction(model, scan) * model / min(model, scan)
        candidates.append(Candidate(row, source, each[_best(values, count)], factor * float(values.max())))
    return sorted(candidates, key=lambda each: -each.score)


def evaluated(scene: Scene, candidate: Candidate) -> Evaluation:
    """Return the evaluation of a model's best motion, refined on the points."""
    model, rng = candidate.source.surface, np.random.default_rng(0)
    verifier = Verifier.of(model, scene.surface, candidate.source.size, VERIFIED, rng, scene.tree)
    found = verifier.settled(candidate.motions[0], STEPS)
    return replace(found, score=found.score * explainable_fraction(model.area, scene.surface.area))


def ranked(
    scene: Scene, descriptor: Array, index: ModelIndex, count: int, report: Progress
) -> list[tuple[int, Evaluation]]:
    """Return the identities of up to `count` models, and the evaluations of their motions in the scene, best first."""
    report(0.3, "comparing")
    by_descriptor = index.descriptor_distances(descriptor)
    by_images = index.image_distances(scene.images, scene.octave)
    order = np.argsort(by_images, kind="stable")
    order = order[np.isfinite(by_images[order])]
    first = np.union1d(np.argsort(by_descriptor, kind="stable")[:BY_DESCRIPTOR], order[:BY_IMAGES])
    more = order[~np.isin(order, first)][:MORE_BY_IMAGES]
    if by_descriptor.min() >= NEAR_DESCRIPTOR:
        found = _evaluated_best(scene, index, np.concatenate([first, more]), max(EVALUATED_MODELS, count))
    else:
        found = _evaluated_best(scene, index, first, count)
        if by_descriptor[found[0][0]] >= NEAR_DESCRIPTOR or found[0][1].score <= SUFFICIENT_SCORE:
            report(0.6, "comparing more")
            found += _evaluated_best(scene, index, more, count)
            found.sort(key=lambda each: -each[1].score)
    identities = list(index.names)
    return [(identities[k], evaluation) for k, evaluation in found[:count]]


def _evaluated_best(scene: Scene, index: ModelIndex, which: Indices, count: int) -> list[tuple[int, Evaluation]]:
    """Return the rows of the best `count` of the models `which`, and their evaluations, best first."""
    best = best_candidates(scene, index, which, count)[:count] if len(which) else []
    with ThreadPoolExecutor(max(1, min(len(best), os.cpu_count() or 1))) as pool:  # trees are queried without the GIL
        evaluations = list(pool.map(lambda each: evaluated(scene, each), best))
    found = [(each.row, evaluation) for each, evaluation in zip(best, evaluations, strict=True)]
    return sorted(found, key=lambda each: -each[1].score)
