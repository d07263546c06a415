"""Boolean operations on closed surfaces, and cuts; the only module that imports manifold3d."""

from __future__ import annotations

from typing import Any

import numpy as np
from manifold3d import Error, Manifold, Mesh64, OpType
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.named_arrays import joined
from simplexmesh._base.units import common_unit
from simplexmesh._base.vectors import cross, dot, norm
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh._kernels import component_labels
from simplexmesh.mesh.manifold import half_edge_mates
from simplexmesh.mesh.triangles.self_intersection import overlapping_boxes
from simplexmesh.numerics.blending import blended

OPERATIONS = ("difference", "union", "intersection")


NEGLIGIBLE = 1e-6
"""Share of the volume of all bodies that inward ones, and of the area of one that what others cut off, must exceed."""


def boolean(first: Any, second: Any, operation: str = "difference") -> TriangleMesh:
    """Return the difference, union or intersection of two closed surfaces: guides, molds, negatives.

    A block minus a bone is a guide that fits the bone. The result is always closed.

    Parameters
    ----------
    first, second : TriangleMesh, SimplexMesh, PyVista or trimesh object, or path
        Closed surfaces oriented outward; duplicate positions are merged. Bodies of one surface that overlap count
        as their union, unless it has cavities: then what is within two of them counts twice.
    operation : {"difference", "union", "intersection"}
        `first` minus `second`, either, or both.

    Returns
    -------
    TriangleMesh
        Closed; with the named arrays that both surfaces have, interpolated where edges are cut.

    Raises
    ------
    ValueError
        A surface is open or oriented inward, their units differ, the operation is unknown, or the result is empty.

    References
    ----------
    J. Charton, thesis, 2014, 5.1.3 (guides for jaws, as boolean differences); E. Lalish, *Manifold*.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> whole, bite = sm.sphere(8), sm.sphere(8, center=(1, 0, 0))
    >>> sm.boolean(whole, bite).is_closed
    True
    """
    checks.choice("operation", operation, OPERATIONS)
    meshes = tuple(
        as_triangles(each, name).welded(report=False) for each, name in ((first, "first"), (second, "second"))
    )
    unit = common_unit("first and second", meshes)
    ids = Manifold.reserve_ids(2)
    one, other = (_solid(mesh, ids + k, ("first", "second")[k]) for k, mesh in enumerate(meshes))
    out = one - other if operation == "difference" else one + other if operation == "union" else one ^ other
    mesh = out.to_mesh64()
    vertices, faces = _arrays(mesh)
    if not len(faces):
        raise ValueError(f"first and second must have a non-empty {operation}, but nothing is left")
    whose = np.repeat(np.array(mesh.run_original_id) - ids, np.diff(np.array(mesh.run_index)) // 3)
    data = _carried(meshes, vertices, faces, whose, np.array(mesh.face_id).astype(np.int64))
    return TriangleMesh(vertices, faces, data, unit)


def united(mesh: TriangleMesh) -> TriangleMesh:
    """Return a closed surface whose bodies, all outward, are one where they cross or touch, without arrays.

    What is within others then goes. A surface of which no body does is returned itself, and one that is not manifold.
    """
    solid = _manifold(mesh, 0)
    if solid.status() != Error.NoError:
        return mesh
    found = Manifold.batch_boolean(solid.decompose(), OpType.Add).to_mesh64()
    out = TriangleMesh(*_arrays(found), {}, mesh.unit)
    body = component_labels((half_edge_mates(mesh.faces) // 3).astype(np.int32))
    before = np.bincount(body, norm(mesh.face_vectors))
    left = np.bincount(body[np.array(found.face_id, np.int64)], norm(out.face_vectors), len(before))
    return out if ((left > NEGLIGIBLE * before) & (left < (1 - NEGLIGIBLE) * before)).any() else mesh


def trimmed(mesh: TriangleMesh, origin: Array, direction: Array) -> TriangleMesh | None:
    """Return the part of a closed surface in front of a plane with a cap, or None where manifold3d cannot tell it."""
    try:
        solid = _solid(mesh, 0, "surface")
    except ValueError:
        return None
    return TriangleMesh(*_arrays(solid.trim_by_plane(direction, float(origin @ direction)).to_mesh64()))


def _arrays(mesh: Mesh64) -> tuple[Array, Indices]:
    """Return the vertices (n, 3) and triangles (t, 3) of a solid."""
    return np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts).astype(np.int64)


def _carried(
    meshes: tuple[TriangleMesh, ...], vertices: Array, faces: Indices, whose: Indices, source: Indices
) -> dict[str, NDArray[Any]]:
    """Return the arrays that both surfaces have, at vertices of triangles cut from faces `source` of meshes `whose`."""
    arrays = joined([mesh.data for mesh in meshes])
    if not arrays:
        return {}
    of = np.zeros(len(vertices), np.int64)  # a triangle of each vertex
    of[faces] = np.arange(len(faces))[:, None]
    corners = np.concatenate([meshes[0].faces, meshes[0].n_vertices + meshes[1].faces])
    rows = corners[source + whose * meshes[0].n_faces][of]
    a, b, c = np.concatenate([mesh.vertices for mesh in meshes])[rows].transpose(1, 0, 2)
    normal = cross(b - a, c - a)
    parts = [dot(cross(q - p, vertices - p), normal) for p, q in ((b, c), (c, a), (a, b))]
    return blended(arrays, rows, np.maximum(np.stack(parts, axis=1) / dot(normal, normal)[:, None], 0.0))


def _manifold(mesh: TriangleMesh, number: int) -> Manifold:
    """Return a surface as a solid whose triangles remember its number and theirs."""
    arrays = np.array(mesh.vertices), np.array(mesh.faces, np.uint64)
    runs = {"run_index": np.array([0, 3 * mesh.n_faces], np.uint64), "run_original_id": np.array([number], np.uint32)}
    return Manifold(Mesh64(*arrays, **runs, face_id=np.arange(mesh.n_faces, dtype=np.uint64)))


def _solid(mesh: TriangleMesh, number: int, name: str) -> Manifold:
    checks.size(name, mesh.bounds)
    if not mesh.is_closed:
        raise ValueError(f"{name} must be closed, it has a border")
    if mesh.volume <= 0:
        raise ValueError(f"{name} must be oriented outward, it encloses a volume of {mesh.volume:.4g}")
    found = _manifold(mesh, number)
    if found.status() != Error.NoError:
        raise ValueError(f"{name} must be a surface with two faces at every edge: {found.status().name}")
    bodies = found.decompose()
    low, high = np.array([body.bounding_box() for body in bodies]).reshape(-1, 2, 3).swapaxes(0, 1)
    apart = not len(overlapping_boxes(low, high, float((high - low).mean())))
    inward, outward = ([body for body in bodies if (body.volume() < 0) == sign] for sign in (True, False))
    if apart and not inward:
        return found
    whole = Manifold.batch_boolean(outward, OpType.Add)  # what is within two would count twice
    size = sum(body.volume() for body in outward)
    for body in inward:
        if -body.volume() > NEGLIGIBLE * size and 5 * (_turned(body) - whole).volume() > -body.volume():
            place = ", ".join(f"{x:.4g}" for x in np.reshape(body.bounding_box(), (2, 3)).mean(axis=0))
            raise ValueError(f"{name} must be oriented outward, its part around ({place}) is inward, and no cavity")
    return found if inward else whole


def _turned(body: Manifold) -> Manifold:
    """Return a solid turned inside out."""
    vertices, faces = _arrays(body.to_mesh64())
    return Manifold(Mesh64(vertices, np.array(faces[:, ::-1], np.uint64)))
