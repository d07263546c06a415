"""Noise for meshes that are exact: along normals, along one axis, along directions drawn for each vertex."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh._vec import norm, normalized
from simplexmesh.data.triangles import TriangleMesh

Array = NDArray[np.float64]

ALONG = ("normals", "axis", "directions", "all")
UNITS = ("diagonal", "edge", "length")
DISTRIBUTIONS = ("normal", "uniform")


def unit_of(mesh: TriangleMesh, unit: str) -> float:
    """Return what amounts of noise are in: the bounding box's diagonal, the mean edge, or the mesh's own unit, 1."""
    if _check.choice("unit", unit, UNITS) == "diagonal":
        return float(norm(np.ptp(mesh.vertices, axis=0)))
    if unit == "length":
        return 1.0
    edges = np.unique(np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    return float(norm(mesh.vertices[edges[:, 0]] - mesh.vertices[edges[:, 1]]).mean())


def noisy(
    mesh: TriangleMesh,
    amount: float,
    *,
    unit: str = "edge",
    along: str = "all",
    distribution: str = "normal",
    normals: ArrayLike | None = None,
    rng: np.random.Generator | int | None = None,
) -> TriangleMesh:
    """Return the mesh with its vertices moved at random.

    Parameters
    ----------
    mesh : TriangleMesh
    amount : float
        Standard deviation for normal noise, total width for uniform noise, in `unit`.
    unit : {"edge", "diagonal", "length"}
        The mean edge, the diagonal of the bounding box, the mesh's unit of length.
    along : {"all", "normals", "axis", "directions"}
        Which way vertices go: each coordinate by itself, along normals, along x, y or z, drawn once for all vertices,
        or each vertex along a direction of its own.
    distribution : {"normal", "uniform"}
        Uniform noise is centered, but along directions of their own vertices go from 0 to `amount`. In diagonals that
        is the article's noise (2012), of table 10 along normals, of table 11 along "directions".
    normals : (n, 3) array of float, optional
        Unit vectors for "normals"; the mesh's own by default.
    rng : numpy.random.Generator or int, optional

    Examples
    --------
    >>> from simplexmesh.surface.truth.discretized import uv_sphere
    >>> ball = uv_sphere(16, 16).mesh
    >>> moved = noisy(ball, 0.001, unit="diagonal", along="normals", distribution="uniform", rng=0)
    >>> bool(norm(moved.vertices - ball.vertices).max() < 0.001 * 4 * 3**0.5 / 2)
    True
    """
    _check.choice("along", along, ALONG)
    _check.choice("distribution", distribution, DISTRIBUTIONS)
    size = _check.number("amount", amount, 0.0) * unit_of(mesh, unit)
    chance = _check.generator("rng", rng)
    n = len(mesh.vertices)
    axis = np.eye(3)[chance.integers(3)] if along == "axis" else None
    shape = (n, 3) if along == "all" else (n, 1)
    shift = chance.normal(size=shape) if distribution == "normal" else chance.uniform(-0.5, 0.5, shape)
    if along == "directions":
        shift = shift if distribution == "normal" else shift + 0.5
        shift = shift * normalized(chance.normal(size=(n, 3)))
    elif along == "normals":
        ways = mesh.vertex_normals if normals is None else _check.array("normals", normals, (n, 3))
        shift = shift * ways
    elif axis is not None:
        shift = shift * axis
    return TriangleMesh(mesh.vertices + size * shift, mesh.faces)


def noise_levels(
    mesh: TriangleMesh,
    amounts: Sequence[float],
    *,
    cumulative: bool = False,
    rng: np.random.Generator | int | None = None,
    unit: str = "edge",
    along: str = "all",
    distribution: str = "normal",
    normals: ArrayLike | None = None,
) -> Iterator[TriangleMesh]:
    """Yield the mesh at each amount of noise, drawn anew each time.

    Parameters
    ----------
    mesh, rng, unit, along, distribution, normals
        As for `noisy`.
    amounts : sequence of float
        One mesh for each.
    cumulative : bool
        Add each level's noise to the mesh of the level before, as the article's tables 10 and 11 seem to have been
        made: with amounts 1, 2, 3 ... the last mesh has the noise of sqrt(1 + 4 + 9 ...).
    """
    chance = _check.generator("rng", rng)
    size = unit_of(mesh, unit)  # of the clean mesh, at every level
    way = None if normals is None and along != "normals" else mesh.vertex_normals if normals is None else normals
    current = mesh
    for amount in amounts:
        base = current if cumulative else mesh
        current = noisy(
            base, amount * size, unit="length", along=along, distribution=distribution, normals=way, rng=chance
        )
        yield current
