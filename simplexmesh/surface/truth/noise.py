"""Noise on vertices: isotropic, along normals, along one axis, or along random directions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

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
    """Return the unit of amounts of noise: the bounding box's diagonal, the mean edge, or 1."""
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
    """Return the mesh with random displacements of its vertices.

    Parameters
    ----------
    mesh : TriangleMesh
    amount : float
        Standard deviation for normal noise, total width for uniform noise, in `unit`.
    unit : {"edge", "diagonal", "length"}
        The mean edge, the diagonal of the bounding box, the mesh's unit of length.
    along : {"all", "normals", "axis", "directions"}
        Direction of the noise: all coordinates independently; normals; one coordinate axis, the same for all vertices,
        drawn at random; a random direction per vertex.
    distribution : {"normal", "uniform"}
        Uniform noise is centered, except along "directions", where it is from 0 to `amount`. With unit "diagonal" this
        is the noise of the article (2012), in table 10 along normals, in table 11 along "directions".
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
    scale = _check.number("amount", amount, 0.0) * unit_of(mesh, unit)
    generator = _check.generator("rng", rng)
    n = len(mesh.vertices)
    axis = np.eye(3)[generator.integers(3)] if along == "axis" else None
    shape = (n, 3) if along == "all" else (n, 1)
    shift = generator.normal(size=shape) if distribution == "normal" else generator.uniform(-0.5, 0.5, shape)
    if along == "directions":
        shift = shift if distribution == "normal" else shift + 0.5
        shift = shift * normalized(generator.normal(size=(n, 3)))
    elif along == "normals":
        directions = mesh.vertex_normals if normals is None else _check.array("normals", normals, (n, 3))
        shift = shift * directions
    elif axis is not None:
        shift = shift * axis
    return TriangleMesh(mesh.vertices + scale * shift, mesh.faces)


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
    """Yield the mesh at each amount of noise, with independent realizations.

    Parameters
    ----------
    mesh, rng, unit, along, distribution, normals
        As for `noisy`.
    amounts : sequence of float
        Amount of noise of each mesh.
    cumulative : bool
        Whether to add each level's noise to the mesh of the level before, as apparently in the article's tables 10 and
        11: with amounts 1, 2, 3 ... the last mesh has noise of sqrt(1 + 4 + 9 ...).
    """
    generator = _check.generator("rng", rng)
    unit_length = unit_of(mesh, unit)  # of the clean mesh, at every level
    if normals is None and along == "normals":
        normals = mesh.vertex_normals
    options: dict[str, Any] = {"unit": "length", "along": along, "distribution": distribution, "normals": normals}
    current = mesh
    for amount in amounts:
        current = noisy(current if cumulative else mesh, amount * unit_length, **options, rng=generator)
        yield current
