"""Least squares of exact distances by Levenberg-Marquardt on local charts (Chaperon 2002, 4.2)."""

from __future__ import annotations

from typing import Any, Protocol, Self, TypeVar

import numpy as np

from simplexmesh._base.arrays import Array, Mask
from simplexmesh.cloud.fitting.taper import Taper
from simplexmesh.data.primitives import Cone, Primitive

Equations = tuple[Array, Array, float]
"""Normal matrix (p, p), downhill vector (p,) and the cost."""

START, LEAST, MOST = 1e-3, 1e-9, 1e10
"""Damping of the first step, and its limits: above the last one no step goes down (4.2.1)."""

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
    given = (points, weights, loss_scale)
    found: Model = _descended(taper or start, given, fixed, iterations, tolerance)
    return found if taper is None else found.cone()  # type: ignore[attr-defined]


def _taper(primitive: Any, points: Array, fixed: Mask | None) -> Taper | None:
    """Return a cone by a place near its points, unless its apex is held."""
    if not isinstance(primitive, Cone) or (fixed is not None and fixed[BEHIND_APEX].any()):
        return None
    return Taper.of(primitive, points)


def _descended(
    start: Any, given: tuple[Array, Array | None, float | None], fixed: Mask | None, iterations: int, tolerance: float
) -> Any:
    """Return where damped Gauss-Newton steps lead; steps to what is no primitive are refused as those that go up."""
    points = given[0]
    rounding = len(points) * (np.finfo(float).eps * float(np.abs(points).max())) ** 2
    here, (matrix, downhill, cost) = start, start.normal_equations(*given)
    damping = START
    for _ in range(iterations):
        if damping > MOST:
            break
        try:
            step = _step(matrix, downhill, damping, fixed)
            if step @ downhill <= tolerance * cost + rounding:
                break
            there = here.stepped(step)
        except (ValueError, np.linalg.LinAlgError):
            damping *= 10
            continue
        trial = there.normal_equations(*given)
        if trial[2] < cost:
            here, (matrix, downhill, cost) = there, trial
            damping = max(damping / 10, LEAST)
        else:
            damping *= 10
    return here


def _step(matrix: Array, downhill: Array, damping: float, fixed: Mask | None) -> Array:
    """Return the solution of the normal equations with a diagonal that is larger by the damping (Marquardt 1963)."""
    scale = np.sqrt(np.diagonal(matrix))
    free = scale > 0 if fixed is None else (scale > 0) & ~fixed
    step = np.zeros(len(downhill))
    scale = scale[free]
    unit = matrix[free][:, free] / (scale[:, None] * scale)
    unit.flat[:: len(scale) + 1] += damping
    step[free] = np.linalg.solve(unit, downhill[free] / scale) / scale
    return step
