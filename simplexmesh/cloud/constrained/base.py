"""What constrained primitives are: a free one whose chart a few parameters move in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Self

from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.cloud.fitting.solver import solve
from simplexmesh.data.primitives import Primitive, fit_of


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

    def normal_equations(
        self, points: Array, weights: Array | None = None, loss_scale: float | None = None
    ) -> tuple[Array, Array, float]:
        """Return normal matrix (q, q), downhill vector (q,) and cost of distances, as of a primitive."""
        matrix, downhill, cost = self.primitive.normal_equations(points, weights, loss_scale)
        return self.chart.T @ matrix @ self.chart, self.chart.T @ downhill, cost


def fitted(constrained: Constrained, points: ArrayLike, *, loss_scale: float | None = None) -> Primitive:
    """Return the free primitive of a bound one at the least squared distance from points (Chaperon 2002, 4.3.1, A.2).

    The covariance of its `fit` is singular along what the bond holds; points far beyond `loss_scale` count less.
    """
    at = checks.array("points", points, (None, 3))
    q = constrained.chart.shape[1]
    if len(at) < q:
        raise ValueError(f"points must be at least {q}, the number of parameters, not {len(at)}")
    found = solve(constrained, at, loss_scale=loss_scale)
    return found.primitive.with_fit(fit_of(found.primitive, at, chart=found.chart))
