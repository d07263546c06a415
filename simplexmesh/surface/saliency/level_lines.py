"""Level lines of a field, and the lines on which curvature changes sign (Charton 2014, 1.1)."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.polyline import Polyline
from simplexmesh.surface.saliency.diffusion import Diffusion
from simplexmesh.surface.saliency.fields import field_values, known_curvature
from simplexmesh.surface.saliency.noise import smallest_window
from simplexmesh.surface.saliency.smoothed_curvature import shrunk, smoothed_curvature
from simplexmesh.surface.sampled_surface import SampledSurface, as_sampled_surface


def level_lines(surface: Any, values: ArrayLike, *, level: float = 0.0, minimum: float = 0.0) -> tuple[Polyline, ...]:
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
    tuple of Polyline
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
    level = checks.number("level", level)
    minimum = checks.number("minimum", minimum, 0.0)
    lines = [_line(samples.points, field - level, chain, closed) for chain, closed in _chains(samples, field - level)]
    long = (line for line in lines if line.length > 0 and line.length >= minimum)  # one vertex is no line
    return tuple(sorted(long, key=lambda line: -line.length))


def inversion_lines(
    surface: Any,
    *,
    of: str = "mean",
    curvature: Curvature | None = None,
    scale: float | None = None,
    minimum: float | None = None,
) -> tuple[Polyline, ...]:
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
    tuple of Polyline
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
    checks.choice("of", of, ("mean", "gauss"))
    diffusion = Diffusion(samples)
    width = None if scale is None else checks.number("scale", scale, 0.0)
    found = shrunk(diffusion, known)[0] if width is None else smoothed_curvature(diffusion, known, width)
    if minimum is None:
        minimum = 5 * (smallest_window(diffusion) if width is None else width)
    return level_lines(samples, found.mean if of == "mean" else found.gauss, minimum=minimum)


def _with_faces(surface: Any) -> SampledSurface:
    samples = as_sampled_surface(surface)
    if samples.faces is None:
        raise TypeError("surface must have triangles to draw lines on; of a simplex mesh take mesh.triangulated()")
    return samples


def _chains(samples: SampledSurface, field: Array) -> list[tuple[Indices, bool]]:
    """Return the lines as (k, 2) edges, the smaller vertex first, and whether each is closed."""
    faces = samples.faces
    assert faces is not None
    n, is_high = len(field), field >= 0
    faces = faces[np.isfinite(field[faces]).all(axis=1)]
    faces = faces[is_high[faces].any(axis=1) != is_high[faces].all(axis=1)]
    ahead = np.roll(faces, -1, axis=1)
    keys = np.minimum(faces, ahead) * n + np.maximum(faces, ahead)
    # a line enters a triangle through one edge and leaves it through another, the higher side, zero too, on its left
    entries, exits_ = keys[is_high[faces] & ~is_high[ahead]].tolist(), keys[~is_high[faces] & is_high[ahead]].tolist()
    next_edges: dict[int, list[int]] = {}  # several where more than two triangles share an edge, or disagree in side
    for entry, exit_ in zip(entries, exits_, strict=True):
        next_edges.setdefault(entry, []).append(exit_)
    ends = Counter(exits_)
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
    return Polyline(checks.frozen(at), checks.frozen(edges, np.int64), closed)
