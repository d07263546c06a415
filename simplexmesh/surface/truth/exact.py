"""Exact normals, curvatures and principal directions at points of a surface, also of a level set F = 0."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh._vec import cross, dot, norm

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Exact:
    """Exact normals and curvatures at n points, with the signs of `Curvature`: a sphere has k1 = k2 = 1 / radius.

    Attributes
    ----------
    normals : (n, 3) array of float
        Unit normals, outward.
    k1, k2 : (n,) array of float
        Principal curvatures, k1 >= k2, 1 / length.
    d1 : (n, 3) array of float
        Principal direction of k1, a unit tangent; arbitrary where k1 = k2.

    Examples
    --------
    >>> from simplexmesh.surface.truth.closed import Torus
    >>> points, exact = Torus(1.0, 0.35).at(0.0, [0.0, np.pi])
    >>> exact.mean.round(6), exact.gauss.round(6)
    (array([1.798942, 0.659341]), array([ 2.116402, -4.395604]))
    """

    normals: Array
    k1: Array
    k2: Array
    d1: Array

    def __post_init__(self) -> None:
        for name in ("normals", "k1", "k2", "d1"):
            object.__setattr__(self, name, _check.frozen(getattr(self, name), np.float64))

    def __repr__(self) -> str:
        return f"Exact({len(self.k1):,} points)"

    def __len__(self) -> int:
        return len(self.k1)

    def __getitem__(self, rows: object) -> Exact:
        """Return the values at some of the points, or at one."""
        chosen = [rows] if isinstance(rows, int | np.integer) else rows
        return Exact(*(getattr(self, name)[chosen] for name in ("normals", "k1", "k2", "d1")))

    @cached_property
    def d2(self) -> Array:
        """(n, 3) array of float: principal direction of k2, the cross product of normal and `d1`."""
        return cross(self.normals, self.d1)

    @cached_property
    def mean(self) -> Array:
        """(n,) array of float: H = (k1 + k2) / 2."""
        out: Array = (self.k1 + self.k2) / 2
        return out

    @cached_property
    def gauss(self) -> Array:
        """(n,) array of float: K = k1 k2."""
        out: Array = self.k1 * self.k2
        return out


def of_level_set(gradients: Array, hessians: Array) -> Exact:
    """Return the exact values on the surface F = 0, with F increasing outward.

    The normal is the direction of the gradient, and the normal curvature along a unit tangent t is
    t . (Hess F) t / |grad F|. The principal curvatures are the eigenvalues of that form in the tangent plane.

    Parameters
    ----------
    gradients : (n, 3) array of float
        Gradients of F at points of the surface, not zero.
    hessians : (n, 3, 3) array of float
        Hessians of F there.
    """
    length = norm(gradients)
    normals = gradients / length[:, None]
    u, v = tangents(normals)
    across = np.einsum("ni,nij,nj->n", u, hessians, v) / length
    along_u = np.einsum("ni,nij,nj->n", u, hessians, u) / length
    along_v = np.einsum("ni,nij,nj->n", v, hessians, v) / length
    mean, half = (along_u + along_v) / 2, (along_u - along_v) / 2
    amplitude, angle = np.hypot(half, across), np.arctan2(across, half) / 2
    d1 = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    return Exact(normals, mean + amplitude, mean - amplitude, d1)


def goldman(gradients: Array, hessians: Array) -> tuple[Array, Array]:
    """Return the mean and Gaussian curvature of F = 0, with F increasing outward.

    H = (|grad F|^2 trace(Hess F) - grad F . Hess F grad F) / (2 |grad F|^3), K = grad F . adj(Hess F) grad F /
    |grad F|^4 (Goldman 2005, Curvature formulas for implicit curves and surfaces, in this library's sign).

    Parameters
    ----------
    gradients, hessians : (n, 3) and (n, 3, 3) arrays of float
        As for `of_level_set`.

    Examples
    --------
    >>> at = np.array([[0.0, 0.0, 2.0]])
    >>> mean, gauss = goldman(2 * at, 2 * np.eye(3)[None])
    >>> mean.tolist(), gauss.tolist()
    ([0.5], [0.25])
    """
    length = norm(gradients)
    trace = np.trace(hessians, axis1=1, axis2=2)
    along = np.einsum("ni,nij,nj->n", gradients, hessians, gradients)
    rows = hessians[:, [1, 2, 0]], hessians[:, [2, 0, 1]]
    adjugate = cross(*rows)  # of a symmetric matrix: the matrix of cofactors
    mean = (length**2 * trace - along) / (2 * length**3)
    gauss = np.einsum("ni,nij,nj->n", gradients, adjugate, gradients) / length**4
    return mean, gauss


def tangents(normals: Array) -> tuple[Array, Array]:
    """Return unit tangents u, v with u x v = n; u is the projection of the x axis, or of the y axis."""
    x = np.eye(3)[np.where(np.abs(normals[:, 0]) < 0.9, 0, 1)]
    u = x - dot(x, normals)[:, None] * normals
    u /= norm(u)[:, None]
    return u, cross(normals, u)


def paired(u: ArrayLike, v: ArrayLike) -> tuple[Array, Array]:
    """Return two parameters as (n,) arrays of equal length, by broadcasting."""
    a, b = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
    return np.atleast_1d(a).ravel(), np.atleast_1d(b).ravel()
