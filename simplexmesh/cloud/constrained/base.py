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
    """Return the primitive under a constraint that is at the least squared distance from points.

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
    Primitive
        The free one that it is, with its `fit`; the covariance is singular along what the bond holds.

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
    >>> abs(found.axis.round(6))
    array([0., 0., 1.])
    """
    at = checks.array("points", points, (None, 3))
    q = constrained.chart.shape[1]
    if len(at) < q:
        raise ValueError(f"points must be at least {q}, the number of parameters, not {len(at)}")
    found = solve(constrained, at, loss_scale=loss_scale)
    return found.primitive.with_fit(fit_of(found.primitive, at, chart=found.chart))
