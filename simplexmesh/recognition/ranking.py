"""From all models of a library to the few that a scan may be of: cheap comparisons first, the data decides.

Those models are tried whose profile is near the scan's, or in which the images of its points are found again; more of
the latter where none of these explains it: then it shows a part. Each model is brought to the scan by its axes and by
pairs of points that look alike. These motions are judged and followed on the scan's grid, and the best models are put
to the proof on the points, both ways, as in `register`.
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
from simplexmesh.recognition.scene import FIRST, LAST, Scene, Tree
from simplexmesh.recognition.shelf import Shelf
from simplexmesh.recognition.verify import Evaluation, Verifier

Array = NDArray[np.float64]

BY_PROFILE, BY_IMAGES, MORE = 8, 6, 40
"""So many models are tried because of their profile and of their images, and so many more because of these if ..."""

ENOUGH, NEAR = 0.5, 0.15
"""... the best has not this score, or its profile is farther than this from the scan's, as that of a part is."""

SWOLLEN = 1.5
"""Noise makes scans seem up to so much larger; models of still less area than they cannot be what they show."""

FOLLOWED, AGAIN = 30, 16
"""So many models are followed on the grid, so many of these more exactly."""

EVERY, LIKELY = 4, 100
"""So many-th points judge all motions, all of them the likeliest."""

PROVEN = 8
"""So many of a part's models are put to the proof at least, even if fewer are asked for."""

ASKED = 600
ROUNDS = 5


@dataclass(frozen=True, eq=False)
class Placed:
    """A model in a scene: its place on the shelf, its best motions (h, 12), the best one's score on the scan's grid."""

    number: int
    scorer: GridScorer
    motions: Array
    score: float


def _share(scorer: GridScorer) -> float:
    """Return how much larger the model's area is than the smaller one: scores are of that, if it may explain all."""
    model, scan = scorer.source.area, scorer.target.area
    return explained(model, scan) * model / min(model, scan)


def explained(model: float, scan: float) -> float:
    """Return the most a model of some area can explain of a scan, which shows nothing else.

    Small models fit somewhere on large scans: a plate on any flat side.

    Examples
    --------
    >>> explained(2.0, 1.0), explained(1.0, 15.0)
    (1.0, 0.1)
    """
    return min(1.0, float(SWOLLEN * model / scan))


def placed(numbers: list[int], scorers: list[GridScorer], motions: list[Array]) -> list[Placed]:
    """Return models with the likeliest of their motions; a few points say which of them to judge."""
    many = BatchScorer(scorers)
    rough = many.scores(motions, every=EVERY)
    likely = [each[_best(scores, LIKELY)] for each, scores in zip(motions, rough, strict=True)]
    return _with_best(numbers, scorers, likely, many.scores(likely), 3 * FIRST)


def followed(found: list[Placed], stage: int) -> list[Placed]:
    """Return models with their motions followed, roughly (0) or well (1), the best of them left."""
    motions = [one.motions if stage else one.motions[one.scorer.distinct(one.motions, FIRST)] for one in found]
    many = BatchScorer([one.scorer for one in found])
    motions = many.refined(motions, stage=stage)
    return _with_best([one.number for one in found], many.scorers, motions, many.scores(motions, stage=stage + 1), LAST)


def _best(scores: Array, most: int) -> NDArray[np.int64]:
    return np.argsort(-scores, kind="stable")[:most]


def _with_best(
    numbers: list[int], scorers: list[GridScorer], motions: list[Array], scores: list[Array], most: int
) -> list[Placed]:
    """Return models with the best of their motions."""
    return [
        Placed(number, scorer, each[_best(point_scores, most)], _share(scorer) * float(point_scores.max()))
        for number, scorer, each, point_scores in zip(numbers, scorers, motions, scores, strict=True)
    ]


def tried(scene: Scene, shelf: Shelf, which: NDArray[np.int64], most: int) -> list[Placed]:
    """Return which models of a shelf fit best on the scene's grid, best first."""
    models = [shelf.models[shelf.numbers[k]] for k in which]
    scorers = [scene.scorer(model) for model in models]
    found = placed(which.tolist(), scorers, scene.motions(models, scorers, shelf.images(scene.octave), which))
    for stage, count in enumerate((FOLLOWED, max(AGAIN, most))):
        found.sort(key=lambda one: -one.score)
        found = followed(found[:count], stage)
    return sorted(found, key=lambda one: -one.score)


def proven(scene: Scene, one: Placed) -> Evaluation:
    """Return the verdict on the best motion of a model, refined on the points."""
    scorer = one.scorer
    trees = Tree(scorer.source.points, balanced_tree=False, compact_nodes=False), scene.tree
    verifier = Verifier.of(scorer.source, scorer.target, scorer.size, ASKED, np.random.default_rng(0), trees)
    start = np.vstack([one.motions[0].reshape(3, 4), [0, 0, 0, 1]])
    T = refined(verifier.source, verifier.target, verifier.trees[1], start, 2 * verifier.reach, chosen=verifier.samples[0],
                iterations=ROUNDS)  # fmt: skip
    evaluation = verifier.evaluated(T)
    return replace(evaluation, score=evaluation.score * explained(verifier.source.area, verifier.target.area))


def ranked(scene: Scene, profile: Array, shelf: Shelf, most: int, report: Report) -> list[tuple[int, Evaluation]]:
    """Return the identities of models, and the verdicts on where they lie in the scene, best first."""
    report(0.3, "comparing")
    profiles, images = shelf.by_profile(profile), shelf.by_images(scene.images, scene.octave)
    order = np.argsort(images, kind="stable")
    order = order[np.isfinite(images[order])]
    first = np.union1d(np.argsort(profiles, kind="stable")[:BY_PROFILE], order[:BY_IMAGES])
    more = order[~np.isin(order, first)][:MORE]
    part = profiles.min() >= NEAR
    found = (
        _proven(scene, shelf, np.concatenate([first, more]), max(PROVEN, most))
        if part
        else (_proven(scene, shelf, first, most))
    )
    if not part and not (profiles[found[0][0]] < NEAR and found[0][1].score > ENOUGH):
        report(0.6, "comparing more")
        found += _proven(scene, shelf, more, most)
        found.sort(key=lambda one: -one[1].score)
    return [(shelf.numbers[k], evaluation) for k, evaluation in found[:most]]


def _proven(scene: Scene, shelf: Shelf, which: NDArray[np.int64], most: int) -> list[tuple[int, Evaluation]]:
    """Return which of some models of a shelf fit best, and the verdicts on these, best first."""
    best = tried(scene, shelf, which, most)[:most] if len(which) else []
    with ThreadPoolExecutor(max(1, min(len(best), os.cpu_count() or 1))) as pool:  # trees are asked without the lock
        evaluations = list(pool.map(lambda one: proven(scene, one), best))
    found = [(one.number, evaluation) for one, evaluation in zip(best, evaluations, strict=True)]
    return sorted(found, key=lambda one: -one[1].score)
