"""Salient points: where curvature, or saliency, is highest, less what noise would have made (Charton 2014, 1.3.3)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.surface._kernels_maxima import watersheds
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.diffusion import Diffusion
from simplexmesh.surface.field_noise import field_noise, local_noise, remaining_noise, smallest_window
from simplexmesh.surface.fields import known_curvature
from simplexmesh.surface.neighborhoods import Ball, Neighborhoods
from simplexmesh.surface.saliency import STEPS, field_of, saliency
from simplexmesh.surface.samples import Samples, as_samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CERTAIN = 4.0
"""A maximum counts from so many standard deviations of the noise that is left in the field."""

APART = 3.0
"""Points are at least so many windows apart."""

FAINT = 0.02
"""Nor does one count that rises by less than this share of the largest value."""


@dataclass(frozen=True, eq=False, repr=False)
class SalientPoints:
    """Points of a surface that stand out, the most persistent first.

    Attributes
    ----------
    vertices : (m,) array of int
        Where they are.
    points : (m, 3) array of float
    values : (m,) array of float
        Of the field there.
    persistence : (m,) array of float
        How far one must go down from each to reach a higher one, in the field's unit; of the highest of a piece of
        surface, to its lowest.
    basin : (n,) array of int
        Which of them, by its place in this list, each vertex of the surface leads up to; -1 for none.
    field : (n,) array of float
        In which maxima were looked for.
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

    The field is averaged over a small window, and its maxima are found on the edges. As the water falls from the
    highest to the lowest each basin grows until it meets that of a higher maximum: the drop to there is its
    persistence. Kept are those which noise would not have made, and of two that are near each other the higher.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        What is looked at.
    of : {"magnitude", "mean", "curvedness", "saliency"} or (n,) array of float
        The field: abs(H), H (tips only), curvedness, `saliency`, or numbers of the caller's, NaN where unknown, which
        are taken as they are.
    curvature : Curvature, optional
        Of the surface, when already known; otherwise it is measured.
    scale : float, optional
        Width of the window, in the surface's unit of length; 0 for none. By default the smallest of `saliency`'s. With
        saliency that of its smallest window; numbers of the caller's are not averaged.
    radius : float, optional
        The least distance between two points, in the surface's unit of length. By default 3 windows.
    threshold : float, optional
        The least persistence, in the field's unit: 1 / length, radians for saliency. By default 4 times the noise left
        in the field, which is the curvature's own error or, where that is unknown, its field_noise from vertex to
        vertex, less what averaging takes where neighborhoods differ; and 2 % of the largest value.
    count : int, optional
        Keep no more than so many, the most persistent.
    border : bool
        Whether vertices on a border, where curvature is least certain, may be among them.

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
    >>> sm.salient_points(egg, curvature=curved, count=2).points.round(1)[:, 0].tolist()
    [-3.0, 3.0]
    """
    samples = as_samples(surface)
    diffusion = Diffusion(samples)
    width = smallest_window(diffusion) if scale is None else _check.number("scale", scale, 0.0)
    field, noise = _field(of, samples, diffusion, curvature, width)
    radius = APART * width if radius is None else _check.number("radius", radius, 0.0)
    counted = np.isfinite(field) & (samples.one_ring.valence > 0)
    if threshold is None:
        threshold = max(CERTAIN * noise, FAINT * _size(field[counted], of))
    threshold = _check.number("threshold", threshold, 0.0)
    persistence, basin, into = _persistence(samples.one_ring, field, counted)
    tops = np.flatnonzero((persistence >= threshold) & (persistence > 0))
    if not border and samples.faces is not None:
        tops = tops[samples.one_ring.closed[tops]]
    tops = _apart(samples, tops, field, radius)
    tops = tops[np.argsort(-persistence[tops], kind="stable")]
    tops = tops if count is None else tops[: _check.integer("count", count, 0)]
    frozen = _check.frozen
    return SalientPoints(
        vertices=frozen(tops), points=frozen(samples.points[tops]), values=frozen(field[tops]),
        persistence=frozen(persistence[tops]), basin=frozen(_basins(tops, basin, into)), field=frozen(field),
        threshold=float(threshold), radius=float(radius),
    )  # fmt: skip


def _size(field: Array, of: str | ArrayLike) -> float:
    """Return how large a field is: its largest value, or the range of numbers that may begin anywhere."""
    if not len(field):
        return 0.0
    return float(np.abs(field).max()) if isinstance(of, str) else float(np.ptp(field))


def _field(
    of: str | ArrayLike, samples: Samples, diffusion: Diffusion, curvature: Curvature | None, width: float
) -> tuple[Array, float]:
    """Return the field whose maxima are looked for, and the noise left in it."""
    if not isinstance(of, str):
        field = field_of(of, samples, curvature)
        return field, field_noise(diffusion, field)
    _check.choice("of", of, ("magnitude", "mean", "curvedness", "saliency"))
    known = known_curvature(samples, curvature)
    if of == "saliency":
        if width <= 0:
            raise ValueError(f"scale must be above 0 for saliency, which compares windows, not {width:g}")
        scales = [width * step for step in STEPS]
        field = saliency(samples, curvature=known, scales=scales)
        return field, float(np.mean([scale * _noise(diffusion, known, scale) for scale in scales]))
    raw = field_of("mean" if of == "magnitude" else of, samples, known)
    field = np.where(np.isfinite(raw), diffusion.smoothed(raw, width), np.nan) if width > 0 else raw
    return np.abs(field) if of == "magnitude" else field, _noise(diffusion, known, width)


def _noise(diffusion: Diffusion, known: Curvature, width: float) -> float:
    """Return the middle deviation of the error that is left of H in windows of a width."""
    if known.failed.all():
        return 0.0
    left = remaining_noise(diffusion, known, width) if width > 0 else 1.0
    return float(np.median((left * local_noise(diffusion, known))[~known.failed]))


def _persistence(ring: Neighborhoods, field: Array, counted: NDArray[np.bool_]) -> tuple[Array, Indices, Indices]:
    """Return the persistence of each vertex, zero where it is no maximum; basins, and what they join."""
    order = np.flatnonzero(counted)
    order = order[np.argsort(-field[order], kind="stable")]
    basin, saddle, into = watersheds(ring.offsets, ring.members, field, order)
    top = (basin == np.arange(len(field))) & counted
    return np.where(top, np.where(top, field, 0.0) - np.where(top, saddle, 0.0), 0.0), basin, into


def _apart(samples: Samples, tops: Indices, field: Array, radius: float) -> Indices:
    """Return those that no higher one is near to, where near is within a ball that edges do not leave."""
    if radius <= 0 or len(tops) < 2:
        return tops
    order = tops[np.argsort(-field[tops], kind="stable")]
    near = samples.around(Ball(radius, connected=True), order)
    gone = np.zeros(len(field), bool)
    kept = []
    for row, vertex in enumerate(order):
        if not gone[vertex]:
            kept.append(vertex)
            gone[near[row]] = True
    return np.array(kept, np.int64)


def _basins(tops: Indices, basin: Indices, into: Indices) -> Indices:
    """Return for each vertex the place in `tops` of the maximum its basin ends up with, -1 for none."""
    place = np.full(len(basin), -1, np.int64)
    place[tops] = np.arange(len(tops))
    goal = np.where(basin >= 0, basin, 0)
    for _ in range(len(basin)):
        onward = (place[goal] < 0) & (into[goal] >= 0)
        if not onward.any():
            break
        goal = np.where(onward, into[goal], goal)
    return np.where(basin >= 0, place[goal], -1)
