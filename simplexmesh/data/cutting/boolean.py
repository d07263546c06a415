"""Boolean operations on closed surfaces; the only module that imports manifold3d, an optional dependency."""

from __future__ import annotations

from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.triangles import TriangleMesh

OPERATIONS = ("difference", "union", "intersection")


def boolean(first: Any, second: Any, operation: str = "difference") -> TriangleMesh:
    """Return the difference, union or intersection of two closed surfaces: guides, molds, negatives.

    A block minus a bone is a guide that fits the bone. The result is always closed. Needs the package manifold3d:
    ``pip install 'simplexmesh[guides]'``.

    Parameters
    ----------
    first, second : TriangleMesh, SimplexMesh, PyVista or trimesh object, or path
        Closed surfaces oriented outward; duplicate positions are merged.
    operation : {"difference", "union", "intersection"}
        `first` minus `second`, either, or both.

    Returns
    -------
    TriangleMesh
        Closed.

    Raises
    ------
    ImportError
        manifold3d is not installed.
    ValueError
        A surface is open or oriented inward, the operation is unknown, or the result is empty.

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
    manifold3d = _library()
    one = _solid(manifold3d, as_triangles(first, "first"), "first")
    other = _solid(manifold3d, as_triangles(second, "second"), "second")
    out = one - other if operation == "difference" else one + other if operation == "union" else one ^ other
    mesh = out.to_mesh64()
    if not len(mesh.tri_verts):
        raise ValueError(f"first and second must have a non-empty {operation}, but nothing is left")
    return TriangleMesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts).astype(np.int64))


def _library() -> Any:
    try:
        import manifold3d
    except ImportError:
        raise ImportError("boolean needs the package manifold3d: pip install 'simplexmesh[guides]'") from None
    return manifold3d


def _solid(manifold3d: Any, mesh: TriangleMesh, name: str) -> Any:
    mesh = mesh.welded(report=False)
    checks.size(name, mesh.bounds)
    if not mesh.is_closed:
        raise ValueError(f"{name} must be closed, it has a border")
    if mesh.volume <= 0:
        raise ValueError(f"{name} must be oriented outward, it encloses a volume of {mesh.volume:.4g}")
    found = manifold3d.Manifold(manifold3d.Mesh64(np.array(mesh.vertices), np.array(mesh.faces, np.uint64)))
    if found.status() != manifold3d.Error.NoError:
        raise ValueError(f"{name} must be a surface with two faces at every edge: {found.status().name}")
    return found
