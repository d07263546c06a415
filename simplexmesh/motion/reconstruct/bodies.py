"""The bodies that a closed surface bounds."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.vectors import cross, dot
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh._kernels import component_labels
from simplexmesh.mesh.manifold import half_edge_mates
from simplexmesh.motion.targets.triangles import winding_numbers

SAMPLES = 40_000
"""Points of the other bodies, besides their vertices, that tell whether one of them crosses the largest."""

CLEAR = 0.1
"""Greatest difference from a whole winding number of points that are not on a surface."""


def largest_body(surface: TriangleMesh) -> TriangleMesh | None:
    """Return the body of most volume of a closed oriented surface; None where another one crosses or touches it."""
    vertices, faces = surface.vertices - surface.vertices.mean(axis=0), surface.faces
    body = component_labels((half_edge_mates(faces) // 3).astype(np.int32))
    a, b, c = vertices[faces].transpose(1, 0, 2)
    largest = body == np.bincount(body, dot(a, cross(b, c))).argmax()
    names = np.zeros(len(vertices))
    names[faces] = body[:, None]
    rest = TriangleMesh(vertices, faces[~largest], {"body": names})
    samples, corners = rest.sampled(SAMPLES), np.unique(rest.faces)
    winding = winding_numbers(np.concatenate([samples.points, vertices[corners]]), vertices, faces[largest])
    names = np.concatenate([samples.data["body"], names[corners]]).round().astype(int)
    count = np.bincount(names)
    inside = np.bincount(names, winding > 0.5)
    if (np.abs(winding - np.round(winding)) > CLEAR).any() or ((inside > 0) & (inside < count)).any():
        return None
    return TriangleMesh(surface.vertices, faces[largest], {}, surface.unit).welded(report=False)
