"""Least squares of exact distances by Levenberg-Marquardt on local charts (Chaperon 2002, 4.2)."""

from __future__ import annotations

from contextlib import suppress
from typing import Any, Protocol, Self, TypeVar, cast

import numpy as np

from simplexmesh._base.arrays import Array, Mask
from simplexmesh.cloud.fitting import _kernels_descent as kernels
from simplexmesh.cloud.fitting._kernels_descent import LEAST, MOST, START
from simplexmesh.cloud.fitting.taper import Taper
from simplexmesh.data.primitives import Cone, Primitive
from simplexmesh.data.primitives.base import NO_WEIGHTS

Equations = tuple[Array, Array, float]
"""Normal matrix (p, p), downhill vector (p,) and the cost."""

Weighed = tuple[Array, Array | None, float | None]
"""Points (n, 3), their weights (n,), and the scale of the loss."""

Stop = tuple[float, float]
"""Share of the cost, and cost, that a last step promises to take off."""

TOLERANCE = 1e-10
"""Share of the cost that a last step promises to take off."""

BEHIND_APEX = slice(2, 5)
"""The shifts of a cone's apex among its parameters."""


class Fitted(Protocol):
    """What can be fitted: normal equations of its distances in a local chart, and a step in that."""

    def normal_equations(self, points: Array, weights: Array | None, loss_scale: float | None) -> Equations: ...  # noqa: D102

    def stepped(self, step: Array) -> Self: ...  # noqa: D102


Model = TypeVar("Model", bound=Fitted)


def solve(
    primitive: Model,
    points: Array,
    *,
    weights: Array | None = None,
    fixed: Mask | None = None,
    loss_scale: float | None = None,
    iterations: int = 30,
    tolerance: float = TOLERANCE,
) -> Model:
    """Return a primitive moved to the least sum of squared distances of points (n, 3).

    Nothing is checked; what cannot be moved stays as it is. Parameters (p,) that are `fixed` keep their values. With a
    `loss_scale` s the sum is that of d^2 / (1 + (d / s)^2), of Geman and McClure. Where the point of a primitive is a
    choice, it is the one nearest to the middle of the points.
    """
    start: Any = primitive
    if fixed is None and isinstance(start, Primitive):
        start = start.centered(points)
    taper = _taper(start, points, fixed)  # its parameters are those of the cone but for the fifth, which is not held
    start = start if taper is None else taper
    rounding = len(points) * (np.finfo(float).eps * float(np.abs(points).max())) ** 2
    settings = (points, weights, loss_scale), fixed, iterations, (tolerance, rounding)
    plain = isinstance(start, Primitive) and type(start).normal_equations is Primitive.normal_equations
    found: Any = (surface_descended if plain else descended)(start, *settings)
    return cast(Model, found if taper is None else found.cone())


def _taper(primitive: Any, points: Array, fixed: Mask | None) -> Taper | None:
    """Return a cone by a place near its points, unless its apex is held."""
    if not isinstance(primitive, Cone) or (fixed is not None and fixed[BEHIND_APEX].any()):
        return None
    return Taper.of(primitive, points)


def surface_descended(start: Primitive, given: Weighed, fixed: Mask | None, iterations: int, least: Stop) -> Primitive:
    """Return where `descended` leads from a surface whose distances are a kernel's, many times as fast."""
    points, weights, loss_scale = given
    free = ~(np.zeros(start.n_parameters, bool) if fixed is None else fixed)
    at = np.ascontiguousarray(points), NO_WEIGHTS if weights is None else weights, float(loss_scale or np.inf)
    found = kernels.descend(start._surface, start._columns(), at, free, iterations, least)
    return start._with(found.origin, found.frame[2], *found.shape.tolist())


def descended(start: Any, given: Weighed, fixed: Mask | None, iterations: int, least: Stop) -> Any:
    """Return where damped Gauss-Newton steps lead; steps to what is no primitive are refused as those that go up."""
    here, (matrix, downhill, cost) = start, start.normal_equations(*given)
    free = np.ones(len(downhill), bool) if fixed is None else ~fixed
    damping, step = START, np.zeros(len(downhill))
    for _ in range(iterations):
        if damping > MOST:
            break
        if kernels.fill_step(matrix, downhill, damping, free, step):
            if step @ downhill <= least[0] * cost + least[1]:
                break
            with suppress(ValueError):
                there = here.stepped(step)
                trial = there.normal_equations(*given)
                if trial[2] < cost:
                    here, (matrix, downhill, cost) = there, trial
                    damping = max(damping / 10, LEAST)
                    continue
        damping *= 10
    return here
