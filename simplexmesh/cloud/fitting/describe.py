"""How a primitive was fitted: distances, covariance, extent and validation."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Mask
from simplexmesh.cloud.fitting.inputs import Given
from simplexmesh.cloud.validation.validation import MOST_POINTS, TERMS, Validation, validated
from simplexmesh.data.primitives import Primitive, fit_of
from simplexmesh.data.primitives.fits import undetermined


def described(primitive: Primitive, given: Given, used: Mask, mask: Mask | None) -> Primitive:
    """Return a primitive with how it was fitted to points."""
    points = given.points[used]
    primitive = primitive.aligned(points)
    free = np.ones(primitive.n_parameters, bool) if mask is None else ~mask
    tests, wanted = None, f"points must determine a {primitive.kind}"
    if primitive.per_point * len(points) < free.sum():
        kept = f"only {len(points):,} of {len(used):,} are near the one found"
        raise ValueError(f"{wanted}, but {kept}: give more points, or leave out robust")
    if primitive.per_point == 1:
        tests = deferred_tests(primitive, points, free, given.rng, given.noise, given.weights)
    vertices = checks.frozen(np.flatnonzero(used)) if given.robust else None
    chart = np.eye(len(free))[:, free]
    told: dict[str, Any] = {"weights": given.weights, "noise": given.noise, "tests": tests, "vertices": vertices}
    fit = fit_of(primitive, points, chart=chart, **told)
    if np.isnan(fit.covariance).any() and not np.isnan(fit.noise):
        free_names = ", ".join(undetermined(primitive, points, fit.noise))
        raise ValueError(f"{wanted}, but these leave some of its parameters free: {free_names}")
    return primitive.with_fit(fit)


def deferred_tests(
    primitive: Primitive,
    points: Array,
    free: Mask,
    rng: np.random.Generator,
    noise: float | None = None,
    weights: Array | None = None,
) -> Callable[[], Validation] | None:
    """Return what tests whether the distances of some of the points are noise; None of too few points."""
    if len(points) <= primitive.n_parameters + TERMS:
        return None
    scale = np.ones(len(points)) if weights is None else np.sqrt(weights)
    if len(points) > MOST_POINTS:
        some = np.sort(rng.choice(len(points), MOST_POINTS, replace=False))
        points, scale = points[some], scale[some]
    return partial(_tested, primitive, points, scale, free, noise, int(rng.integers(2**32)))


def _tested(
    primitive: Primitive, points: Array, scale: Array, free: Mask, noise: float | None, seed: int
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
