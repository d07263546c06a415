"""The step of a reconstruction that moves the model to points that all lie on one side of it, as at tips."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, eye_array

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import dot
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.model.untangle import Tangles
from simplexmesh.motion.reconstruct.run import Run
from simplexmesh.motion.targets.points import Points
from simplexmesh.motion.targets.triangles import Triangles
from simplexmesh.motion.topology.face_regions import dilated

SIGNIFICANT = 5.0
"""Standard errors from which a mean offset counts: those of few points are uncertain, and there are many means."""

SAGITTA = 0.125
"""Of a mean edge, that of an arc of one radian: points over faces with vertices on the data are off by less."""

ROUNDS = 2

FEWEST = 4
"""Points, of which a scatter is known well enough."""


def correct(run: Run) -> None:
    """Move a closed model of points by their mean offset from it, where significant and nothing tangles by it.

    The motion matches each vertex to data along its normal; ends of limbs thinner than the fits to the data are off by
    as much on all sides, which the points nearest to them tell.
    """
    if not isinstance(run.target, Points) or run.mesh.n_holes or not run.stages[-1].iterations:
        return
    if run.target.noise > mean_edge(run.mesh):  # points are nearest to other vertices than those of their places
        return
    moved, neighbors = run.mesh, run.mesh.neighbors
    points = run.points[run.away(run.points) <= run.stages[-1].reach]  # not of other pieces
    for _ in range(ROUNDS):
        moved = moved.moved(moved.vertices + significant_offsets(moved, points)[:, None] * moved.normals)
    before = Tangles(run.mesh)
    after = before.with_positions(moved, np.ones(len(neighbors), bool))
    if after.count:
        after = before.with_positions(moved, ~dilated(after.vertices, neighbors, 3))
    if after.count <= before.count:
        run.mesh, run.tangled = after.mesh, after.count


def significant_offsets(mesh: SimplexMesh, points: Array) -> Array:
    """Return (n,) the mean offset along the normal of the points nearest to each vertex and two rings, 0 by chance."""
    n = mesh.n_vertices
    ends = np.arange(n).repeat(3), mesh.neighbors.ravel()
    ring = csr_array((np.ones(3 * n), ends), shape=(n, n)) + eye_array(n)
    near, offset = _nearest(mesh, points)
    sums = np.stack([np.bincount(near, offset**k, minlength=n) for k in range(3)], axis=1)
    count, total, squares = (((ring @ ring) > 0) @ sums).T
    known = np.maximum(count, FEWEST)
    mean = total / known
    error = np.sqrt(np.maximum(squares / known - mean**2, 0.0) / (known - 1))
    chosen = (count >= FEWEST) & (np.abs(mean) > np.maximum(SIGNIFICANT * error, SAGITTA * mean_edge(mesh)))
    return np.asarray(ring @ np.where(chosen, mean, 0.0)) / 4


def _nearest(mesh: SimplexMesh, points: Array) -> tuple[Indices, Array]:
    """Return (m,) the vertex nearest to each point, and how far the point is off along its normal."""
    surface = mesh.triangulated("curved")
    _, places, faces = Triangles(surface).closest(points)
    corners = surface.faces[faces]
    away = ((surface.vertices[corners] - places[:, None]) ** 2).sum(axis=2)
    away[corners >= mesh.n_vertices] = np.inf
    near = corners[np.arange(len(corners)), away.argmin(axis=1)]
    return near, dot(points - places, mesh.normals[near])
