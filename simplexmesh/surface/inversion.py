"""Level lines of a field, and the lines on which curvature changes sign (Charton 2014, 1.1)."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh._vec import norm
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.diffusion import Diffusion
from simplexmesh.surface.field_noise import smallest_window
from simplexmesh.surface.fields import field_values, known_curvature
from simplexmesh.surface.samples import Samples, as_samples
from simplexmesh.surface.smoothed_curvature import shrunk, smoothed_curvature

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MIN_LENGTH = 5.0
"""Default of the least length of a line in windows."""


@dataclass(frozen=True, eq=False, repr=False)
class Polyline:
    """A polyline on a surface, with its points on edges.

    Attributes
    ----------
    points : (k, 3) array of float
        In order, higher values on the left seen from outside.
    edges : (k, 2) array of int
        Ends of the edge of each point.
    closed : bool
        Whether the last point is connected to the first.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ring = sm.torus(60, 24).triangulated("dual")
    >>> [line.closed for line in sm.level_lines(ring, ring.vertices[:, 2])]
    [True, True]
    """

    points: Array
    edges: Indices
    closed: bool

    def __repr__(self) -> str:
        return f"Polyline({len(self.points)} points, {'closed' if self.closed else 'open'}, length {self.length:.6g})"

    @property
    def length(self) -> float:
        """Length, in the surface's unit."""
        ends = np.concatenate([self.points, self.points[:1]]) if self.closed else self.points
        return float(norm(np.diff(ends, axis=0)).sum())


def level_lines(surface: Any, values: ArrayLike, *, level: float = 0.0, minimum: float = 0.0) -> list[Polyline]:
    """Return the level lines of a field, interpolated linearly between vertices, the longest first.

    Parameters
    ----------
    surface : TriangleMesh, array, PyVista or trimesh object, or path
        A surface of triangles; of a simplex mesh, its triangulation.
    values : (n,) array of float
        The field, NaN where unknown: lines end there.
    level : float
        Value of the field on the lines.
    minimum : float
        Leave out lines shorter than this, in the surface's unit of length.

    Returns
    -------
    list of Polyline
        Closed, or from border to border.

    Raises
    ------
    ValueError, TypeError
        Values of another length, a surface without triangles.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(20).triangulated("dual")
    >>> (line,) = sm.level_lines(ball, ball.vertices[:, 2], level=0.6)
    >>> round(line.length, 1)  # 2 pi 0.8
    5.0
    """
    samples = _with_faces(surface)
    field = field_values("values", values, len(samples.points))
    level = _check.number("level", level)
    minimum = _check.number("minimum", minimum, 0.0)
    lines = [_line(samples.points, field - level, chain, closed) for chain, closed in _chains(samples, field - level)]
    long = (line for line in lines if line.length > 0 and line.length >= minimum)  # one vertex is no line
    return sorted(long, key=lambda line: -line.length)


def inversion_lines(
    surface: Any,
    *,
    of: str = "mean",
    curvature: Curvature | None = None,
    scale: float | None = None,
    minimum: float | None = None,
) -> list[Polyline]:
    """Return the lines on which mean or Gaussian curvature changes sign, the longest first.

    Parameters
    ----------
    surface : TriangleMesh, array, PyVista or trimesh object, or path
        A surface of triangles.
    of : {"mean", "gauss"}
        H separates what bends outward from what bends inward, K elliptic from hyperbolic parts.
    curvature : Curvature, optional
        Curvature of the surface, if known; otherwise it is measured.
    scale : float, optional
        Width of the window over which it is smoothed first, in the surface's unit of length; 0 for none. By default it
        is shrunk as in `hk_classes`.
    minimum : float, optional
        Leave out lines shorter than this; by default 5 windows.

    Returns
    -------
    list of Polyline
        Higher values on the left.

    Raises
    ------
    ValueError, TypeError
        As `level_lines`.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> ring = sm.torus(90, 36, radius=1.0, tube_radius=0.35).triangulated("dual")
    >>> found = sm.inversion_lines(ring, of="gauss", curvature=sm.curvature(ring, "sine"), scale=0)
    >>> [bool(abs(np.hypot(*line.points[:, :2].T) - 1).max() < 0.05) for line in found]  # top and bottom
    [True, True]
    """
    samples = _with_faces(surface)
    known = known_curvature(samples, curvature)
    _check.choice("of", of, ("mean", "gauss"))
    diffusion = Diffusion(samples)
    width = None if scale is None else _check.number("scale", scale, 0.0)
    found = shrunk(diffusion, known)[0] if width is None else smoothed_curvature(diffusion, known, width)
    if minimum is None:
        minimum = MIN_LENGTH * (smallest_window(diffusion) if width is None else width)
    return level_lines(samples, found.mean if of == "mean" else found.gauss, minimum=minimum)


def _with_faces(surface: Any) -> Samples:
    samples = as_samples(surface)
    if samples.faces is None:
        raise TypeError("surface must have triangles to draw lines on; of a simplex mesh take mesh.triangulated()")
    return samples


def _chains(samples: Samples, field: Array) -> list[tuple[Indices, bool]]:
    """Return the lines as (k, 2) edges, the smaller vertex first, and whether each is closed.

    In each triangle the line enters through one edge and leaves through another with the higher side on its left;
    zero counts as higher.
    """
    faces = samples.faces
    assert faces is not None
    n = len(field)
    is_high = field >= 0
    crossed = np.isfinite(field[faces]).all(axis=1) & (is_high[faces].any(axis=1) != is_high[faces].all(axis=1))
    a, b, c = (faces[crossed, j] for j in range(3))
    next_edges: dict[int, list[int]] = {}  # several where more than two triangles share an edge, or disagree in side
    ends: Counter[int] = Counter()
    for triangle in zip(a.tolist(), b.tolist(), c.tolist(), strict=True):
        # it enters through the edge that leads from high to low, counter-clockwise
        for j in range(3):
            one, other = triangle[j], triangle[(j + 1) % 3]
            if is_high[one] != is_high[other]:
                key = min(one, other) * n + max(one, other)
                if is_high[one]:
                    entry = key
                else:
                    exit_ = key
        next_edges.setdefault(entry, []).append(exit_)
        ends[exit_] += 1
    every = [key for key, exits in next_edges.items() for _ in exits]
    starts = [key for key, exits in next_edges.items() for _ in range(len(exits) - ends[key])]
    out = []
    for begin in [*starts, *every]:
        if not next_edges[begin]:
            continue
        chain, key = [begin], begin
        while next_edges.get(key):
            key = next_edges[key].pop(0)
            chain.append(key)
            if key == begin:
                break
        closed = chain[-1] == begin
        keys = np.array(chain[:-1] if closed else chain)
        out.append((np.stack([keys // n, keys % n], axis=1), closed))
    return out


def _line(points: Array, field: Array, edges: Indices, closed: bool) -> Polyline:  # noqa: FBT001
    first, second = field[edges[:, 0]], field[edges[:, 1]]
    share = np.divide(first, first - second, out=np.full(len(first), 0.5), where=first != second)[:, None]
    at = points[edges[:, 0]] * (1 - share) + points[edges[:, 1]] * share
    return Polyline(_check.frozen(at), _check.frozen(edges, np.int64), closed)
