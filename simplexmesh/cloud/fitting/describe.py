"""How a primitive was fitted: distances, covariance, extent and validation."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh.cloud.fitting.inputs import Given, per_point
from simplexmesh.cloud.fitting.solver import Mask
from simplexmesh.cloud.validation.validation import Validation, validated
from simplexmesh.data.primitives import Circle, Fit, Primitive
from simplexmesh.data.primitives.normal_matrices import inverse

Array = NDArray[np.float64]

TESTED = 2000
"""Points whose distances are validated."""

SPARE = 16
"""Points more than parameters that a validation needs."""


def described(primitive: Primitive, given: Given, used: NDArray[np.bool_], mask: Mask | None) -> Primitive:
    """Return a primitive with how it was fitted to points."""
    points = given.points[used]
    count, each = len(points), per_point(primitive.kind)
    free = np.ones(primitive.n_parameters, bool) if mask is None else ~mask
    distance = primitive.distance(points)
    square = distance @ distance if given.weights is None else distance**2 @ given.weights
    spare = count * each - int(free.sum())
    noise = float(np.sqrt(square / spare)) if spare else float("nan")
    deviation = noise if given.noise is None else given.noise
    covariance = np.zeros((len(free), len(free)))
    told = inverse(primitive.normal_equations(points, given.weights)[0][np.ix_(free, free)])
    if np.isnan(told).any():
        raise ValueError(f"points must determine a {primitive.kind}, but these leave some of its parameters free")
    covariance[np.ix_(free, free)] = deviation**2 * told
    tests = deferred_tests(primitive, points, free, given.rng, given.noise, given.weights) if each == 1 else None
    vertices = checks.frozen(np.flatnonzero(used)) if given.robust else None
    rms = float(np.sqrt(square / count))
    covered = primitive.coverage(points) if isinstance(primitive, Circle) else None
    return primitive.with_fit(Fit(rms, noise, covariance, primitive.within(points), count, tests, vertices, covered))


def deferred_tests(
    primitive: Primitive,
    points: Array,
    free: NDArray[np.bool_],
    rng: np.random.Generator,
    noise: float | None = None,
    weights: Array | None = None,
) -> Callable[[], Validation] | None:
    """Return what tests whether the distances of some of the points are noise; None of too few points."""
    if len(points) < primitive.n_parameters + SPARE:
        return None
    scale = np.ones(len(points)) if weights is None else np.sqrt(weights)
    if len(points) > TESTED:
        some = np.sort(rng.choice(len(points), TESTED, replace=False))
        points, scale = points[some], scale[some]
    return partial(_tested, primitive, points, scale, free, noise, int(rng.integers(2**32)))


def _tested(
    primitive: Primitive, points: Array, scale: Array, free: NDArray[np.bool_], noise: float | None, seed: int
) -> Validation:
    """Return whether distances are noise, those of weighted points at the scale of this."""
    return validated(
        primitive.projected(points),
        scale * primitive.distance(points),
        primitive.coordinates(points),
        int(free.sum()),
        noise=noise,
        periods=primitive.periods,
        derivatives=scale[:, None] * primitive.derivatives(points)[:, free],
        rng=seed,
    )
