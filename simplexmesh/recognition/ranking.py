"""Rank the models of a library for a scan: cheap comparisons select candidates, the data decides.

Candidates are the models with the nearest global descriptors and those with the nearest spin images; more of the latter
if none of these explains the scan, or if it is a part. Candidate motions of each model come from principal axes and
consistent correspondences. They are scored and refined on the scan's grid, and the best models are evaluated on the
points of both surfaces, as in `register`.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simplexmesh.motion.progress import Report
from simplexmesh.recognition.batch_scoring import BatchScorer
from simplexmesh.recognition.grid_scoring import GridScorer
from simplexmesh.recognition.icp import refined
from simplexmesh.recognition.model_index import ModelIndex
from simplexmesh.recognition.scene import COARSE_MOTIONS, FINE_MOTIONS, Scene, SingleThreadTree
from simplexmesh.recognition.verify import Evaluation, Verifier

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

BY_DESCRIPTOR, BY_IMAGES, MORE_BY_IMAGES = 8, 6, 40
"""Numbers of models that are tried for their global descriptor, for their images, and for their images if needed."""

SUFFICIENT_SCORE, NEAR_DESCRIPTOR = 0.5, 0.15
"""More models are tried if the best has a lower score, or a descriptor farther from the scan's, as one of a part is."""

AREA_TOLERANCE = 1.5
"""Factor by which noise may enlarge the apparent area of a scan; smaller models cannot explain all of it."""

COARSE_MODELS, FINE_MODELS = 30, 16
"""Numbers of models that are refined coarsely, then finely, on the grid."""

STRIDE, SCORED_MOTIONS = 4, 100
"""All motions are scored with one point in four, and the best 100 of each model with all points."""

MINIMUM_EVALUATED = 8
"""Least number of models that are evaluated on the points if the scan is a part."""

SAMPLES = 600
ITERATIONS = 5


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model in a scene: its row in the index, its best motions (h, 12), and the score of the first on the grid."""

    row: int
    scorer: GridScorer
    motions: Array
    score: float


def explainable_fraction(model: float, scan: float) -> float:
    """Return the largest fraction of a scan that a model can explain, from their areas.

    It lowers the scores of small models, which fit somewhere on large scans: a plate on any flat side.

    Examples
    --------
    >>> explainable_fraction(2.0, 1.0), explainable_fraction(1.0, 15.0)
    (1.0, 0.1)
    """
    return min(1.0, float(AREA_TOLERANCE * model / scan))


def _score_factor(scorer: GridScorer) -> float:
    """Return the factor from the mean score of the model's points to the score relative to the smaller surface."""
    model, scan = scorer.source.area, scorer.target.area
    return explainable_fraction(model, scan) * model / min(model, scan)


def initial_candidates(rows: list[int], scorers: list[GridScorer], motions: list[Array]) -> list[Candidate]:
    """Return models with the best of their motions, scored without refinement."""
    batch = BatchScorer(scorers)
    coarse = batch.scores(motions, every=STRIDE)
    promising = [each[_best(scores, SCORED_MOTIONS)] for each, scores in zip(motions, coarse, strict=True)]
    return _with_best(rows, scorers, promising, batch.scores(promising), 3 * COARSE_MOTIONS)


def refined_candidates(candidates: list[Candidate], stage: int) -> list[Candidate]:
    """Return models with their motions refined, coarsely (stage 0) or finely (1), the best of them kept."""
    motions = [each.motions if stage else _distinct(each) for each in candidates]
    batch = BatchScorer([each.scorer for each in candidates])
    motions = batch.refined(motions, stage=stage)
    rows, scores = [each.row for each in candidates], batch.scores(motions, stage=stage + 1)
    return _with_best(rows, batch.scorers, motions, scores, FINE_MOTIONS)


def _distinct(candidate: Candidate) -> Array:
    return candidate.motions[candidate.scorer.distinct(candidate.motions, COARSE_MOTIONS)]


def _best(scores: Array, count: int) -> Indices:
    return np.argsort(-scores, kind="stable")[:count]


def _with_best(
    rows: list[int], scorers: list[GridScorer], motions: list[Array], scores: list[Array], count: int
) -> list[Candidate]:
    """Return models with the best `count` of their motions."""
    return [
        Candidate(row, scorer, each[_best(values, count)], _score_factor(scorer) * float(values.max()))
        for row, scorer, each, values in zip(rows, scorers, motions, scores, strict=True)
    ]


def best_candidates(scene: Scene, index: ModelIndex, which: Indices, count: int) -> list[Candidate]:
    """Return at least `count` of the models `which`, if there are, with refined motions, best first."""
    models = [index.models[index.identities[k]] for k in which]
    scorers = [scene.scorer(model) for model in models]
    motions = scene.motions(models, scorers, index.image_index(scene.octave), which)
    candidates = initial_candidates(which.tolist(), scorers, motions)
    for stage, kept in enumerate((COARSE_MODELS, max(FINE_MODELS, count))):
        candidates.sort(key=lambda each: -each.score)
        candidates = refined_candidates(candidates[:kept], stage)
    return sorted(candidates, key=lambda each: -each.score)


def evaluated(scene: Scene, candidate: Candidate) -> Evaluation:
    """Return the evaluation of a model's best motion, refined on the points."""
    scorer = candidate.scorer
    trees = SingleThreadTree(scorer.source.points, balanced_tree=False, compact_nodes=False), scene.tree
    verifier = Verifier.of(scorer.source, scorer.target, scorer.size, SAMPLES, np.random.default_rng(0), trees)
    start = np.vstack([candidate.motions[0].reshape(3, 4), [0, 0, 0, 1]])
    T = refined(
        verifier.source, verifier.target, verifier.trees[1], start, 2 * verifier.reach, chosen=verifier.samples[0],
        iterations=ITERATIONS,
    )  # fmt: skip
    found = verifier.evaluated(T)
    return replace(found, score=found.score * explainable_fraction(verifier.source.area, verifier.target.area))


def ranked(
    scene: Scene, descriptor: Array, index: ModelIndex, count: int, report: Report
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
        found = _evaluated_best(scene, index, np.concatenate([first, more]), max(MINIMUM_EVALUATED, count))
    else:
        found = _evaluated_best(scene, index, first, count)
        if by_descriptor[found[0][0]] >= NEAR_DESCRIPTOR or found[0][1].score <= SUFFICIENT_SCORE:
            report(0.6, "comparing more")
            found += _evaluated_best(scene, index, more, count)
            found.sort(key=lambda each: -each[1].score)
    return [(index.identities[k], evaluation) for k, evaluation in found[:count]]


def _evaluated_best(scene: Scene, index: ModelIndex, which: Indices, count: int) -> list[tuple[int, Evaluation]]:
    """Return the rows of the best `count` of the models `which`, and their evaluations, best first."""
    best = best_candidates(scene, index, which, count)[:count] if len(which) else []
    with ThreadPoolExecutor(max(1, min(len(best), os.cpu_count() or 1))) as pool:  # trees are queried without the GIL
        evaluations = list(pool.map(lambda each: evaluated(scene, each), best))
    found = [(each.row, evaluation) for each, evaluation in zip(best, evaluations, strict=True)]
    return sorted(found, key=lambda each: -each[1].score)
