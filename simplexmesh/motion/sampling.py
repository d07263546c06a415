"""What a start around the data must know of it: points and normals on it, and, where it says so, its genus."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._vec import norm, normalized
from simplexmesh.errors import TopologyError
from simplexmesh.motion.subjects import Subject, TrianglesSubject, VolumeSubject
from simplexmesh.motion.walls import MOST, Walls
from simplexmesh.motion.wrap import Samples

MOST_SAMPLES = 20_000

WIDE = 0.05
"""In diagonals of the data: it is open when a border of it is wider."""


def closed_samples(subject: Subject) -> Samples | None:
    """Return points with normals on the surface that a subject describes, None when that surface has a border.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.motion.subjects import as_subject
    >>> choices = {"level": None, "label": None, "inside": "above", "components": "largest"}
    >>> whole = as_subject(sm.sphere(16).vertices, **choices)
    >>> bool(len(closed_samples(whole).points) > 3000)
    True
    >>> half = as_subject(whole.points[whole.points[:, 2] > 0], **choices)
    >>> closed_samples(half) is None
    True
    """
    from simplexmesh.motion.targets.points import Points

    border = getattr(subject.target, "border", None)
    diagonal = float(norm(np.ptp(subject.points, axis=0)))
    if border is not None and len(border.wider(WIDE * diagonal)):
        return None
    if isinstance(subject, TrianglesSubject):
        cloud = subject.sampled
        assert cloud.normals is not None
        genus = known_genus(subject)
        samples = Samples(cloud.points, cloud.normals, oriented=True, genus=genus, walls=known_walls(subject, genus))
        return _thinned(samples)
    if isinstance(subject, VolumeSubject):
        return _of_volume(subject)
    target = subject.target if hasattr(subject.target, "samples") else Points(subject.points)
    points, normals = target.samples()
    if not normals.any(axis=1).all():  # a surfel without a direction looks to its nearest neighbor that has one
        known = np.flatnonzero(normals.any(axis=1))
        normals = normals[known[cKDTree(points[known]).query(points)[1]]]
    return _thinned(Samples(points, normals, bool(target.surfels.oriented)))  # type: ignore[attr-defined]


def _of_volume(subject: VolumeSubject) -> Samples:
    """Return the points where grid lines leave the object, and normals down the gradient there."""
    from scipy.ndimage import map_coordinates

    thin = _thinned(Samples(subject.points, np.zeros_like(subject.points), oriented=True))
    values = subject.volume.values.astype(np.float32, copy=False)
    step = float(np.max(subject.volume.spacing))
    slope = np.zeros_like(thin.points)
    for axis in range(3):
        for sign in (1.0, -1.0):
            places = thin.points.copy()
            places[:, axis] += sign * step
            index = subject.volume.to_index(places)
            slope[:, axis] += sign * map_coordinates(values, index.T, order=1, mode="nearest")
    outward = -slope if subject.inside == "above" else slope
    known = norm(outward) > 0
    return Samples(thin.points[known], normalized(outward[known]), oriented=True)


def known_genus(subject: Subject) -> int | None:
    """Return how many handles the data has, None when it does not say: only closed triangles in one piece do."""
    if not isinstance(subject, TrianglesSubject):
        return None
    topology = subject.triangles.topology
    return None if topology.n_components > 1 or topology.n_borders else int(topology.genus)


def known_walls(subject: TrianglesSubject, genus: int | None) -> Walls | None:
    """Return what tells the tunnels of closed triangles, None when there are none, some are knotted, or too many."""
    surface = subject.triangles
    if not genus or 3 * genus * surface.n_faces > MOST:
        return None
    try:
        walls = Walls(surface.vertices, surface.faces)
    except TopologyError:  # vertices that two sheets share
        return None
    return walls if len(walls.tunnels) == genus else None


def _thinned(samples: Samples) -> Samples:
    """Return no more samples than needed, the same every time."""
    n = len(samples.points)
    if n <= MOST_SAMPLES:
        return samples
    rows = np.random.default_rng(0).choice(n, MOST_SAMPLES, replace=False)
    return replace(samples, points=samples.points[rows], normals=samples.normals[rows])
