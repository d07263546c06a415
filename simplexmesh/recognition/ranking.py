"""From all models of a library to the few that a scan may be of: cheap comparisons first, the data decides.

Those models are tried whose profile is near the scan's, or in which the images of its points are found again; more of
the latter where none of these explains it: then it shows a part. Each model is brought to the scan by its axes and by
pairs of points that look alike. These motions are judged and followed on the scan's grid, and the best models are put
to the proof on the points, both ways, as in `register`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simplexmesh.motion.progress import Report
from simplexmesh.recognition.arena import Arena
from simplexmesh.recognition.icp import refined
from simplexmesh.recognition.scene import FIRST, LAST, Scene, Tree
from simplexmesh.recognition.shelf import Shelf
from simplexmesh.recognition.surfaces import Surface
from simplexmesh.recognition.verify import Court, Verdict

Array = NDArray[np.float64]

BY_PROFILE, BY_IMAGES, MORE = 8, 6, 40
"""So many models are tried because of their profile and of their images, and so many more because of these if ..."""

ENOUGH, NEAR = 0.5, 0.15
"""... the best has not this score, or its profile is farther than this from the scan's, as that of a part is."""

SWOLLEN = 1.5
"""Noise makes scans seem up to so much larger; models of still less area than they cannot be what they show."""

FOLLOWED, AGAIN = 16, 8
"""So many models are followed on the grid, so many of these more exactly."""

ASKED = 600
ROUNDS = 5


@dataclass(frozen=True, eq=False)
class Placed:
    """A model in a scene: with its best motions (h, 12), and the score of the best on the scan's grid."""

    number: int
    surface: Surface
    arena: Arena
    motions: Array
    score: float

    def followed(self, stage: int) -> Placed:
        """Return it with its motions followed, roughly (0) or well (1), the best of them left."""
        motions = self.arena.followed(self.motions, stage=stage)
        scores = self.arena.scores(motions, stage=stage + 1)
        order = np.argsort(-scores, kind="stable")[:LAST]
        return Placed(self.number, self.surface, self.arena, motions[order], _share(self) * float(scores[order[0]]))


def _share(one: Placed | Arena) -> float:
    """Return how much larger the model's area is than the smaller one: scores are of that, if it may explain all."""
    arena = one if isinstance(one, Arena) else one.arena
    model, scan = arena.source.area, arena.target.area
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


def placed(scene: Scene, shelf: Shelf, number: int) -> Placed:
    """Return a model with the likeliest of its motions."""
    likest = shelf.images(scene.octave).likest(scene.images, shelf.numbers.index(number))
    surface, arena, motions = scene.places(shelf.models[number], likest)
    scores = arena.scores(motions)
    order = np.argsort(-scores, kind="stable")[: 3 * FIRST]
    order = order[arena.distinct(motions[order], FIRST)]
    return Placed(number, surface, arena, motions[order], _share(arena) * float(scores[order[0]]))


def tried(scene: Scene, shelf: Shelf, numbers: list[int], most: int) -> list[Placed]:
    """Return the models that fit best on the scan's grid, best first."""
    found = [placed(scene, shelf, number) for number in numbers]
    for stage, count in enumerate((FOLLOWED, max(AGAIN, most))):
        found.sort(key=lambda one: -one.score)
        found = [one.followed(stage) for one in found[:count]]
    return sorted(found, key=lambda one: -one.score)


def proven(scene: Scene, one: Placed) -> Verdict:
    """Return the verdict on the best motion of a model, refined on the points."""
    court = Court.of(one.surface, scene.surface, one.arena.size, ASKED, np.random.default_rng(0))
    court = replace(court, trees=(Tree(one.surface.points), scene.tree))
    start = np.vstack([one.motions[0].reshape(3, 4), [0, 0, 0, 1]])
    T = refined(court.source, court.target, court.trees[1], start, 2 * court.reach, chosen=court.samples[0],
                rounds=ROUNDS)  # fmt: skip
    verdict = court.judged(T)
    return replace(verdict, score=verdict.score * explained(court.source.area, court.target.area))


def ranked(scene: Scene, profile: Array, shelf: Shelf, most: int, report: Report) -> list[tuple[int, Verdict]]:
    """Return the identities of models, and the verdicts on where they lie in the scene, best first."""
    report(0.3, "comparing")
    numbers = np.array(shelf.numbers)
    profiles, images = shelf.by_profile(profile), shelf.by_images(scene.images, scene.octave)
    order = np.argsort(images, kind="stable")
    order = order[np.isfinite(images[order])]
    first = np.union1d(np.argsort(profiles, kind="stable")[:BY_PROFILE], order[:BY_IMAGES])
    found = _proven(scene, shelf, numbers[first].tolist(), most)
    near = profiles[shelf.numbers.index(found[0][0])] < NEAR
    if not (near and found[0][1].score > ENOUGH):
        report(0.6, "comparing more")
        order = order[~np.isin(order, first)][:MORE]
        found += _proven(scene, shelf, numbers[order].tolist(), most)
        found.sort(key=lambda one: -one[1].score)
    return found[:most]


def _proven(scene: Scene, shelf: Shelf, numbers: list[int], most: int) -> list[tuple[int, Verdict]]:
    """Return verdicts on the best of some models, best first."""
    found = [(one.number, proven(scene, one)) for one in tried(scene, shelf, numbers, most)[:most]]
    return sorted(found, key=lambda one: -one[1].score)
