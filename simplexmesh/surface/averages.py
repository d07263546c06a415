"""Averages over a surface by diffusion along it: Gaussian windows at a cost that grows with the vertices alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix, diags

from simplexmesh._vec import cross, dot, norm
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]

TOLERANCE = 1e-5
"""Residual at which the solver stops, as a share of the right-hand side."""

STEPS = 2
"""Implicit steps to the first window."""

MOST_STEPS = 2000
UNKNOWN = 1e-9
"""What a vertex without a value weighs against one with: it takes its neighbors' and gives none."""

FLAT = 1e-9
"""Angles whose sine is less than this have no cotangent."""

STEEP = 10.0
"""Cotangents are cut there, at some 6 degrees: slivers would tie their ends together, and the solver up."""


@dataclass(frozen=True, eq=False)
class Averages:
    """Weighted means of what vertices know, over windows that follow the surface.

    Heat that spreads for the time sigma^2 / 2 is a mean with the Gaussian window exp(-d^2 / 2 sigma^2). Each step is
    one implicit Euler step, (M + t L) u = M u_0, with the areas M of vertices and the cotangent Laplacian L (negative
    weights left out, so that means stay between the values); borders reflect, so nothing is lost there and no rim
    stands out. In a cloud, and in a simplex mesh, L is that of the edges, weighted by their lengths.

    Parameters
    ----------
    samples : Samples
        Of the surface.
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
        """Diagonal of the bounding box of what has neighbors."""
        used = self.samples.points[self.samples.one_ring.valence > 0]
        return float(np.linalg.norm(np.ptp(used, axis=0))) if len(used) else 0.0

    @cached_property
    def areas(self) -> Array:
        """(n,) array of float: area that belongs to each vertex."""
        return self._system[0]

    @cached_property
    def _system(self) -> tuple[Array, csr_matrix]:
        if self.samples.faces is not None:
            return _of_triangles(self.samples.points, self.samples.faces)
        return _of_links(self.samples)

    @property
    def links(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Rows and columns of the Laplacian's entries: between which vertices what is averaged goes, and from each."""
        entries = self._system[1].tocoo()
        return entries.row, entries.col

    def over(self, values: Array, sigma: float, *, steps: int = STEPS) -> Array:
        """Return means over windows of the width sigma; NaN are no values, and are filled in from around.

        Parameters
        ----------
        values : (n,) array of float
        sigma : float
            Standard deviation of the window, in the unit of the points.
        steps : int
            The more, the more like a Gaussian's its flanks.
        """
        return self.at_scales(values, [sigma], first=steps)[0]

    def at_scales(self, values: Array, scales: list[float], *, first: int = STEPS) -> list[Array]:
        """Return means over windows of rising widths, each made from the one before."""
        known = np.isfinite(values)
        start = np.where(known, values, float(values[known].mean()) if known.any() else 0.0)
        areas, stiffness = self._system
        found: list[Array] = []
        mass, done = self._masses(known), 0.0
        for scale in scales:
            time = 0.5 * (scale**2 - done)
            for _ in range(first if not found else 1):
                if time > 0:
                    start = _solved(mass, time / (first if not found else 1), stiffness, start)
            mass = np.where(areas > 0, areas, mass)  # from here on every vertex has a value
            found.append(start)
            done = scale**2
        return found

    def over_turning(self, values: Array, turns: NDArray[np.complex128], sigma: float) -> NDArray[np.complex128]:
        """Return means of what has a direction in tangent planes, as complex numbers in each vertex's own frame.

        Parameters
        ----------
        values : (n,) array of float or complex
            NaN for none.
        turns : (m,) array of complex
            For each of `links`, by what a number in the frame of its column is multiplied to be one in that of its row.
        sigma : float
            Standard deviation of the window, in the unit of the points.
        """
        known = np.isfinite(values)
        out = np.where(known, values, 0.0).astype(complex)
        stiffness = self._system[1].tocoo()
        turning = csr_matrix((stiffness.data * turns, (stiffness.row, stiffness.col)), stiffness.shape)
        for _ in range(STEPS):
            out = _solved(self._masses(known), 0.5 * sigma**2 / STEPS, turning, out)
        return out

    def _masses(self, known: NDArray[np.bool_]) -> Array:
        """Return what each vertex weighs: its area, or hardly anything."""
        areas = self._system[0]
        mass = np.where(known, areas, UNKNOWN * areas)
        return np.where(mass > 0, mass, UNKNOWN * float(areas.max(initial=1.0) or 1.0))


