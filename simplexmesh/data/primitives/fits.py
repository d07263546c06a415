"""How primitives fit points: deviations, covariance, extent, tests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask

if TYPE_CHECKING:
    from simplexmesh.cloud.validation.validation import Validation
    from simplexmesh.data.primitives.base import Primitive

SINGULAR = 1e-13
"""Of the largest eigenvalue of a matrix of unit diagonal: parameters below are not told by the points."""

PART = 0.1
"""Of a mode that is not told: a parameter that has less is not of it."""


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """How a primitive was fitted to points.

    Attributes
    ----------
    rms : float
        Root mean square distance of the points.
    noise : float
        Deviation of the points that the distances show: with as many points less as there are parameters.
    covariance : (p, p) array of float
        Of the parameters, in the order of the primitive's `parameter_names`.
    extent : (2, 2) array of float
        Ranges of the points' two surface coordinates; of an angle the second end is less than a turn after the first.
    count : int
        How many points were used.
    tests : callable, optional
        Returns the `validation`.
    vertices : (m,) array of int, optional
        Numbers of the points used, of a fit that leaves some out.
    covered : float, optional
        Share of the turn about the axis that has points near: half a rim has 0.5. None of planes.
    """

    rms: float
    noise: float
    covariance: Array
    extent: Array
    count: int
    tests: Callable[[], Validation] | None = None
    vertices: Indices | None = None
    covered: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", checks.frozen(self.covariance))
        object.__setattr__(self, "extent", checks.frozen(self.extent))

    @cached_property
    def validation(self) -> Validation | None:
        """Whether the distances are those of noise, tested when first asked for; None of curves and few points."""
        return self.tests() if self.tests else None

    def __repr__(self) -> str:
        return f"Fit({self.count:,} points, rms {self.rms:.3g})"


def fit_of(
    primitive: Primitive,
    points: Array,
    *,
    weights: Array | None = None,
    chart: Array | None = None,
    noise: float | None = None,
    **more: Any,
) -> Fit:
    """Return how a primitive that is at the least weighted squared distance from points (n, 3) fits them.

    `chart` (p, q) are the derivatives of its parameters by those that were free, `noise` is the deviation where that is
    known, and `more` is told as it is. The covariance is NaN where the points do not tell all parameters.
    """
    matrix, _, square = primitive.normal_equations(points, weights)
    free = np.eye(len(matrix)) if chart is None else chart
    count, spare = len(points), len(points) * primitive.per_point - free.shape[1]
    shown = float(np.sqrt(square / spare)) if spare > 0 else float("nan")
    telling = primitive._telling(points, shown)
    if not telling.all():
        matrix = primitive.normal_equations(points[telling], None if weights is None else weights[telling])[0]
    covariance = (shown if noise is None else noise) ** 2 * free @ inverse(free.T @ matrix @ free) @ free.T
    covered = primitive.coverage(points) if primitive.periods[0] else None
    rms = float(np.sqrt(square / count))
    return Fit(rms, shown, covariance, primitive.within(points), count, covered=covered, **more)


def inverse(matrix: Array) -> Array:
    """Return the inverse (p, p) of a normal matrix, whatever the units of its parameters; NaN if it is singular."""
    scale, values, vectors = _unit_modes(matrix)
    if _free(values).any():
        return np.full_like(matrix, np.nan)
    return np.asarray((vectors / values) @ vectors.T / np.outer(scale, scale))


def undetermined(primitive: Primitive, points: Array, noise: float) -> list[str]:
    """Return the names of the parameters of a primitive that points (n, 3) leave free, alone or together."""
    matrix = primitive.normal_equations(points[primitive._telling(points, noise)])[0]
    _, values, vectors = _unit_modes(matrix)
    part = np.abs(vectors[:, _free(values)]).max(axis=1, initial=0.0)
    return [name for name, moved in zip(primitive.parameter_names, part, strict=True) if moved > PART]


def _unit_modes(matrix: Array) -> tuple[Array, Array, Array]:
    """Return the scales of parameters, and eigenvalues and -vectors of the matrix in them."""
    scale = np.sqrt(np.maximum(np.diagonal(matrix), 1e-300))
    return scale, *np.linalg.eigh(matrix / np.outer(scale, scale))


def _free(values: Array) -> Mask:
    """Return which modes no point tells."""
    free: Mask = ~(values > SINGULAR * values.max(initial=0.0))
    return free
