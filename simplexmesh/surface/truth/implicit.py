"""Implicit surfaces F = 0, F increasing outward: curvatures from first and second derivatives (Goldman 2005)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.surface.truth.exact import Exact, goldman, of_level_set
from simplexmesh.surface.truth.graphs import Graph

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Implicit:
    """A surface F = 0, given by F and its derivatives as functions of (n, 3) points.

    Attributes
    ----------
    value : function
        F, negative inside: (n,) array of float.
    gradient, hessian : functions
        Derivatives of F: (n, 3) and (n, 3, 3) arrays of float.

    Examples
    --------
    >>> ball = sphere(2.0)
    >>> mean, gauss = ball.curvatures([[0.0, 0.0, 2.0]])
    >>> mean.tolist(), gauss.tolist()
    ([0.5], [0.25])
    """

    value: Callable[[Array], Array]
    gradient: Callable[[Array], Array]
    hessian: Callable[[Array], Array]

    def exact(self, points: ArrayLike) -> Exact:
        """Return the exact values at (n, 3) points of the surface."""
        at = _check.array("points", points, (None, 3))
        return of_level_set(self.gradient(at), self.hessian(at))

    def curvatures(self, points: ArrayLike) -> tuple[Array, Array]:
        """Return mean and Gaussian curvature by Goldman's formulas."""
        at = _check.array("points", points, (None, 3))
        return goldman(self.gradient(at), self.hessian(at))


def quadric(form: ArrayLike, constant: float) -> Implicit:
    """Return x . form x = constant, with `form` a symmetric (3, 3) array.

    Examples
    --------
    >>> quadric(np.diag([1.0, 1.0, 0.0]), 4.0).exact([[2.0, 0.0, 1.0]]).k1.tolist()
    [0.5]
    """
    A = _check.array("form", form, (3, 3))
    return Implicit(
        lambda p: np.einsum("ni,ij,nj->n", p, A, p) - constant,
        lambda p: 2 * p @ A,
        lambda p: np.broadcast_to(2 * A, (len(p), 3, 3)),
    )


def sphere(radius: float) -> Implicit:
    """Return x^2 + y^2 + z^2 = radius^2."""
    return quadric(np.eye(3), radius**2)


def cylinder(radius: float) -> Implicit:
    """Return x^2 + y^2 = radius^2."""
    return quadric(np.diag([1.0, 1.0, 0.0]), radius**2)


def ellipsoid(axes: tuple[float, float, float]) -> Implicit:
    """Return (x/a)^2 + (y/b)^2 + (z/c)^2 = 1."""
    return quadric(np.diag(1 / np.asarray(axes, float) ** 2), 1.0)


def torus(radius: float, tube: float) -> Implicit:
    """Return (x^2 + y^2 + z^2 + R^2 - r^2)^2 = 4 R^2 (x^2 + y^2)."""
    flat = np.diag([1.0, 1.0, 0.0])

    def inner(p: Array) -> Array:
        out: Array = (p**2).sum(axis=1) + radius**2 - tube**2
        return out

    def hessian(p: Array) -> Array:
        out: Array = 8 * p[:, :, None] * p[:, None, :] + 4 * inner(p)[:, None, None] * np.eye(3) - 8 * radius**2 * flat
        return out

    return Implicit(
        lambda p: inner(p) ** 2 - 4 * radius**2 * (p[:, :2] ** 2).sum(axis=1),
        lambda p: 4 * inner(p)[:, None] * p - 8 * radius**2 * (p @ flat),
        hessian,
    )


def cone(radius: float, height: float) -> Implicit:
    """Return the double cone with apex (0, 0, height) and a circle of `radius` at z = 0."""
    slope = (radius / height) ** 2

    def shifted(p: Array) -> Array:
        return p - np.array([0.0, 0.0, height])

    form = np.diag([1.0, 1.0, -slope])
    return Implicit(
        lambda p: np.einsum("ni,ij,nj->n", shifted(p), form, shifted(p)),
        lambda p: 2 * shifted(p) @ form,
        lambda p: np.broadcast_to(2 * form, (len(p), 3, 3)),
    )


def of_graph(surface: Graph) -> Implicit:
    """Return z - f(x, y) = 0 for a graph."""

    def gradient(p: Array) -> Array:
        _, fx, fy, *_ = surface.jet(p[:, 0], p[:, 1])
        return np.stack([-fx, -fy, np.ones(len(p))], axis=1)

    def hessian(p: Array) -> Array:
        *_, xx, xy, yy = surface.jet(p[:, 0], p[:, 1])
        zero = np.zeros(len(p))
        rows = [[-xx, -xy, zero], [-xy, -yy, zero], [zero, zero, zero]]
        return np.moveaxis(np.array([[entry + zero for entry in row] for row in rows]), 2, 0)

    return Implicit(lambda p: p[:, 2] - surface.jet(p[:, 0], p[:, 1])[0], gradient, hessian)