def _solved(mass: Array, time: float, stiffness: csr_matrix, start: Any) -> Any:
    """Solve (M + t L) u = M u_0, real or complex, by conjugate gradients, preconditioned by the diagonal.

    Products of vectors by `dot`, not `@`: from 10,000 entries on BLAS wakes its threads for each, which on a busy
    machine takes a hundred times as long as the sum.
    """
    matrix = (diags(mass) + time * stiffness).tocsr()
    right = mass * start
    inverse = 1 / matrix.diagonal().real
    u = start.copy()
    residual = right - matrix @ u
    z = inverse * residual
    direction, product = z.copy(), _product(residual, z)
    goal = TOLERANCE**2 * _product(right, inverse * right)
    for _ in range(MOST_STEPS):
        if product <= goal:
            break
        turned = matrix @ direction
        step = product / _product(direction, turned)
        u += step * direction
        residual -= step * turned
        z = inverse * residual
        product, before = _product(residual, z), product
        direction = z + (product / before) * direction
    return u


def _product(a: Any, b: Any) -> float:
    return float(dot(a.conj(), b).real)


def _of_triangles(points: Array, faces: NDArray[np.int64]) -> tuple[Array, csr_matrix]:
    """Return a third of the areas around each vertex, and half the cotangents opposite each edge."""
    n = len(points)
    corners = points[faces]
    double = norm(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    areas: Array = np.bincount(faces.ravel(), np.repeat(double / 6, 3), n).astype(float)
    rows, columns, weights = [], [], []
    for j in range(3):
        a, b = faces[:, (j + 1) % 3], faces[:, (j + 2) % 3]
        one, other = corners[:, (j + 1) % 3] - corners[:, j], corners[:, (j + 2) % 3] - corners[:, j]
        sound = double > FLAT * norm(one) * norm(other)
        cotangent = np.divide(dot(one, other), double, out=np.zeros(len(faces)), where=sound)
        rows.append(a)
        columns.append(b)
        weights.append(0.5 * np.clip(cotangent, -STEEP, STEEP))
    return areas, _laplacian(n, np.concatenate(rows), np.concatenate(columns), np.concatenate(weights))


def _of_links(samples: Samples) -> tuple[Array, csr_matrix]:
    """Return areas and weights that give the Laplacian of neighbors evenly around: 4 / sum of r^2 (u_j - u_i)."""
    ring = samples.one_ring
    n, counts = len(samples.points), np.maximum(ring.valence, 1)
    ends = np.repeat(ring.centers, ring.valence)
    squares = np.bincount(ends, ((samples.points[ring.members] - samples.points[ends]) ** 2).sum(axis=1), n)
    areas = np.sqrt(3) / 4 * squares if samples.links is not None else 2 * np.pi * squares / counts**2
    share = np.divide(4 * areas, squares, out=np.zeros(n), where=squares > 0)
    return areas, _laplacian(n, ends, ring.members, 0.5 * share[ends])


def _laplacian(n: int, rows: NDArray[np.int64], columns: NDArray[np.int64], weights: Array) -> csr_matrix:
    """Return D - W for the symmetric W that has each weight in both its places; what is negative counts as nothing."""
    half = coo_matrix((weights, (rows, columns)), (n, n)).tocsr()
    whole = (half + half.T).tocsr()
    whole.data = np.maximum(whole.data, 0.0)
    return (diags(np.asarray(whole.sum(axis=1)).ravel()) - whole).tocsr()
