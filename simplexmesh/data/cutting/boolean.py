"""Boolean operations on closed surfaces, and cuts; the only module that imports manifold3d, an optional dependency."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.named_arrays import joined
from simplexmesh._base.units import common_unit
from simplexmesh._base.vectors import cross, dot
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.triangles.self_intersection import overlapping_boxes
from simplexmesh.numerics.blending import blended

OPERATIONS = ("difference", "union", "intersection")


NEGLIGIBLE = 1e-6
"""Share of the volume of all bodies: what is inward and smaller is let be."""


def boolean(first: Any, second: Any, operation: str = "difference") -> TriangleMesh:
    """Return the difference, union or intersection of two closed surfaces: guides, molds, negatives.

    A block minus a bone is a guide that fits the bone. The result is always closed. Needs the package manifold3d:
    ``pip install 'simplexmesh[guides]'``.

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
    ImportError
        manifold3d is not installed.
    ValueError
        A surface is open or oriented inward, their units differ, the operation is unknown, or the result is empty.

    References
    ----------
    J. Charton, thesis, 2014, 5.1.3 (guides for jaws, as boolean differences); E. Lalish, *Manifold*.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> whole, bite = sm.sphere(8), sm.sphere(8, center=(1, 0, 0))
    >>> try:
    ...     left = sm.boolean(whole, bite)
    ... except ImportError:  # without the extra
    ...     left = whole.triangulated()
    >>> left.is_closed
    True
    """
    checks.choice("operation", operation, OPERATIONS)
    try:
        import manifold3d
    except ImportError:
        raise ImportError("boolean needs the package manifold3d: pip install 'simplexmesh[guides]'") from None
    meshes = tuple(
        as_triangles(each, name).welded(report=False) for each, name in ((first, "first"), (second, "second"))
    )
    unit = common_unit("first and second", meshes)
    ids = manifold3d.Manifold.reserve_ids(2)
    one, other = (_solid(manifold3d, mesh, ids + k, ("first", "second")[k]) for k, mesh in enumerate(meshes))
    out = one - other if operation == "difference" else one + other if operation == "union" else one ^ other
    mesh = out.to_mesh64()
    if not len(mesh.tri_verts):
        raise ValueError(f"first and second must have a non-empty {operation}, but nothing is left")
    vertices, faces = np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts).astype(np.int64)
    whose = np.repeat(np.array(mesh.run_original_id) - ids, np.diff(np.array(mesh.run_index)) // 3)
    data = _carried(meshes, vertices, faces, whose, np.array(mesh.face_id).astype(np.int64))
    return TriangleMesh(vertices, faces, data, unit)


def trimmed(mesh: TriangleMesh, origin: Array, direction: Array) -> TriangleMesh | None:
    """Return the part of a closed surface in front of a plane with a cap, or None where manifold3d cannot tell it."""
    try:
        import manifold3d

        found = _solid(manifold3d, mesh, 0, "surface").trim_by_plane(direction, float(origin @ direction)).to_mesh64()
        return TriangleMesh(np.array(found.vert_properties)[:, :3], np.array(found.tri_verts).astype(np.int64))
    except (ImportError, ValueError):
        return None


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


def _solid(manifold3d: Any, mesh: TriangleMesh, number: int, name: str) -> Any:
    checks.size(name, mesh.bounds)
    if not mesh.is_closed:
        raise ValueError(f"{name} must be closed, it has a border")
    if mesh.volume <= 0:
        raise ValueError(f"{name} must be oriented outward, it encloses a volume of {mesh.volume:.4g}")
    arrays = np.array(mesh.vertices), np.array(mesh.faces, np.uint64)
    runs = {"run_index": np.array([0, 3 * mesh.n_faces], np.uint64), "run_original_id": np.array([number], np.uint32)}
    given = manifold3d.Mesh64(*arrays, **runs, face_id=np.arange(mesh.n_faces, dtype=np.uint64))
    found = manifold3d.Manifold(given)
    if found.status() != manifold3d.Error.NoError:
        raise ValueError(f"{name} must be a surface with two faces at every edge: {found.status().name}")
    bodies = found.decompose()
    low, high = np.array([body.bounding_box() for body in bodies]).reshape(-1, 2, 3).swapaxes(0, 1)
    apart = not len(overlapping_boxes(low, high, float((high - low).mean())))
    inward, outward = ([body for body in bodies if (body.volume() < 0) == sign] for sign in (True, False))
    if apart and not inward:
        return found
    whole = manifold3d.Manifold.batch_boolean(outward, manifold3d.OpType.Add)  # what is within two would count twice
    size = sum(body.volume() for body in outward)
    for body in inward:
        if -body.volume() > NEGLIGIBLE * size and 5 * (_turned(manifold3d, body) - whole).volume() > -body.volume():
            place = ", ".join(f"{x:.4g}" for x in np.reshape(body.bounding_box(), (2, 3)).mean(axis=0))
            raise ValueError(f"{name} must be oriented outward, its part around ({place}) is inward, and no cavity")
    return found if inward else whole


def _turned(manifold3d: Any, body: Any) -> Any:
    """Return a solid turned inside out."""
    mesh = body.to_mesh64()
    return manifold3d.Manifold(
        manifold3d.Mesh64(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts)[:, ::-1])
    )
