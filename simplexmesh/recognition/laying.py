"""Regular meshes of a handle or with borders, laid on data along a map that keeps angles."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import norm
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.errors import SimplexMeshWarning
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.deform import DeformableModel
from simplexmesh.motion.outward import turned_outward
from simplexmesh.motion.reconstruct import reconstruct
from simplexmesh.motion.subjects import PointsSubject, Subject, TrianglesSubject
from simplexmesh.recognition.patches import PERIODIC, Patch, domain
from simplexmesh.recognition.unrolling import Unrolled, unrolled

Array = NDArray[np.float64]

SHAPES = {"torus": (1, 0), "cylinder": (0, 2), "plane": (0, 1)}
"""Genus and number of borders of each."""

STARTS = {"torus": "auto", "cylinder": "cylinder", "plane": "plane"}
VERTICES = 3000
FAR = 0.01
"""A model farther than this from the data, in diagonals, is not one of it."""

TANGLED = 0.004
"""The share of its vertices that may be tangled, as in the corners of a rectangle that is to fill a disc."""

NEAREST = 24
STIFF, LIGHT = 40, 40
REACH = 0.05


def laid(subject: Subject, data: Any, topology: str, frequency: int, options: dict[str, Any]) -> SimplexMesh:
    """Return the regular mesh of a topology and frequency at rest on data.

    A triangulated surface is laid out as it is; of anything else a model is made first. The mesh is put on it, and
    then moves along its normals as far as smoothness and the data ask for, its metric parameters kept.

    Parameters
    ----------
    subject : Subject
        The data made ready.
    data : Any
        The data as it came, for `reconstruct`.
    topology : {"torus", "cylinder", "plane"}
    frequency : int
    options : dict
        What `reconstruct` is to be told of the data.

    Returns
    -------
    SimplexMesh

    Raises
    ------
    ValueError
        The data has another topology than asked for.
    """
    if topology == "plane" or isinstance(subject, TrianglesSubject):
        subject = turned_outward(subject)  # sheets and tubes have two sides: the same is taken however they are turned
    surface = _surface(subject, data, topology, options)
    patch = domain(topology, frequency)
    assert isinstance(patch, Patch)
    mesh = patch.mesh.moved(sampled(unrolled(surface.vertices, surface.faces, topology), patch))
    return _settled(mesh, subject, float(norm(np.ptp(surface.vertices, axis=0))))


def _surface(subject: Subject, data: Any, topology: str, options: dict[str, Any]) -> TriangleMesh:
    """Return a triangulated surface of the topology asked for."""
    if isinstance(subject, TrianglesSubject):
        surface = subject.triangles
    elif isinstance(subject, PointsSubject) and topology == "plane":
        surface = _modelled(subject.cloud, topology, {})
    else:
        surface = _modelled(data, topology, options)
    found, (genus, borders) = surface.topology, SHAPES[topology]
    if (found.n_components, found.genus, found.n_borders) != (1, genus, borders):
        raise ValueError(
            f"data must be in one piece, of genus {genus} and with {borders} borders, for topology={topology!r}; it is "
            f"in {found.n_components}, of genus {found.genus} and with {found.n_borders}"
        )
    return surface


def _modelled(data: Any, topology: str, options: dict[str, Any]) -> TriangleMesh:
    """Return the surface of a model of a volume or of points, begun with a shape of the topology asked for."""
    start = STARTS[topology]
    kept: dict[str, Any] = {} if start == "auto" else {"holes": "none", "handles": "none", "refine": "none"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimplexMeshWarning)  # what they say is refused here
        model = reconstruct(data, vertices=VERTICES, init=start, **kept, **options)
    surface = model.mesh.triangulated(method="fan")
    away = max(model.distance.data_to_mesh.rms, model.distance.mesh_to_data.rms)
    if away > FAR * surface.diagonal or (model.tangled or 0) > TANGLED * model.mesh.n_vertices:
        raise ValueError(
            f"data must suit topology={topology!r}; a model of that topology is {away:.3g} away from it with "
            f"{model.tangled} vertices tangled (a surface of triangles or hexagons needs no model)"
        )
    return surface


def sampled(flat: Unrolled, patch: Patch) -> Array:
    """Return (n, 3) the points of a surface laid out at the vertices of a patch."""
    size, turns = patch.period, np.array(PERIODIC[patch.topology])
    corners = flat.corners * size
    middle = corners.mean(axis=1)
    shift = np.where(turns, np.floor(middle / size) * size, 0.0)
    shift = np.where(turns & (middle - shift >= size), shift + size, shift)  # rounding
    corners, middle = corners - shift[:, None], middle - shift
    offset = np.zeros(2) if turns.all() else np.where(turns, 0.0, middle.min(axis=0))
    box = np.where(turns, size, 0.0)
    at = np.where(turns, (patch.coordinates % 1.0) * size, patch.coordinates * size)
    tree = cKDTree(middle - offset, boxsize=box)
    near = tree.query(at - offset, k=min(NEAREST, len(middle)), workers=-1)[1]
    off = at[:, None] - middle[near]
    off = np.where(turns, off - np.rint(off / size) * size, off)
    a, b, c = (corners[near, j] - middle[near] for j in range(3))
    weights = _barycentric(off, a, b, c)
    best = weights.min(axis=2).argmax(axis=1)
    rows = np.arange(len(at))
    share = np.clip(weights[rows, best], 0.0, None)
    share /= share.sum(axis=1, keepdims=True)
    return np.einsum("nj,njx->nx", share, flat.vertices[flat.faces[near[rows, best]]])


def _barycentric(p: Array, a: Array, b: Array, c: Array) -> Array:
    """Return (..., 3) the weights of triangles' corners that give points of the plane."""

    def det(u: Array, v: Array) -> Array:
        return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

    whole = det(b - a, c - a)
    whole = np.where(np.abs(whole) < 1e-30, np.inf, whole)
    second, third = det(p - a, c - a) / whole, det(b - a, p - a) / whole
    return np.stack([1 - second - third, second, third], axis=-1)


def _settled(mesh: SimplexMesh, subject: Subject, diagonal: float) -> SimplexMesh:
    """Return a mesh that was put on data at rest there, strong smoothing first, then light."""
    metric = np.clip(mesh.metric, 0.05, 0.9)
    metric /= metric.sum(axis=1, keepdims=True)
    now = mesh
    for rigidity, beta, iterations in ((3, 0.2, STIFF), (1, 0.4, LIGHT)):
        model = DeformableModel(
            now, subject.target, rigidity=rigidity, reach=REACH * diagonal, alpha=0.4, beta=beta, metric=metric,
            damping=0.6,
        )  # fmt: skip
        for _ in range(iterations):
            model.step()
        now = model.mesh
    return mesh.moved(now.vertices)
