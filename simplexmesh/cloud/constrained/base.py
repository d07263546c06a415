"""What constrained primitives are: a free one whose chart a few parameters move in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Any, Self, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh.cloud.fitting.solver import solve
from simplexmesh.data.primitives import Fit, Primitive

Array = NDArray[np.float64]


class Constrained(ABC):
    """A primitive with a bond to others, told by fewer parameters than a free one.

    The derivatives of its distances are those of the free primitive's chart, times those of the chart's parameters by
    its own.
    """

    primitive: Primitive

    @property
    @abstractmethod
    def chart(self) -> Array:
        """(p, q): derivatives of the free primitive's parameters by these ones."""

    @abstractmethod
    def stepped(self, step: Array) -> Self:
        """Return it with its parameters moved by a step (q,)."""

    def with_fit(self, fit: Fit) -> Self:
        """Return it with how it was fitted."""
        changes: dict[str, Any] = {"fit": fit} if hasattr(self, "fit") else {"primitive": self.primitive.with_fit(fit)}
        out: Self = replace(cast(Any, self), **changes)
        return out

    def distance(self, points: ArrayLike) -> Array:
        """Return the signed distances (n,) of points (n, 3), positive outside."""
        return self.primitive.distance(points)

    def derivatives(self, points: ArrayLike) -> Array:
        """Return the derivatives (n, q) of the distances of points (n, 3) by the parameters, for `stepped`."""
        return self.primitive.derivatives(points) @ self.chart

    def normal_equations(
        self, points: Array, weights: Array | None = None, loss_scale: float | None = None
    ) -> tuple[Array, Array, float]:
        """Return normal matrix (q, q), downhill vector (q,) and cost of distances, as of a primitive."""
        matrix, downhill, cost = self.primitive.normal_equations(points, weights, loss_scale)
        return self.chart.T @ matrix @ self.chart, self.chart.T @ downhill, cost


Kind = TypeVar("Kind", bound=Constrained)


def fitted(constrained: Kind, points: ArrayLike, *, loss_scale: float | None = None) -> Kind:
    """Return a constrained primitive moved to the least squared distance from points.

    Parameters
    ----------
    constrained : Constrained
        The start, with what it is bound to.
    points : (n, 3) array of float
        Not fewer than it has parameters.
    loss_scale : float, optional
        Distance from which points count less, for points among others (Geman and McClure).

    Returns
    -------
    Constrained
        Whose `primitive` has a `fit`; its covariance is singular along what the bond holds.

    Raises
    ------
    ValueError
        Fewer points than parameters.

    References
    ----------
    T. Chaperon, thesis, Ecole des Mines de Paris, 2002, sections 4.3.1 and A.2.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> from simplexmesh.cloud.constrained import BallJointCylinder, fitted
    >>> turn = np.linspace(0, 40, 200)
    >>> points = np.stack([np.cos(turn), np.sin(turn), turn / 10], axis=1)
    >>> found = fitted(BallJointCylinder(sm.primitives.Cylinder([0, 0, 0], [0.1, 0, 1], 1)), points)
    >>> abs(found.primitive.axis.round(6))
    array([0., 0., 1.])
    """
    at = checks.array("points", points, (None, 3))
    q = constrained.chart.shape[1]
    if len(at) < q:
        raise ValueError(f"points must be at least {q}, the number of parameters, not {len(at)}")
    found, matrix = solve(constrained, at, loss_scale=loss_scale)
    off = found.distance(at)
    square = float(off @ off)
    noise = float(np.sqrt(square / max(len(at) - q, 1)))
    covariance = noise**2 * found.chart @ np.linalg.pinv(matrix, hermitian=True) @ found.chart.T
    fit = Fit(float(np.sqrt(square / len(at))), noise, covariance, found.primitive.within(at), len(at))
    return found.with_fit(fit)
