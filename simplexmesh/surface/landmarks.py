"""Landmarks: a pick moved to where a property of the surface is best nearby (Charton 2014, 5.2.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from simplexmesh import _check
from simplexmesh._vec import norm
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.diffusion import Diffusion
from simplexmesh.surface.field_noise import smallest_window
from simplexmesh.surface.fields import field_values, known_curvature
from simplexmesh.surface.junctions import junctions
from simplexmesh.surface.samples import Samples, as_samples
from simplexmesh.surface.smoothed_curvature import smoothed_curvature

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CRITERIA = ("peak", "pit", "ridge", "valley", "saddle", "magnitude", "curvedness", "junction")

FAINTEST = 0.25
"""Junctions are looked for where a groove has at least this share of the strength of the strongest nearby."""


@dataclass(frozen=True, eq=False, repr=False)
class Landmark:
    """A place on a surface that anyone who picks near it is led to.

    Attributes
    ----------
    vertex : int
        Where it is.
    point : (3,) array of float
    value : float
        Of the criterion there.
    moved : float
        How far it is from the pick along the edges, from the vertex nearest to the pick on.

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
    """Return the vertex at which a property of the surface is highest within a distance from a pick.

    Several people who pick about the same place get the same landmark.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        What is picked on.
    pick : int or (3,) array of float
        A vertex, or a point no farther from the surface than `radius`.
    criterion : str or (n,) array of float
        What is highest: "peak" and "pit" (the smaller bend of a dome outward, or of a hollow inward: min of k1, k2, or
        of -k1, -k2; cusps are peaks, and so is the gonion, where a border bends), "ridge" and "valley" (k1, or -k2),
        "saddle" (-K), "magnitude" (abs(H)), "curvedness", "junction" (where three grooves or more meet, as sutures at
        the pterion: -k2 of the third strongest over half the radius), or numbers of the caller's, NaN where unknown.
    radius : float
        How far the landmark may be from the pick along the surface, in its unit of length.
    curvature : Curvature, optional
        Of the surface, when already known; otherwise it is measured.
    scale : float, optional
        Width of the window over which the property is averaged first, in the surface's unit of length; 0 for none. By
        default the smallest of `saliency`'s, no more than a third of the radius.

    Returns
    -------
    Landmark

    Raises
    ------
    ValueError
        A pick beyond the surface or farther than `radius` from it, an unknown criterion, nothing known nearby, no
        junction there.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> egg = sm.ellipsoid((3, 1, 1), 20).triangulated("dual")
    >>> curved = sm.curvature(egg, "sine", neighborhood=sm.rings(2))
    >>> sm.snap_landmark(egg, [2.7, 0.3, 0.2], "peak", radius=0.8, curvature=curved).point.round(1).tolist()
    [3.0, 0.0, 0.0]
    """
    samples = as_samples(surface)
    radius = _check.number("radius", radius, 0.0, open_low=True)
    start = picked(samples, pick, radius)
    near, away = within(samples, start, radius)
    diffusion = Diffusion(samples)
    width = min(smallest_window(diffusion), radius / 3) if scale is None else _check.number("scale", scale, 0.0)
    if isinstance(criterion, str) and criterion == "junction":
        field = _meeting(samples, diffusion, known_curvature(samples, curvature), width, near, radius)
    else:
        field = _field(criterion, samples, diffusion, curvature, width)
    known = np.isfinite(field[near])
    if not known.any():
        raise ValueError(f"criterion must be known somewhere within {radius:g} of the pick, it is nowhere")
    near, away = near[known], away[known]
    best = int(np.lexsort((away, -field[near]))[0])
    vertex = int(near[best])
    return Landmark(vertex, _check.frozen(samples.points[vertex]), float(field[vertex]), float(away[best]))


def picked(samples: Samples, pick: int | ArrayLike, radius: float) -> int:
    """Return the vertex a caller means, given by its number or by a point near it."""
    if np.ndim(pick) == 0:
        return int(_check.indices("pick", np.atleast_1d(pick), (1,), len(samples.points))[0])
    point = _check.array("pick", pick, (3,))
    away, vertex = samples.tree.query(point)
    if away > radius:
        raise ValueError(f"pick must be within the radius {radius:g} of the surface, not {away:.4g} away")
    return int(vertex)


def within(samples: Samples, start: int, radius: float) -> tuple[Indices, Array]:
    """Return the vertices within a distance along the edges, and their distances."""
    ring, n = samples.one_ring, len(samples.points)
    ends = np.repeat(ring.centers, ring.valence)
    lengths = norm(samples.points[ring.members] - samples.points[ends])
    links = csr_matrix((np.maximum(lengths, 1e-300), ring.members, ring.offsets), (n, n))
    away = dijkstra(links, directed=False, indices=start, limit=radius)
    near = np.flatnonzero(np.isfinite(away))
    return near, away[near]


def _field(
    criterion: str | ArrayLike, samples: Samples, diffusion: Diffusion, curvature: Curvature | None, width: float
) -> Array:
    """Return what is highest at a landmark; H and K are averaged before their size is taken, as noise has none then."""
    if not isinstance(criterion, str):
        return field_values("criterion", criterion, len(samples.points))
    _check.choice("criterion", criterion, CRITERIA)
    known = known_curvature(samples, curvature)
    if criterion in ("magnitude", "saddle"):
        found = smoothed_curvature(diffusion, known, width)
        return np.abs(found.mean) if criterion == "magnitude" else -found.gauss
    fields = {
        "peak": known.k2,
        "pit": -known.k1,
        "ridge": known.k1,
        "valley": -known.k2,
        "curvedness": known.curvedness,
    }
    field = fields[criterion]
    return np.where(np.isfinite(field), diffusion.smoothed(field, width), np.nan) if width > 0 else field


def _meeting(
    samples: Samples, diffusion: Diffusion, known: Curvature, width: float, near: Indices, radius: float
) -> Array:
    """Return how strong a junction of grooves each vertex near is; elsewhere it is not known."""
    groove = np.where(np.isfinite(known.k2), np.maximum(-known.k2, 0.0), 0.0)
    strength = diffusion.smoothed(groove, width) if width > 0 else groove
    field = np.full(len(samples.points), np.nan)
    field[near] = 0.0
    deep = near[strength[near] >= FAINTEST * strength[near].max()]
    field[deep] = junctions(samples, strength, np.nan_to_num(known.normals), deep, radius / 2)
    if not field[near].any():
        raise ValueError(f"pick must have a place within {radius:g} where three grooves meet, it has none")
    return field
