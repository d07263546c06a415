"""Implicit surfaces F = 0, F increasing outward: curvatures by the formulas of Goldman (2005), a second derivation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from simplexmesh.bench.truth.exact import of_level_set


@dataclass(frozen=True)
class Implicit:
    """F, its gradient and its Hessian, functions of (n, 3) points."""

    value: Any
    gradient: Any
    hessian: Any

    def exact(self, points):
        return of_level_set(self.gradient(points), self.hessian(points))

    def curvatures(self, points):
        return goldman(self.gradient(points), self.hessian(points))


def goldman(gradients, hessians):
    """H and K: (|g|^2 tr(A) - g.Ag) / (2 |g|^3) and g.adj(A)g / |g|^4 (Goldman 2005, in this library's sign)."""
    length = np.linalg.norm(gradients, axis=1)
    trace = np.trace(hessians, axis1=1, axis2=2)
    along = np.einsum("ni,nij,nj->n", gradients, hessians, gradients)
    adjugate = np.cross(hessians[:, [1, 2, 0]], hessians[:, [2, 0, 1]])  # of a symmetric matrix: that of cofactors
    gauss = np.einsum("ni,nij,nj->n", gradients, adjugate, gradients) / length**4
    return (length**2 * trace - along) / (2 * length**3), gauss


def quadric(form, constant, middle=(0.0, 0.0, 0.0)):
    A, c = np.asarray(form, float), np.asarray(middle)
    return Implicit(
        lambda p: np.einsum("ni,ij,nj->n", p - c, A, p - c) - constant,
        lambda p: 2 * (p - c) @ A,
        lambda p: np.broadcast_to(2 * A, (len(p), 3, 3)),
    )


def sphere(radius):
    return quadric(np.eye(3), radius**2)


def cylinder(radius):
    return quadric(np.diag([1.0, 1.0, 0.0]), radius**2)


def ellipsoid(axes):
    return quadric(np.diag(1 / np.asarray(axes) ** 2), 1.0)


def torus(radius, tube):
    """(x^2 + y^2 + z^2 + R^2 - r^2)^2 = 4 R^2 (x^2 + y^2)."""
    flat = np.diag([1.0, 1.0, 0.0])

    def inner(p):
        return (p**2).sum(axis=1) + radius**2 - tube**2

    return Implicit(
        lambda p: inner(p) ** 2 - 4 * radius**2 * (p[:, :2] ** 2).sum(axis=1),
        lambda p: 4 * inner(p)[:, None] * p - 8 * radius**2 * (p @ flat),
        lambda p: 8 * p[:, :, None] * p[:, None, :] + 4 * inner(p)[:, None, None] * np.eye(3) - 8 * radius**2 * flat,
    )


def of_graph(surface):
    """z = f(x, y)."""

    def gradient(p):
        _, fx, fy, *_ = surface.jet(p[:, 0], p[:, 1])
        return np.stack([-fx, -fy, np.ones(len(p))], axis=1)

    def hessian(p):
        *_, xx, xy, yy = surface.jet(p[:, 0], p[:, 1])
        zero = np.zeros(len(p))
        return np.moveaxis(np.array([[-xx, -xy, zero], [-xy, -yy, zero], [zero, zero, zero]]), 2, 0)

    return Implicit(lambda p: p[:, 2] - surface.jet(p[:, 0], p[:, 1])[0], gradient, hessian)
