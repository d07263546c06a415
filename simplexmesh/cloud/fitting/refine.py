"""From initial values to the least squares of all points, or of those that are no outliers."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice

import numpy as np

from simplexmesh._base.arrays import Array, Mask
from simplexmesh.cloud.fitting import composed_starts
from simplexmesh.cloud.fitting.candidates import FEW, STEPS, TRIED, Known, candidates, given
from simplexmesh.cloud.fitting.inputs import Given, in_unit
from simplexmesh.cloud.fitting.solver import solve
from simplexmesh.cloud.validation.validation import MOST_POINTS, NEGLIGIBLE
from simplexmesh.data.primitives import Cone, Primitive
from simplexmesh.numerics.plane_fits import planes
from simplexmesh.numerics.robust import NORMAL_MAD, robust_scale
from simplexmesh.numerics.round_fits import from_axis

MANY = 1000
"""... on which starts of composed primitives are, as few are on each side of them."""

LEAST_POINTS = 24
"""... at least, of weighted ones, if there are as many."""

SAMPLES = {5: 150, 20: 50}
"""How many random subsets of a size are started from: with 30 % of outliers 1 in 6 subsets of 5 points has none."""

ROUNDS = 20
"""At most, in which the scale of outliers is found."""

WITHIN = 3.0
"""Deviations of the noise; what is farther away is an outlier, as 3 of 1000 points are by chance."""

THIN = 4.0
"""Of the rms distance: thinner tubes and balls are inside a layer of noise, whose least squares they often are."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points about the origin and of unit size, and what is known of the primitive in that unit."""

    points: Array
    some: Array  # at most MOST_POINTS of them
    normals: Array  # of those, of either sign
    known: Known
    rng: np.random.Generator

    @property
    def seed(self) -> int:
        """A seed for the next draw."""
        return int(self.rng.integers(2**32))


def cloud_of(given: Given) -> Cloud:
    """Return the points of a fit with normals of some of them: of weighted ones as many as these are worth."""
    points, weights = given.unit, given.weights
    chosen = np.arange(len(points))
    worth = len(points) if weights is None else round(len(points) ** 2 / float(weights @ weights))
    if worth < len(points) or worth > MOST_POINTS:
        share = None if weights is None else weights / weights.sum()
        count = max(min(worth, MOST_POINTS), min(LEAST_POINTS, len(points)))
        chosen = np.sort(given.rng.choice(len(points), count, replace=False, p=share))
    some = points[chosen]
    normals = planes(some).normals if given.normals is None else given.normals[chosen]
    return Cloud(points, some, normals, in_unit(given), given.rng)


def fitted(kind: str, cloud: Cloud, mask: Mask | None, *, robust: bool, start: Primitive | None) -> Primitive | None:
    """Return the primitive of a kind that is nearest to the points that are looked at first; None without a start."""
    if start is not None:
        tried = [given(start, cloud.some, cloud.known)]
    else:
        with np.errstate(all="ignore"):
            tried = list(candidates(kind, cloud.some, cloud.normals, cloud.known, cloud.seed))
            if robust:
                tried += _of_subsets(kind, cloud)
    count = MANY if kind in composed_starts.STARTS else FEW
    few = cloud.some[:: -(-len(cloud.some) // count)]
    found = [_improved(each, few, mask, robust=robust) for each in tried]
    if not found:
        return None
    off = [spread(each, few, robust=robust) for each in found]
    best = found[min(range(len(found)), key=lambda k: (is_thin(found[k], few, off[k]), off[k]))]
    return steady(best, cloud.some, mask) if robust else solve(best, cloud.some, fixed=mask)


def is_thin(primitive: Primitive, points: Array, off: float) -> bool:
    """Return whether points that are `off` from a tube, ball or cone are a layer of noise that it is inside of."""
    if isinstance(primitive, Cone):
        return float(from_axis(points, primitive.point, primitive.axis)[0].mean()) < THIN * off
    return primitive.kind in ("sphere", "cylinder", "torus") and primitive._shape[-1] < THIN * off


def spread(primitive: Primitive, points: Array, *, robust: bool) -> float:
    """Return the root mean square distance of points, or the median of the absolute ones."""
    distance = np.abs(primitive.distance(points))
    return float(np.median(distance) if robust else np.sqrt(np.mean(distance**2)))


def steady(primitive: Primitive, points: Array, mask: Mask | None) -> Primitive:
    """Return a primitive moved to the least robust sum of distances, whose scale is that of the distances."""
    before = np.inf
    for _ in range(ROUNDS):
        scale = robust_scale(primitive.distance(points), NEGLIGIBLE)
        if scale > 0.99 * before:
            break
        before = scale
        primitive = solve(primitive, points, fixed=mask, loss_scale=scale)
    return primitive


def without_outliers(primitive: Primitive, points: Array, mask: Mask | None) -> tuple[Primitive, Mask]:
    """Return the least squares of the points that are within the noise, which is theirs, and which those are."""
    used = np.ones(len(points), bool)
    for _ in range(ROUNDS):
        distance = np.abs(primitive.distance(points))
        near = distance <= WITHIN * deviation(primitive, distance[used])
        if np.array_equal(near, used):
            break
        used = near
        primitive = solve(primitive, points[used], fixed=mask)
    return primitive, used


def deviation(primitive: Primitive, distance: Array) -> float:
    """Return the deviation of the noise from absolute distances, of which some may be of outliers."""
    chi = 1.1774 if primitive.per_point == 2 else 1 / NORMAL_MAD  # median of two deviations, and of one
    return max(float(np.median(distance)) / chi, NEGLIGIBLE)


def _improved(primitive: Primitive, points: Array, mask: Mask | None, *, robust: bool) -> Primitive:
    """Return a primitive after some steps."""
    scale = robust_scale(primitive.distance(points), NEGLIGIBLE) if robust else None
    return solve(primitive, points, fixed=mask, loss_scale=scale, iterations=STEPS)


def _of_subsets(kind: str, cloud: Cloud) -> list[Primitive]:
    """Return the best of the starts from random subsets, by the median distance."""
    few = cloud.some[:: -(-len(cloud.some) // FEW)]
    found = []
    for size, draws in SAMPLES.items():
        for _ in range(draws if len(cloud.some) > size else 0):
            chosen = cloud.rng.choice(len(cloud.some), size, replace=False)
            of_chosen = candidates(kind, cloud.some[chosen], cloud.normals[chosen], cloud.known, 0)
            found += list(islice(of_chosen, 1))  # the simplest
    return sorted(found, key=lambda each: spread(each, few, robust=True))[:TRIED]
