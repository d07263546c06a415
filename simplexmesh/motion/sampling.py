"""What a start around the data must know of it: points and normals on it, and, where it says so, its genus."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import dot, norm, normalized
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.errors import TopologyError
from simplexmesh.motion.shell import FEW, Shell, shell_of
from simplexmesh.motion.subjects import LabelSubject, PointsSubject, Subject, TrianglesSubject, VolumeSubject
from simplexmesh.motion.walls import MOST, Walls
from simplexmesh.motion.wrap import Samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MOST_SAMPLES = 20_000

WIDE = 0.05
"""In diagonals of the data: it is open when a border of it is wider."""


FILLED = 0.5
"""In radii of the balls that bridge the gaps between points: points are added farther than that from any."""


def closed_samples(subject: Subject, vertices: int = 4000, tunnels: float | None = None) -> Samples | None:
    """Return points with normals on the surface that a subject describes, None when that surface has a border.

    Parameters
    ----------
    subject : Subject
    vertices : int
        How many the model may have: the tunnels of a volume are those that its automatic start with so many keeps.
    tunnels : float, optional
        Narrower ones are left out, in the data's unit; only of volumes.

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
        surface = subject.triangles.vertices, subject.triangles.faces
        walls = known_walls(*surface, genus)
        return _thinned(Samples(cloud.points, cloud.normals, oriented=True, genus=genus, walls=walls))
    if isinstance(subject, VolumeSubject):
        return _knowing(_of_volume(subject), subject, vertices, tunnels)
    target = subject.target if hasattr(subject.target, "samples") else Points(subject.points)
    points, normals = target.samples()
    if not normals.any(axis=1).all():  # a surfel without a direction looks to its nearest neighbor that has one
        known = np.flatnonzero(normals.any(axis=1))
        normals = normals[known[cKDTree(points[known]).query(points)[1]]]
    samples = _thinned(Samples(points, normals, bool(target.surfels.oriented)))  # type: ignore[attr-defined]
    if isinstance(subject, LabelSubject):
        return _knowing(samples, subject, vertices, tunnels)
    shell = shell_of(subject.points) if isinstance(subject, PointsSubject) else None
    return samples if shell is None else _filled(samples, subject.points, shell)


def _knowing(samples: Samples, subject: VolumeSubject | LabelSubject, vertices: int, tunnels: float | None) -> Samples:
    """Return the samples with the tunnels of a volume that its automatic start keeps."""
    try:
        start = subject.start(vertices, tunnels).mesh
    except TopologyError:  # nothing of it is thick enough for so few vertices
        return samples
    if start.n_components > 1 or start.n_holes:
        return samples
    surface = start.triangulated()
    return replace(samples, genus=start.genus, walls=known_walls(surface.vertices, surface.faces, start.genus))


def _filled(samples: Samples, points: Array, shell: Shell) -> Samples:
    """Return the samples with the tunnels that points show, and with gaps between them filled.

    Few points are left to the surface through them altogether.
    """
    from simplexmesh.motion.targets.triangles import Triangles

    surface = TriangleMesh(shell.vertices, shell.faces)
    walls = known_walls(shell.around, shell.faces, shell.genus, shell.vertices)
    if len(points) <= FEW:
        even = surface.sampled(MOST_SAMPLES, rng=0)
        assert even.normals is not None
        return Samples(
            even.points,
            even.normals,
            oriented=True,
            genus=shell.genus,
            walls=walls,
            target=Triangles(surface),
            what="the points have",
        )
    outward = surface.vertex_normals
    gap = cKDTree(points).query(shell.vertices)[0] > FILLED * shell.radius
    there = outward[cKDTree(shell.vertices).query(samples.points)[1]]
    turned = np.where(dot(samples.normals, there)[:, None] < 0, -samples.normals, samples.normals)
    return Samples(
        np.concatenate([samples.points, shell.vertices[gap]]),
        np.concatenate([turned, outward[gap]]),
        oriented=True,
        genus=shell.genus,
        walls=walls,
        what="the points have",
    )


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


def known_walls(vertices: Array, faces: Indices, genus: int | None, places: Array | None = None) -> Walls | None:
    """Return what tells the tunnels of closed triangles, None when there are none, some are knotted, or too many."""
    if not genus or 3 * genus * len(faces) > MOST:
        return None
    try:
        walls = Walls(vertices, faces, places)
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
