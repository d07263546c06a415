"""The bodies that a closed surface bounds."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.vectors import cross, dot
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh._kernels import component_labels
from simplexmesh.mesh.manifold import half_edge_mates
from simplexmesh.motion.targets.triangles import inside_surface, surface_distance

SAMPLES = 40_000
"""Points of the other bodies, besides their vertices, that tell whether one of them crosses the largest."""


def largest_body(surface: TriangleMesh, apart: float) -> TriangleMesh | None:
    """Return the body of most volume of a closed oriented surface.

    None where another one crosses it, or is outside and nearer than a length.
    """
    vertices, faces = surface.vertices - surface.vertices.mean(axis=0), surface.faces
    body = component_labels((half_edge_mates(faces) // 3).astype(np.int32))
    a, b, c = vertices[faces].transpose(1, 0, 2)
    largest = body == np.bincount(body, dot(a, cross(b, c))).argmax()
    body_of_vertex = np.zeros(len(vertices))
    body_of_vertex[faces] = body[:, None]
    rest = TriangleMesh(vertices, faces[~largest], {"body": body_of_vertex})
    samples, corners = rest.sampled(SAMPLES), np.unique(rest.faces)
    points = np.concatenate([samples.points, vertices[corners]])
    owners = np.concatenate([samples.data["body"], body_of_vertex[corners]]).round().astype(int)
    within = inside_surface(points, vertices, faces[largest])
    inside, count = np.bincount(owners, within), np.bincount(owners)
    if ((inside > 0) & (inside < count)).any():
        return None
    if not within.all() and surface_distance(points[~within], vertices, faces[largest]).min() < apart:
        return None
    return TriangleMesh(surface.vertices, faces[largest], {}, surface.unit)
