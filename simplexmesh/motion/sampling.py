"""Samples of a closed surface for wrapping: points, normals and, where the data tells, its tunnels."""

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
from simplexmesh.motion.tunnel_homology import MOST, TunnelHomology
from simplexmesh.motion.wrap import Samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MOST_SAMPLES = 20_000

WIDE = 0.05
"""In diagonals of the data: data with a wider border counts as open."""

GAP = 0.5
"""In ball radii of the offset surface: its vertices farther than this from all points are added, to fill gaps."""


def closed_samples(subject: Subject, vertices: int = 4000, tunnels: float | None = None) -> Samples | None:
    """Return samples of the surface of a subject, None when that surface has a border.

    Parameters
    ----------
    subject : Subject
    vertices : int
        Number of vertices of the model; the tunnels of a volume are those of its automatic start of this size.
    tunnels : float, optional
        Width below which tunnels of a volume are ignored, in its unit.

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
        homology = known_homology(*surface, genus)
        return _subsampled(Samples(cloud.points, cloud.normals, oriented=True, genus=genus, homology=homology))
    if isinstance(subject, VolumeSubject):
        return _with_tunnels_of_start(_volume_samples(subject), subject, vertices, tunnels)
    target = subject.target if hasattr(subject.target, "samples") else Points(subject.points)
    points, normals = target.samples()
    if not normals.any(axis=1).all():  # a surfel without normal gets that of the nearest one that has a normal
        known = np.flatnonzero(normals.any(axis=1))
        normals = normals[known[cKDTree(points[known]).query(points)[1]]]
    samples = _subsampled(Samples(points, normals, bool(target.surfels.oriented)))  # type: ignore[attr-defined]
    if isinstance(subject, LabelSubject):
        return _with_tunnels_of_start(samples, subject, vertices, tunnels)
    shell = shell_of(subject.points) if isinstance(subject, PointsSubject) else None
    return samples if shell is None else _with_gaps_filled(samples, subject.points, shell)


def _with_tunnels_of_start(
    samples: Samples, subject: VolumeSubject | LabelSubject, vertices: int, tunnels: float | None
) -> Samples:
    """Return the samples with the tunnels that the automatic start of a volume has."""
    try:
        start = subject.start(vertices, tunnels).mesh
    except TopologyError:  # everything is too thin for so few vertices
        return samples
    if start.n_components > 1 or start.n_holes:
        return samples
    surface = start.triangulated()
    return replace(samples, genus=start.genus, homology=known_homology(surface.vertices, surface.faces, start.genus))


def _with_gaps_filled(samples: Samples, points: Array, shell: Shell) -> Samples:
    """Return the samples with the tunnels of the offset surface, and with gaps between points filled.

    Few points are replaced by samples of the surface through them.
    """
    from simplexmesh.motion.targets.triangles import Triangles

    surface = TriangleMesh(shell.vertices, shell.faces)
    homology = known_homology(shell.offset_vertices, shell.faces, shell.genus, shell.vertices)
    if len(points) <= FEW:
        even = surface.sampled(MOST_SAMPLES, rng=0)
        assert even.normals is not None
        return Samples(
            even.points,
            even.normals,
            oriented=True,
            genus=shell.genus,
            homology=homology,
            target=Triangles(surface),
            what="the points have",
        )
    outward = surface.vertex_normals
    gap = cKDTree(points).query(shell.vertices)[0] > GAP * shell.radius
    reference = outward[cKDTree(shell.vertices).query(samples.points)[1]]
    flipped = np.where(dot(samples.normals, reference)[:, None] < 0, -samples.normals, samples.normals)
    return Samples(
        np.concatenate([samples.points, shell.vertices[gap]]),
        np.concatenate([flipped, outward[gap]]),
        oriented=True,
        genus=shell.genus,
        homology=homology,
        what="the points have",
    )


def _volume_samples(subject: VolumeSubject) -> Samples:
    """Return the points where grid lines leave the object, with normals from the gradient."""
    from scipy.ndimage import map_coordinates

    samples = _subsampled(Samples(subject.points, np.zeros_like(subject.points), oriented=True))
    step = float(np.max(subject.volume.spacing))
    slope = np.zeros_like(samples.points)
    for axis in range(3):
        for sign in (1.0, -1.0):
            places = samples.points.copy()
            places[:, axis] += sign * step
            index = subject.volume.to_index(places)
            slope[:, axis] += sign * map_coordinates(
                subject.volume.values, index.T, output=np.float64, order=1, mode="nearest"
            )
    slope = np.ldexp(slope, -np.frexp(np.abs(slope).max(axis=1, keepdims=True))[1])  # squares may overflow
    outward = -slope if subject.inside == "above" else slope
    known = norm(outward) > 0
    return Samples(samples.points[known], normalized(outward[known]), oriented=True)


def known_genus(subject: Subject) -> int | None:
    """Return the genus of closed connected triangles, None for all other data."""
    if not isinstance(subject, TrianglesSubject):
        return None
    topology = subject.triangles.topology
    return None if topology.n_components > 1 or topology.n_borders else int(topology.genus)


def known_homology(
    vertices: Array, faces: Indices, genus: int | None, places: Array | None = None
) -> TunnelHomology | None:
    """Return the homology of closed triangles; None when there are no or too many tunnels, or knotted ones."""
    if not genus or 3 * genus * len(faces) > MOST:
        return None
    try:
        homology = TunnelHomology(vertices, faces, places)
    except TopologyError:  # not manifold: two sheets share a vertex
        return None
    return homology if len(homology.tunnels) == genus else None


def _subsampled(samples: Samples) -> Samples:
    """Return a random subset of bounded size, always the same."""
    n = len(samples.points)
    if n <= MOST_SAMPLES:
        return samples
    rows = np.random.default_rng(0).choice(n, MOST_SAMPLES, replace=False)
    return replace(samples, points=samples.points[rows], normals=samples.normals[rows])
