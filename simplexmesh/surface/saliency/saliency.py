"""Mesh saliency: difference of curvature to its surroundings at several scales (Lee, Varshney, Jacobs 2005)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.saliency._kernels_watersheds import watersheds
from simplexmesh.surface.saliency.diffusion import Diffusion
from simplexmesh.surface.saliency.fields import field_of
from simplexmesh.surface.saliency.noise import smallest_window
from simplexmesh.surface.sampled_surface import SampledSurface, as_sampled_surface

SCALE_STEPS = (1.0, 1.5, 2.0, 2.5, 3.0)
"""Scales as multiples of the smallest: 2, 3, 4, 5 and 6 epsilon."""

LEAST_EDGES = 0.1
"""Least scale in mean edges; the largest is the diagonal."""


def saliency(
    surface: Any,
    *,
    curvature: Curvature | None = None,
    scales: Sequence[float] | None = None,
    of: str | ArrayLike = "mean",
) -> Array:
    """Return the saliency of each vertex, the difference of curvature to its surroundings: an angle, in radians.

    At each scale s the curvature smoothed with width s is compared with that smoothed with 2 s; s times the difference
    is about the angle by which the surface turns more there than around. Scales are averaged with the weights
    (1 - mean of maxima / largest maximum)^2 (Itti and others 1998), which favor maps with few high maxima. Bumps, tips
    and pits are salient; parts of uniform curvature or roughness are not. Saliency is invariant to scaling.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        The surface.
    curvature : Curvature, optional
        Curvature of the surface, if known; otherwise it is measured.
    scales : sequence of float, optional
        Widths (standard deviations) of the inner windows, in the surface's unit of length. By default 1, 1.5, 2, 2.5
        and 3 times 0.6 % of the bounding box's diagonal or 1.5 edges, whichever is more.
    of : {"mean", "magnitude", "curvedness"} or (n,) array of float
        The field: H, abs(H), curvedness, or given values, NaN where unknown.

    Returns
    -------
    (n,) array of float
        At least 0; NaN on connected components where the field is nowhere known.

    Raises
    ------
    ValueError, TypeError
        Not a surface, scales below a tenth of an edge or above the diagonal, a curvature of another surface.

    References
    ----------
    C. H. Lee, A. Varshney, D. W. Jacobs, *Mesh saliency*, SIGGRAPH 2005; L. Itti, C. Koch, E. Niebur, *A model of
    saliency-based visual attention*, PAMI 1998 (the weights). Windows follow the surface, by diffusion, so that they
    exclude the other side of a thin wall.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> ball = sm.sphere(16).triangulated("dual")
    >>> bump = 0.1 * np.exp(-((ball.vertices - [0, 0, 1]) ** 2).sum(axis=1) / (2 * 0.15**2))
    >>> bumpy = sm.TriangleMesh(ball.vertices * (1 + bump)[:, None], ball.faces)
    >>> found = sm.saliency(bumpy, curvature=sm.curvature(bumpy, "sine"))
    >>> bool(bumpy.vertices[found.argmax()][2] > 1.05)
    True
    """
    samples = as_sampled_surface(surface)
    diffusion = Diffusion(samples)
    field = field_of(of, samples, curvature)
    widths = _widths(scales, diffusion)
    levels = np.unique(np.concatenate([widths, 2 * widths]))
    means = dict(zip(levels, diffusion.at_scales(field, list(levels)), strict=True))
    total, weights = np.zeros(len(field)), 0.0
    for width in widths:
        response = width * np.abs(means[width] - means[2 * width])
        weight = map_weight(samples, response)
        total += weight * response
        weights += weight
    out = total / weights if weights > 0 else total
    parts = samples.components
    return np.where(np.isin(parts, parts[np.isfinite(field)]), out, np.nan)


def map_weight(samples: SampledSurface, response: Array) -> float:
    """Return the weight of a map: near 1 if one maximum is far above the others, near 0 if all are similar."""
    ring = samples.one_ring
    order = np.argsort(-response, kind="stable")
    basin, _, _ = watersheds(ring.offsets, ring.members, response, order)
    tops = response[(basin == np.arange(len(basin))) & (ring.valence > 0)]
    highest = float(tops.max(initial=0.0))
    return float((1 - tops.mean() / highest) ** 2) if highest > 0 and len(tops) > 1 else float(highest > 0)


def _widths(scales: Sequence[float] | None, diffusion: Diffusion) -> Array:
    if scales is None:
        return smallest_window(diffusion) * np.array(SCALE_STEPS)
    given = checks.array("scales", scales, (None,))
    if not len(given) or not (given > 0).all():
        raise ValueError(f"scales must be at least one length above 0, not {given.tolist()}")
    low, high = LEAST_EDGES * diffusion.spacing, diffusion.diagonal
    if given.min() < low or given.max() > high:
        raise ValueError(
            f"scales must be from {low:.3g}, below which nothing is averaged, to {high:.3g}, not {given.tolist()}"
        )
    return np.unique(given)
