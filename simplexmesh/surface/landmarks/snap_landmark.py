"""Landmarks: picks snapped to the nearby maximum of a property of the surface (Charton 2014, 5.2.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import dijkstra

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.landmarks.junctions import junctions
from simplexmesh.surface.saliency.diffusion import Diffusion
from simplexmesh.surface.saliency.fields import field_values, known_curvature
from simplexmesh.surface.saliency.noise import smallest_window
from simplexmesh.surface.saliency.smoothed_curvature import smoothed_curvature
from simplexmesh.surface.sampled_surface import SampledSurface, as_sampled_surface

CRITERIA = ("peak", "pit", "ridge", "valley", "saddle", "magnitude", "curvedness", "junction")

MIN_DEPTH = 0.25
"""Least strength of a groove at a junction, as a share of the strongest nearby."""


@dataclass(frozen=True, eq=False, repr=False)
class Landmark:
    """A reproducible place on a surface, the same for all picks near it.

    Attributes
    ----------
    vertex : int
        Its vertex.
    point : (3,) array of float
    value : float
        Value of the criterion there.
    moved : float
        Distance along edges from the vertex nearest to the pick.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 1, 1), 20).triangulated("dual")
    >>> found = sm.snap_landmark(egg, [2.7, 0.3, 0.2], egg.vertices[:, 0], radius=0.8)
    >>> bool(found.value > 2.99), bool(0.3 < found.moved < 0.8)
    (True, True)
    """

    vertex: int
    point: Array
    value: float
    moved: float

    def __repr__(self) -> str:
        at = ", ".join(f"{x:.6g}" for x in self.point)
        return f"Landmark(vertex {self.vertex} at ({at}), value {self.value:.4g}, moved {self.moved:.4g})"


def snap_landmark(
    surface: Any,
    pick: int | ArrayLike,
    criterion: str | ArrayLike = "magnitude",
    *,
    radius: float,
    curvature: Curvature | None = None,
    scale: float | None = None,
) -> Landmark:
    """Return the vertex with the highest value of a property of the surface within a distance from a pick.

    Different picks near the same place give the same landmark.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        The surface.
    pick : int or (3,) array of float
        A vertex, or a point no farther from the surface than `radius`.
    criterion : str or (n,) array of float
        The property: "peak" (k2; cusps are peaks, and so is the gonion, where a border bends), "pit" (-k1), "ridge"
        (k1), "valley" (-k2), "saddle" (-K), "magnitude" (abs(H)), "curvedness", "junction" (where three grooves or more
        meet, as sutures at the pterion: -k2 of the third strongest over half the radius), or given values, NaN where
        unknown.
    radius : float
        Largest distance of the landmark from the pick along the surface, in its unit of length.
    curvature : Curvature, optional
        Curvature of the surface, if known; otherwise it is measured.
    scale : float, optional
        Width of the window over which the property is smoothed first, in the surface's unit of length; 0 for none. By
        default the smallest of `saliency`'s, but at most a third of the radius.

    Returns
    -------
    Landmark

    Raises
    ------
    ValueError
        A pick out of range or farther than `radius` from the surface, an unknown criterion or one unknown at all
        vertices near the pick, no junction there.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 1, 1), 20).triangulated("dual")
    >>> curved = sm.curvature(egg, "sine", neighborhood=sm.rings(2))
    >>> sm.snap_landmark(egg, [2.7, 0.3, 0.2], "peak", radius=0.8, curvature=curved).point.round(1).tolist()
    [3.0, 0.0, 0.0]
    """
    samples = as_sampled_surface(surface)
    radius = checks.number("radius", radius, 0.0, open_low=True)
    start = picked_vertex(samples, pick, radius)
    near, distances = geodesic_ball(samples, start, radius)
    diffusion = Diffusion(samples)
    width = min(smallest_window(diffusion), radius / 3) if scale is None else checks.number("scale", scale, 0.0)
    if isinstance(criterion, str) and criterion == "junction":
        field = _junction_strengths(samples, diffusion, known_curvature(samples, curvature), width, near, radius)
    else:
        field = _field(criterion, samples, diffusion, curvature, width)
    known = np.isfinite(field[near])
    if not known.any():
        raise ValueError(f"criterion must be known somewhere within {radius:g} of the pick, it is nowhere")
    near, distances = near[known], distances[known]
    best = int(np.lexsort((distances, -field[near]))[0])
    vertex = int(near[best])
    return Landmark(vertex, checks.frozen(samples.points[vertex]), float(field[vertex]), float(distances[best]))


def picked_vertex(samples: SampledSurface, pick: int | ArrayLike, radius: float) -> int:
    """Return the picked vertex, given by its index or by a point near it."""
    if np.ndim(pick) == 0:
        return int(checks.indices("pick", np.atleast_1d(pick), (1,), len(samples.points))[0])
    point = checks.array("pick", pick, (3,))
    distance, vertex = samples.tree.query(point)
    if distance > radius:
        raise ValueError(f"pick must be within the radius {radius:g} of the surface, not {distance:.4g} away")
    return int(vertex)


def geodesic_ball(samples: SampledSurface, start: int, radius: float) -> tuple[Indices, Array]:
    """Return the vertices within a distance along the edges, and their distances."""
    distances = dijkstra(samples.edges, directed=False, indices=start, limit=radius)
    near = np.flatnonzero(np.isfinite(distances))
    return near, distances[near]


def _field(
    criterion: str | ArrayLike, samples: SampledSurface, diffusion: Diffusion, curvature: Curvature | None, width: float
) -> Array:
    """Return the criterion's field; H and K are smoothed before their magnitude is taken, which is biased by noise."""
    if not isinstance(criterion, str):
        return field_values("criterion", criterion, len(samples.points))
    checks.choice("criterion", criterion, CRITERIA)
    known = known_curvature(samples, curvature)
    if criterion in ("magnitude", "saddle"):
        found = smoothed_curvature(diffusion, known, width)
        return np.abs(found.mean) if criterion == "magnitude" else -found.gauss
    k1, k2 = known.k1, known.k2
    field = {"peak": k2, "pit": -k1, "ridge": k1, "valley": -k2, "curvedness": known.curvedness}[criterion]
    return diffusion.averaged(field, width)


def _junction_strengths(
    samples: SampledSurface, diffusion: Diffusion, known: Curvature, width: float, near: Indices, radius: float
) -> Array:
    """Return the strength of the junction at each vertex of `near`, NaN elsewhere."""
    strength = diffusion.averaged(np.maximum(-np.nan_to_num(known.k2), 0.0), width)
    field = np.full(len(samples.points), np.nan)
    field[near] = 0.0
    candidates = near[strength[near] >= MIN_DEPTH * strength[near].max()]
    field[candidates] = junctions(samples, strength, np.nan_to_num(known.normals), candidates, radius / 2)
    if not field[near].any():
        raise ValueError(f"pick must have a junction of three grooves within {radius:g}, it has none")
    return field
