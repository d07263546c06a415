"""Smoothing of fields on a surface by diffusion: Gaussian windows of any width at a cost linear in the vertices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix, diags
from scipy.sparse.linalg import spsolve

from simplexmesh._vec import cross, dot, norm
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]

TOLERANCE = 1e-5
"""Relative residual at which the solver stops."""

FIRST_STEPS = 2
"""Implicit steps to the first window."""

MAX_ITERATIONS = 2000
"""Of conjugate gradients; a system that needs more is solved directly."""

UNKNOWN_MASS = 1e-9
"""Relative mass of a vertex without a value: it takes its neighbors' values and hardly affects theirs."""

MIN_SINE = 1e-9
"""Angles whose sine is less than this have no cotangent."""

MAX_COTANGENT = 10.0
"""Bound on cotangents, at about 6 degrees: slivers would couple their ends and slow down the solver."""


@dataclass(frozen=True, eq=False)
class Diffusion:
    """Diffusion of per-vertex fields along a surface.

    Diffusion for the time sigma^2 / 2 is a convolution with the Gaussian window exp(-d^2 / 2 sigma^2). Each step is one
    implicit Euler step, (M + t L) u = M u_0, with the lumped mass matrix M and the cotangent Laplacian L (without
    negative weights, so that means stay between the values). Borders are reflecting (Neumann). In a cloud, and in a
    simplex mesh, L is the Laplacian of the edges, weighted by their lengths.

    Parameters
    ----------
    samples : Samples
        The surface.
    """

    samples: Samples

    @cached_property
    def spacing(self) -> float:
        """Mean distance between neighbors."""
        ring = self.samples.one_ring
        ends = np.repeat(ring.centers, ring.valence)
        lengths = norm(self.samples.points[ring.members] - self.samples.points[ends])
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
    def links(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Rows and columns of the Laplacian's entries, the diagonal included."""
        entries = self._system[1].tocoo()
        return entries.row, entries.col

    def smoothed(self, values: Array, sigma: float, *, steps: int = FIRST_STEPS) -> Array:
        """Return the field smoothed with width sigma; NaN are unknown, and are filled in.

        Parameters
        ----------
        values : (n,) array of float
        sigma : float
            Standard deviation of the window, in the unit of the points.
        steps : int
            Implicit steps: more steps make the window closer to a Gaussian.
        """
        return self.at_scales(values, [sigma], first=steps)[0]

    def at_scales(self, values: Array, scales: list[float], *, first: int = FIRST_STEPS) -> list[Array]:
        """Return the field smoothed with increasing widths, each from the one before."""
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
        """Return a smoothed tangential field, given as complex numbers in each vertex's own frame.

        Parameters
        ----------
        values : (n,) array of float or complex
            NaN where unknown.
        rotations : (m,) array of complex
            For each of `links`, the factor that transforms from the frame of its column to that of its row.
        sigma : float
            Standard deviation of the window, in the unit of the points.
        """
        known = np.isfinite(values)
        out = np.where(known, values, 0.0).astype(complex)
        stiffness = self._system[1].tocoo()
        rotated = csr_matrix((stiffness.data * rotations, (stiffness.row, stiffness.col)), stiffness.shape)
        for _ in range(FIRST_STEPS):
            out = _diffused(self._masses(known), 0.5 * sigma**2 / FIRST_STEPS, rotated, out)
        return out

    def _masses(self, known: NDArray[np.bool_]) -> Array:
        """Return the lumped masses: areas, nearly zero at unknown values."""
        areas = self._system[0]
        mass = np.where(known, areas, UNKNOWN_MASS * areas)
        return np.where(mass > 0, mass, UNKNOWN_MASS * float(areas.max(initial=1.0) or 1.0))


def _diffused(mass: Array, time: float, stiffness: csr_matrix, initial: Any) -> Any:
    """Solve (M + t L) u = M u_0, real or complex, by conjugate gradients with a Jacobi preconditioner.

    Inner products are by `dot`, not `@`: from 10,000 entries on BLAS wakes its threads for each, which on a busy
    machine takes a hundred times as long as the sum.
    """
    matrix = (diags(mass) + time * stiffness).tocsr()
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


def _of_triangles(points: Array, faces: NDArray[np.int64]) -> tuple[Array, csr_matrix]:
    """Return a third of the area of the triangles at each vertex, and the cotangent Laplacian."""
    n = len(points)
    corners = points[faces]
    double = norm(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    areas: Array = np.bincount(faces.ravel(), np.repeat(double / 6, 3), n).astype(float)
    rows, columns, weights = [], [], []
    for j in range(3):
        a, b = faces[:, (j + 1) % 3], faces[:, (j + 2) % 3]
        one, other = corners[:, (j + 1) % 3] - corners[:, j], corners[:, (j + 2) % 3] - corners[:, j]
        valid = double > MIN_SINE * norm(one) * norm(other)
        cotangent = np.divide(dot(one, other), double, out=np.zeros(len(faces)), where=valid)
        rows.append(a)
        columns.append(b)
        weights.append(0.5 * np.clip(cotangent, -MAX_COTANGENT, MAX_COTANGENT))
    return areas, _laplacian(n, np.concatenate(rows), np.concatenate(columns), np.concatenate(weights))


def _of_links(samples: Samples) -> tuple[Array, csr_matrix]:
    """Return areas, and the Laplacian that for regular rings is 4 / sum of r^2 times the sum of u_i - u_j."""
    ring = samples.one_ring
    n, counts = len(samples.points), np.maximum(ring.valence, 1)
    ends = np.repeat(ring.centers, ring.valence)
    squares = np.bincount(ends, ((samples.points[ring.members] - samples.points[ends]) ** 2).sum(axis=1), n)
    areas = np.sqrt(3) / 4 * squares if samples.links is not None else 2 * np.pi * squares / counts**2
    share = np.divide(4 * areas, squares, out=np.zeros(n), where=squares > 0)
    return areas, _laplacian(n, ends, ring.members, 0.5 * share[ends])


def _laplacian(n: int, rows: NDArray[np.int64], columns: NDArray[np.int64], weights: Array) -> csr_matrix:
    """Return D - W for the symmetrized weights W, negative entries set to zero, and its row sums D."""
    half = coo_matrix((weights, (rows, columns)), (n, n)).tocsr()
    symmetric = (half + half.T).tocsr()
    symmetric.data = np.maximum(symmetric.data, 0.0)
    return (diags(np.asarray(symmetric.sum(axis=1)).ravel()) - symmetric).tocsr()
