"""Smoothing of fields on a surface by diffusion: Gaussian windows of any width at a cost linear in the vertices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix, diags
from scipy.sparse.linalg import spsolve

from simplexmesh._base.arrays import Array, Indices, Indices32, Mask
from simplexmesh._base.vectors import cross, dot, norm
from simplexmesh.surface.sampled_surface import SampledSurface

TOLERANCE = 1e-5
"""Relative residual at which the solver stops."""

MAX_ITERATIONS = 2000
"""Of conjugate gradients; a system that needs more is solved directly."""

TINY = 1e-9
"""Relative mass of a vertex without a value, which takes its neighbors' values and hardly affects theirs; and the sine
below which angles have no cotangent."""

MAX_COTANGENT = 10.0
"""Bound on cotangents, at about 6 degrees: slivers would couple their ends and slow down the solver."""


@dataclass(frozen=True, eq=False)
class Diffusion:
    """Gaussian windows along a surface: diffusion for the time sigma^2 / 2, in steps (M + t L) u = M u_0."""

    samples: SampledSurface

    @cached_property
    def spacing(self) -> float:
        """Mean distance between neighbors."""
        lengths = self.samples.ring_edges[1]
        return float(lengths.mean()) if len(lengths) else 0.0

    @cached_property
    def diagonal(self) -> float:
        """Diagonal of the bounding box of the vertices that have neighbors."""
        used = self.samples.points[self.samples.one_ring.valence > 0]
        return float(np.linalg.norm(np.ptp(used, axis=0))) if len(used) else 0.0

    @cached_property
    def areas(self) -> Array:
        """(n,) array of float: area of each vertex."""
        return self._system[0]

    @cached_property
    def _system(self) -> tuple[Array, csr_matrix]:
        if self.samples.faces is not None:
            return _of_triangles(self.samples.points, self.samples.faces)
        return _of_links(self.samples)

    @property
    def links(self) -> tuple[Indices32, Indices32]:
        """Rows and columns of the Laplacian's entries, the diagonal included."""
        entries = self._system[1].tocoo()
        return entries.row, entries.col

    def smoothed(self, values: Array, sigma: float, *, steps: int = 2) -> Array:
        """Return the field smoothed with width sigma in implicit steps; NaN are unknown, and are filled in."""
        return self.at_scales(values, [sigma], first=steps)[0]

    def averaged(self, values: Array, sigma: float) -> Array:
        """Return the field smoothed with width sigma, 0 for none; NaN stay."""
        return np.where(np.isfinite(values), self.smoothed(values, sigma), np.nan) if sigma > 0 else values

    def at_scales(self, values: Array, scales: list[float], *, first: int = 2) -> list[Array]:
        """Return the field smoothed with increasing widths, each from the one before, the first in several steps."""
        known = np.isfinite(values)
        u = np.where(known, values, float(values[known].mean()) if known.any() else 0.0)
        areas, stiffness = self._system
        found: list[Array] = []
        mass, done = self._masses(known), 0.0
        for scale in scales:
            time = 0.5 * (scale**2 - done)
            for _ in range(first if not found else 1):
                if time > 0:
                    u = _diffused(mass, time / (first if not found else 1), stiffness, u)
            mass = np.where(areas > 0, areas, mass)  # from here on every vertex has a value
            found.append(u)
            done = scale**2
        return found

    def smoothed_deviators(
        self, values: Array, rotations: NDArray[np.complex128], sigma: float
    ) -> NDArray[np.complex128]:
        """Return a smoothed tangential field, complex in each vertex's frame; `rotations` are those along the links."""
        known = np.isfinite(values)
        out = np.where(known, values, 0.0).astype(complex)
        stiffness = self._system[1].tocoo()
        rotated = csr_matrix((stiffness.data * rotations, (stiffness.row, stiffness.col)), stiffness.shape)
        for _ in range(2):
            out = _diffused(self._masses(known), 0.25 * sigma**2, rotated, out)
        return out

    def _masses(self, known: Mask) -> Array:
        """Return the lumped masses: areas, nearly zero at unknown values."""
        areas = self._system[0]
        mass = np.where(known, areas, TINY * areas)
        return np.where(mass > 0, mass, TINY * float(areas.max(initial=1.0) or 1.0))


def _diffused(mass: Array, time: float, stiffness: csr_matrix, initial: Any) -> Any:
    """Solve (M + t L) u = M u_0, real or complex, by conjugate gradients with a Jacobi preconditioner."""
    matrix = (diags(mass) + time * stiffness).tocsr()
    # inner products are by `dot`, not `@`: BLAS wakes its threads for each, a hundred times the sum on a busy machine
    right = mass * initial
    inverse = 1 / matrix.diagonal().real
    u = initial.copy()
    residual = right - matrix @ u
    z = inverse * residual
    direction, residual_square = z.copy(), _inner(residual, z)
    target = TOLERANCE**2 * _inner(right, inverse * right)
    for _ in range(MAX_ITERATIONS):
        if residual_square <= target:
            break
        image = matrix @ direction
        step = residual_square / _inner(direction, image)
        u += step * direction
        residual -= step * image
        z = inverse * residual
        residual_square, previous = _inner(residual, z), residual_square
        direction = z + (residual_square / previous) * direction
    else:
        return spsolve(matrix, right)
    return u


def _inner(a: Any, b: Any) -> float:
    return float(dot(a.conj(), b).real)


def _of_triangles(points: Array, faces: Indices) -> tuple[Array, csr_matrix]:
    """Return a third of the area of the triangles at each vertex, and the cotangent Laplacian."""
    n = len(points)
    corners = points[faces]
    double = norm(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    areas: Array = np.bincount(faces.ravel(), np.repeat(double / 6, 3), n).astype(float)
    rows, columns, weights = [], [], []
    for j in range(3):
        a, b = faces[:, (j + 1) % 3], faces[:, (j + 2) % 3]
        one, other = corners[:, (j + 1) % 3] - corners[:, j], corners[:, (j + 2) % 3] - corners[:, j]
        valid = double > TINY * norm(one) * norm(other)
        cotangent = np.divide(dot(one, other), double, out=np.zeros(len(faces)), where=valid)
        rows.append(a)
        columns.append(b)
        weights.append(0.5 * np.clip(cotangent, -MAX_COTANGENT, MAX_COTANGENT))
    return areas, _laplacian(n, np.concatenate(rows), np.concatenate(columns), np.concatenate(weights))


def _of_links(samples: SampledSurface) -> tuple[Array, csr_matrix]:
    """Return areas, and the Laplacian that for regular rings is 4 / sum of r^2 times the sum of u_i - u_j."""
    ring, (ends, lengths) = samples.one_ring, samples.ring_edges
    n, counts = len(samples.points), np.maximum(ring.valence, 1)
    squares = np.bincount(ends, lengths**2, n)
    areas = np.sqrt(3) / 4 * squares if samples.links is not None else 2 * np.pi * squares / counts**2
    share = np.divide(4 * areas, squares, out=np.zeros(n), where=squares > 0)
    return areas, _laplacian(n, ends, ring.members, 0.5 * share[ends])


def _laplacian(n: int, rows: Indices, columns: Indices, weights: Array) -> csr_matrix:
    """Return D - W for the symmetrized weights W, at least 0 so that means stay between values, and row sums D."""
    half = coo_matrix((weights, (rows, columns)), (n, n)).tocsr()
    symmetric = (half + half.T).tocsr()
    symmetric.data = np.maximum(symmetric.data, 0.0)
    return (diags(np.asarray(symmetric.sum(axis=1)).ravel()) - symmetric).tocsr()
