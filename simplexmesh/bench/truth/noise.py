"""Gaussian noise on the vertices of a mesh."""

from __future__ import annotations

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.vectors import norm
from simplexmesh.data.triangles import TriangleMesh

UNITS = ("diagonal", "edge")


def unit_of(mesh: TriangleMesh, unit: str) -> float:
    """Return the unit of amounts of noise: the bounding box's diagonal, or the mean edge."""
    if checks.choice("unit", unit, UNITS) == "diagonal":
        return mesh.diagonal
    edges = np.unique(np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    return float(norm(mesh.vertices[edges[:, 0]] - mesh.vertices[edges[:, 1]]).mean())


def noisy(
    mesh: TriangleMesh, amount: float, *, unit: str = "edge", rng: np.random.Generator | int | None = None
) -> TriangleMesh:
    """Return a mesh with normal noise in every coordinate, of the standard deviation `amount` in a unit of `UNITS`."""
    scale = checks.number("amount", amount, 0.0) * unit_of(mesh, unit)
    shift = checks.generator("rng", rng).normal(size=mesh.vertices.shape)
    return TriangleMesh(mesh.vertices + scale * shift, mesh.faces)
