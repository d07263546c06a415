"""Which faces of a surface are turned against the others, or inward."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import TopologyError, warn
from simplexmesh._base.vectors import dot, norm, normalized, triangle_vectors
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh import _kernels, manifold
from simplexmesh.motion.targets.triangles import winding_numbers

STEP = 1e-2
"""How far from a face the winding number is evaluated, in square roots of its area, but within half a thin sheet."""


def warn_inward(name: str, mesh: TriangleMesh, outcome: str) -> None:
    """Warn where faces disagree with most of their surface, or closed surfaces are inside out and no cavities."""
    try:
        faces, mates, _ = manifold.matched(mesh.faces)
        inward = manifold.to_flip(faces, mates)
        if not inward.any() and mesh.is_closed:
            inward = _bodies_inside_out(mesh.vertices, faces, mates)
    except TopologyError:  # of bodies that touch along edges only the whole is known
        faces, inward = mesh.faces, np.full(mesh.n_faces, mesh.is_closed and mesh.volume < 0)
    if inward.any():
        turned = f"inward normals, {inward.sum():,} of its {len(faces):,} faces"
        warn(f"{name} has {turned}, so {outcome}; {name}.oriented() flips them")


def without_inside_out(mesh: TriangleMesh) -> TriangleMesh:
    """Return an oriented closed surface with all bodies outward but walls of cavities: inward ones inside of others.

    All are turned over first where they are inside out together.
    """
    turned = mesh.volume < 0
    faces, vertices = mesh.faces[:, ::-1] if turned else mesh.faces, mesh.vertices - mesh.vertices.mean(axis=0)
    body = _kernels.component_labels((manifold.half_edge_mates(faces) // 3).astype(np.int32))
    inward = (np.bincount(body, dot(triangle_vectors(vertices, faces), vertices[faces[:, 0]])) < 0)[body]
    corners = vertices[faces[inward]].reshape(-1, 3)
    outside = winding_numbers(corners, vertices, faces[~inward]) < 0.5
    flip = np.isin(body, np.repeat(body[inward], 3)[outside]) != turned
    if not flip.any():
        return mesh
    warn(f"flipped {flip.sum():,} of {len(flip):,} triangles")
    return replace(mesh, faces=np.where(flip[:, None], mesh.faces[:, ::-1], mesh.faces))


def _bodies_inside_out(vertices: Array, faces: Indices, mates: Indices) -> Mask:
    """Return a mask of the faces of bodies that have the inside of none in front: there the winding number is -1."""
    labels = _kernels.component_labels((mates // 3).astype(np.int32))
    normals, middle = triangle_vectors(vertices, faces), vertices.mean(axis=0)
    order = np.lexsort((norm(normals), labels))
    largest = order[np.flatnonzero(np.diff(labels[order], append=-1))]  # face of each body
    sizes = np.sqrt(np.maximum(norm(normals[largest]), 1e-300))
    volumes = np.bincount(labels, dot(normals, vertices[faces[:, 0]] - middle) / 6)
    thickness = np.abs(volumes) / np.maximum(np.bincount(labels, norm(normals) / 2), 1e-300)
    step = normalized(normals[largest]) * np.minimum(STEP * sizes, thickness / 2)[:, None]
    number = winding_numbers(vertices[faces[largest]].mean(axis=1) + step, vertices, faces)
    return np.asarray((number < -0.5)[labels])
