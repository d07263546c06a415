"""Salient points: persistent maxima of curvature or saliency (Charton 2014, 1.3.3)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.neighborhoods import Ball, Neighborhoods
from simplexmesh.surface.saliency._kernels_watersheds import watersheds
from simplexmesh.surface.saliency.diffusion import Diffusion
from simplexmesh.surface.saliency.fields import field_of, known_curvature
from simplexmesh.surface.saliency.noise import field_noise, local_noise, remaining_noise, smallest_window
from simplexmesh.surface.saliency.saliency import SCALE_STEPS, saliency
from simplexmesh.surface.sampled_surface import SampledSurface, as_sampled_surface

SIGNIFICANCE = 4.0
"""Least persistence of a maximum in standard deviations of the noise remaining in the field."""


@dataclass(frozen=True, eq=False, repr=False)
class SalientPoints:
    """Salient points of a surface, the most persistent first.

    Attributes
    ----------
    vertices : (m,) array of int
        Their vertices.
    points : (m, 3) array of float
    values : (m,) array of float
        Values of the field there.
    persistence : (m,) array of float
        Height of each above the saddle to a higher one, in the field's unit; of the highest of a component above the
        component's lowest value.
    basin : (n,) array of int
        Index in this list of the point whose basin each vertex of the surface belongs to; -1 for none.
    field : (n,) array of float
        Field whose maxima they are.
    threshold : float
        The least persistence kept.
    radius : float
        Of two points nearer than this only the higher was kept.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 1, 1), 20).triangulated("dual")
    >>> found = sm.salient_points(egg, curvature=sm.curvature(egg, "sine", neighborhood=sm.rings(2)))
    >>> len(found), bool((abs(found.points[:, 0]) > 2.9).all())
    (2, True)
    """

    vertices: Indices
    points: Array
    values: Array
    persistence: Array
    basin: Indices
    field: Array
    threshold: float
    radius: float

    def __repr__(self) -> str:
        return f"SalientPoints({len(self)} points, threshold {self.threshold:.4g}, radius {self.radius:.4g})"

    def __len__(self) -> int:
        return len(self.vertices)

    def __iter__(self) -> Iterator[int]:
        return iter(self.vertices.tolist())


def salient_points(
    surface: Any,
    *,
    of: str | ArrayLike = "magnitude",
    curvature: Curvature | None = None,
    scale: float | None = None,
    radius: float | None = None,
    threshold: float | None = None,
    count: int | None = None,
    border: bool = False,
) -> SalientPoints:
    """Return the points of a surface where curvature is highest: tips, corners, cusps, bottoms of pits.

    The field is smoothed over a small window, and its maxima over the edges are ranked by persistence: the drop from a
    maximum to the highest saddle that leads to a higher one. Maxima within the noise are dropped, and of two that are
    near each other the lower.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        The surface.
    of : {"magnitude", "mean", "curvedness", "saliency"} or (n,) array of float
        The field: abs(H), H (tips only), curvedness, `saliency`, or given values, NaN where unknown, which are not
        smoothed.
    curvature : Curvature, optional
        Curvature of the surface, if known; otherwise it is measured.
    scale : float, optional
        Width of the smoothing window, in the surface's unit of length; 0 for none. By default the smallest of
        `saliency`'s. With "saliency", the width of its smallest window.
    radius : float, optional
        The least distance between two points, in the surface's unit of length. By default 3 windows.
    threshold : float, optional
        The least persistence, in the field's unit: 1 / length, radians for saliency. By default 4 standard deviations
        of the noise that remains after smoothing, estimated from the curvature's error or, if that is unknown, from
        differences between neighbors; and 2 % of the largest value.
    count : int, optional
        Keep at most this many, the most persistent.
    border : bool
        Whether to include vertices on a border, where curvature is least certain.

    Returns
    -------
    SalientPoints

    Raises
    ------
    ValueError, TypeError
        Not a surface, an unknown field, a negative length.

    References
    ----------
    J. Charton, thesis, 2014, 1.3.3 (points of strongest abs(H)); H. Edelsbrunner, D. Letscher, A. Zomorodian,
    *Topological persistence and simplification*, 2002.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 2, 1), 20).triangulated("dual")
    >>> curved = sm.curvature(egg, "sine", neighborhood=sm.rings(2))
    >>> sorted(sm.salient_points(egg, curvature=curved, count=2).points.round(1)[:, 0].tolist())
    [-3.0, 3.0]
    """
    samples = as_sampled_surface(surface)
    diffusion = Diffusion(samples)
    width = smallest_window(diffusion) if scale is None else checks.number("scale", scale, 0.0)
    field, noise = _field(of, samples, diffusion, curvature, width)
    radius = 3 * width if radius is None else checks.number("radius", radius, 0.0)
    included = np.isfinite(field) & (samples.one_ring.valence > 0)
    if threshold is None:
        threshold = max(SIGNIFICANCE * noise, 0.02 * _magnitude(field[included], of))
    threshold = checks.number("threshold", threshold, 0.0)
    persistence, basin, into = _persistence(samples.one_ring, field, included)
    maxima = np.flatnonzero((persistence >= threshold) & (persistence > 0))
    if not border and samples.faces is not None:
        maxima = maxima[samples.one_ring.closed[maxima]]
    maxima = _separated(samples, maxima, field, radius)
    maxima = maxima[np.argsort(-persistence[maxima], kind="stable")]
    maxima = maxima if count is None else maxima[: checks.integer("count", count, 0)]
    frozen = checks.frozen
    return SalientPoints(
        vertices=frozen(maxima), points=frozen(samples.points[maxima]), values=frozen(field[maxima]),
        persistence=frozen(persistence[maxima]), basin=frozen(_basins(maxima, basin, into)), field=frozen(field),
        threshold=float(threshold), radius=float(radius),
    )  # fmt: skip


def _magnitude(field: Array, of: str | ArrayLike) -> float:
    """Return the largest magnitude of a field; of given values, whose zero is arbitrary, the range."""
    if not len(field):
        return 0.0
    return float(np.abs(field).max()) if isinstance(of, str) else float(np.ptp(field))


def _field(
    of: str | ArrayLike, samples: SampledSurface, diffusion: Diffusion, curvature: Curvature | None, width: float
) -> tuple[Array, float]:
    """Return the smoothed field, and the standard deviation of its noise."""
    if not isinstance(of, str):
        field = field_of(of, samples, curvature)
        return field, field_noise(diffusion, field)
    checks.choice("of", of, ("magnitude", "mean", "curvedness", "saliency"))
    known = known_curvature(samples, curvature)
    if of == "saliency":
        if width <= 0:
            raise ValueError(f"scale must be above 0 for saliency, which compares windows, not {width:g}")
        scales = [width * step for step in SCALE_STEPS]
        field = saliency(samples, curvature=known, scales=scales)
        return field, float(np.mean([scale * _median_noise(diffusion, known, scale) for scale in scales]))
    raw = field_of("mean" if of == "magnitude" else of, samples, known)
    field = diffusion.averaged(raw, width)
    return np.abs(field) if of == "magnitude" else field, _median_noise(diffusion, known, width)


def _median_noise(diffusion: Diffusion, known: Curvature, width: float) -> float:
    """Return the median standard deviation of the error of H after smoothing with a width."""
    if known.failed.all():
        return 0.0
    left = remaining_noise(diffusion, known, width) if width > 0 else 1.0
    return float(np.median((left * local_noise(diffusion, known))[~known.failed]))


def _persistence(ring: Neighborhoods, field: Array, included: Mask) -> tuple[Array, Indices, Indices]:
    """Return the persistence of each vertex, zero where it is no maximum; basins, and which others they merge into."""
    order = np.flatnonzero(included)
    order = order[np.argsort(-field[order], kind="stable")]
    basin, saddle, into = watersheds(ring.offsets, ring.members, field, order)
    is_maximum = (basin == np.arange(len(field))) & included
    return np.where(is_maximum, field - saddle, 0.0), basin, into


def _separated(samples: SampledSurface, maxima: Indices, field: Array, radius: float) -> Indices:
    """Return the maxima without a higher one within `radius`, in a ball connected by edges."""
    if radius <= 0 or len(maxima) < 2:
        return maxima
    order = maxima[np.argsort(-field[maxima], kind="stable")]
    near = samples.around(Ball(radius, connected=True), order)
    suppressed = np.zeros(len(field), bool)
    kept = []
    for row, vertex in enumerate(order):
        if not suppressed[vertex]:
            kept.append(vertex)
            suppressed[near[row]] = True
    return np.array(kept, np.int64)


def _basins(maxima: Indices, basin: Indices, into: Indices) -> Indices:
    """Return for each vertex the index in `maxima` of the maximum its basin merges into, -1 for none."""
    position = np.full(len(basin), -1, np.int64)
    position[maxima] = np.arange(len(maxima))
    target = np.where(basin >= 0, basin, 0)
    while (unresolved := (position[target] < 0) & (into[target] >= 0)).any():
        target = np.where(unresolved, into[target], target)
    return np.where(basin >= 0, position[target], -1)
