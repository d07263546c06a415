"""Fit a regular torus, cylinder or disc to data through a conformal parameterization."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import SimplexMeshWarning
from simplexmesh._base.vectors import norm
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.deform import DeformableModel
from simplexmesh.motion.reconstruct.inputs import Input
from simplexmesh.motion.reconstruct.pipeline import reconstruct
from simplexmesh.recognition.sai.flat_domains import PERIODIC, FlatDomain, flat_domain
from simplexmesh.recognition.sai.parameterization import Parameterization, conformal_parameterization

INVARIANTS = {"torus": (1, 0), "cylinder": (0, 2), "plane": (0, 1)}
"""Genus and number of borders of each topology."""

INITIAL_SHAPES = {"torus": "auto", "cylinder": "cylinder", "plane": "plane"}
MAXIMUM_ERROR, MAXIMUM_TANGLED = 0.01, 0.004
"""Largest root mean square distance between model and data, in diagonals, and largest fraction of tangled vertices:
a few occur, as in the corners of a rectangle fitted to a disc."""


def fit_flat_domain(data: Input, topology: str, frequency: int) -> SimplexMesh:
    """Return the regular mesh of a topology and frequency fitted to data."""
    if topology == "plane" or isinstance(data.source, TriangleMesh):
        data = data.turned_outward()  # so that the side taken does not depend on the pose
    surface = _surface(data, topology)
    patch = flat_domain(topology, frequency)
    mesh = patch.mesh.moved(sampled(conformal_parameterization(surface.vertices, surface.faces, topology), patch))
    return _relaxed(mesh, data, float(norm(np.ptp(surface.vertices, axis=0))))


def _surface(data: Input, topology: str) -> TriangleMesh:
    """Return the data as a triangulated surface of a topology."""
    surface = data.source if isinstance(data.source, TriangleMesh) else _reconstructed(data, topology)
    found, (genus, borders) = surface.topology, INVARIANTS[topology]
    if (found.n_components, found.genus, found.n_borders) != (1, genus, borders):
        raise ValueError(
            f"data must have genus {genus}, border count {borders} and component count 1 for topology={topology!r}, "
            f"not {found.genus}, {found.n_borders} and {found.n_components}"
        )
    return surface


def _reconstructed(data: Input, topology: str) -> TriangleMesh:
    """Return the surface reconstructed from a volume or points, started from a shape of the topology."""
    start = INITIAL_SHAPES[topology]
    fixed: dict[str, Any] = {} if start == "auto" else {"holes": "none", "handles": "none", "refine": "none"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimplexMeshWarning)  # checked below
        model = reconstruct(data, vertices=3000, init=start, **fixed)
    surface = model.mesh.triangulated(method="fan")
    error = max(model.distance.data_to_mesh.rms, model.distance.mesh_to_data.rms)
    if error > MAXIMUM_ERROR * surface.diagonal or (model.tangled or 0) > MAXIMUM_TANGLED * model.mesh.n_vertices:
        raise ValueError(
            f"data must suit topology={topology!r}; a model of that topology is {error:.3g} away from it, with "
            f"{model.tangled} tangled vertices (triangle and simplex meshes are used as they are)"
        )
    return surface


def sampled(parameterization: Parameterization, patch: FlatDomain) -> Array:
    """Return (n, 3) the points of a parameterized surface at the vertices of a domain."""
    size, periodic = patch.period, np.array(PERIODIC[patch.topology])
    corners = parameterization.corners * size
    centers = corners.mean(axis=1)
    shift = np.where(periodic, np.floor(centers / size) * size, 0.0)
    shift = np.where(periodic & (centers - shift >= size), shift + size, shift)  # after rounding
    corners, centers = corners - shift[:, None], centers - shift
    offset = np.zeros(2) if periodic.all() else np.where(periodic, 0.0, centers.min(axis=0))
    box = np.where(periodic, size, 0.0)
    at = np.where(periodic, (patch.coordinates % 1.0) * size, patch.coordinates * size)
    tree = cKDTree(np.maximum(centers - offset, 0.0), boxsize=box)  # which refuses negative ones, by rounding too
    near = tree.query(at - offset, k=min(24, len(centers)), workers=-1)[1]
    difference = at[:, None] - centers[near]
    difference = np.where(periodic, difference - np.rint(difference / size) * size, difference)
    a, b, c = (corners[near, j] - centers[near] for j in range(3))
    weights = _barycentric(difference, a, b, c)
    best = weights.min(axis=2).argmax(axis=1)
    rows = np.arange(len(at))
    barycentric = np.clip(weights[rows, best], 0.0, None)
    barycentric /= barycentric.sum(axis=1, keepdims=True)
    return np.einsum("nj,njx->nx", barycentric, parameterization.vertices[parameterization.faces[near[rows, best]]])


def _barycentric(p: Array, a: Array, b: Array, c: Array) -> Array:
    """Return (..., 3) barycentric coordinates of points p (..., 2) in triangles a, b, c."""

    def det(u: Array, v: Array) -> Array:
        return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

    area = det(b - a, c - a)
    area = np.where(np.abs(area) < 1e-30, np.inf, area)
    second, third = det(p - a, c - a) / area, det(b - a, p - a) / area
    return np.stack([1 - second - third, second, third], axis=-1)


def _relaxed(mesh: SimplexMesh, data: Input, diagonal: float) -> SimplexMesh:
    """Return a mesh relaxed on the data: strong smoothing first, then light."""
    metric = np.clip(mesh.metric, 0.05, 0.9)
    metric /= metric.sum(axis=1, keepdims=True)
    now = mesh
    for rigidity, beta, iterations in ((3, 0.2, 40), (1, 0.4, 40)):
        model = DeformableModel(
            now, data.target, rigidity=rigidity, reach=0.05 * diagonal, alpha=0.4, beta=beta, metric=metric, damping=0.6
        )
        for _ in range(iterations):
            model.step()
        now = model.mesh
    return mesh.moved(now.vertices)
