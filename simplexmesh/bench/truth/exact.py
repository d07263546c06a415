"""Exact normals, curvatures and principal directions at points of a surface, also of a level set F = 0."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import cross, norm, tangents


@dataclass(frozen=True, eq=False, repr=False)
class Exact:
    """Outward unit normals (n, 3), k1 >= k2 (n,) and the direction d1 (n, 3) of k1; signs as in `Curvature`."""

    normals: Array
    k1: Array
    k2: Array
    d1: Array

    def __len__(self) -> int:
        return len(self.k1)

    def __getitem__(self, rows: Any) -> Exact:
        chosen = np.atleast_1d(np.arange(len(self))[rows])
        return Exact(*(getattr(self, field.name)[chosen] for field in fields(self)))

    @cached_property
    def d2(self) -> Array:
        """(n, 3) array of float: principal direction of k2."""
        return cross(self.normals, self.d1)

    @cached_property
    def mean(self) -> Array:
        """(n,) array of float: H."""
        return np.asarray((self.k1 + self.k2) / 2)

    @cached_property
    def gauss(self) -> Array:
        """(n,) array of float: K."""
        return np.asarray(self.k1 * self.k2)


def of_level_set(gradients: Array, hessians: Array) -> Exact:
    """Return the exact values where F = 0, from its gradients (n, 3) and Hessians (n, 3, 3), F increasing outward."""
    length = norm(gradients)
    normals = gradients / length[:, None]
    u, v = tangents(normals)
    along_u, across, along_v = (np.einsum("ni,nij,nj->n", a, hessians, b) / length for a, b in ((u, u), (u, v), (v, v)))
    mean, half = (along_u + along_v) / 2, (along_u - along_v) / 2
    amplitude, angle = np.hypot(half, across), np.arctan2(across, half) / 2
    d1 = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    return Exact(normals, mean + amplitude, mean - amplitude, d1)


def paired(u: ArrayLike, v: ArrayLike) -> tuple[Array, Array]:
    """Return two parameters as (n,) arrays of equal length, by broadcasting."""
    a, b = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
    return np.atleast_1d(a).ravel(), np.atleast_1d(b).ravel()
