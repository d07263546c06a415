"""Clip surfaces by a plane, with or without a cap, with VTK's filters."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from vtkmodules.vtkCommonDataModel import vtkPlane, vtkPlaneCollection
from vtkmodules.vtkFiltersCore import vtkClipPolyData
from vtkmodules.vtkFiltersGeneral import vtkClipClosedSurface

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import SimplexMeshWarning, warn
from simplexmesh._base.vectors import normalized
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.cutting.boolean import trimmed
from simplexmesh.data.io import polydata, vtk
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.numerics.blending import blended

TOLERANCE = 1e-9
"""Positions closer than this fraction of the diagonal are merged."""


def clipped(surface: Any, origin: ArrayLike, normal: ArrayLike, *, cap: bool = False) -> TriangleMesh:
    """Return the part of a surface in front of a plane, on the side its normal points to.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PyVista or trimesh object, or path
        The surface; a simplex mesh is triangulated.
    origin, normal : (3,) array of float
        A point of the plane and its normal, of any length.
    cap : bool
        Close the cut with a flat face, so that a closed surface stays closed. Without it the cut is a border.

    Returns
    -------
    TriangleMesh
        Named arrays are interpolated where edges are cut; labels are those of the nearer end.

    Raises
    ------
    ValueError
        The normal is zero, nothing is in front of the plane, or a cap is requested for an open surface.

    Warns
    -----
    SimplexMeshWarning
        A cap has gaps, as where parts of the surface are oriented inward.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> half = sm.clipped(sm.sphere(16), (0, 0, 0), (0, 0, 1), cap=True)
    >>> half.is_closed, round(half.volume, 1)  # 2 pi / 3
    (True, 2.1)
    >>> sm.clipped(sm.sphere(16), (0, 0, 0), (0, 0, 1)).is_closed
    False
    """
    mesh = as_triangles(surface, "surface").welded(report=False)
    checks.size("surface", mesh.bounds)
    at, direction = checks.array("origin", origin, (3,)), checks.array("normal", normal, (3,))
    checks.flag("cap", cap)
    if not direction.any():
        raise ValueError("normal must not be the zero vector")
    direction = normalized(direction / np.abs(direction).max())  # lengths whose squares overflow are legal
    if cap and not mesh.is_closed:
        raise ValueError("surface must be closed to be capped, it has a border")
    inward = cap and mesh.volume < 0
    outward = replace(mesh, faces=mesh.faces[:, ::-1]) if inward else mesh
    found = _cut(outward, at, direction, cap=cap)
    if cap and not found.is_closed:
        found = _without_gaps(outward, at, direction, found)
    data = _carried(mesh, found.vertices, at, direction) if mesh.data else {}
    return replace(found, faces=found.faces[:, ::-1] if inward else found.faces, data=data, unit=mesh.unit)


def _without_gaps(mesh: TriangleMesh, origin: Array, direction: Array, found: TriangleMesh) -> TriangleMesh:
    """Return the part as manifold3d cuts it, or the given one, with a warning, where that is not closed either."""
    if other := trimmed(mesh, origin, direction):
        other = other.welded(tolerance=TOLERANCE * mesh.diagonal, report=False)
        if other.is_closed:
            return other
    warn("the cap has gaps, so the part is open: orient all of the surface outward, or move the plane a little")
    return found


def _carried(mesh: TriangleMesh, vertices: Array, origin: Array, normal: Array) -> dict[str, NDArray[Any]]:
    """Return the arrays of a surface at some of its vertices and where its edges cross a plane."""
    height = (mesh.vertices - origin) @ normal
    ends = np.unique(np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    ends = ends[height[ends[:, 0]] * height[ends[:, 1]] < 0]
    share = height[ends] / (height[ends[:, :1]] - height[ends[:, 1:]])
    own = np.repeat(np.arange(mesh.n_vertices)[:, None], 2, axis=1)
    rows, weights = np.concatenate([own, ends]), np.concatenate([0.5 + 0.0 * own, np.abs(share[:, ::-1])])
    nearest = cKDTree((mesh.vertices[rows] * weights[:, :, None]).sum(axis=1)).query(vertices)[1]
    return blended(mesh.data, rows[nearest], weights[nearest])


def _cut(mesh: TriangleMesh, origin: Array, direction: Array, *, cap: bool) -> TriangleMesh:
    """Return the part in front of a plane as VTK cuts it, without data."""
    unit = 2.0 ** np.frexp(np.ptp(mesh.bounds, axis=0).max())[1]  # VTK's tolerances suit sizes of about one
    plane = vtkPlane()
    plane.SetOrigin(*(origin / unit))
    plane.SetNormal(*direction)
    if cap:
        planes = vtkPlaneCollection()
        planes.AddItem(plane)
        cutter = vtkClipClosedSurface()
        cutter.SetClippingPlanes(planes)
        cutter.TriangulationErrorDisplayOff()
    else:
        cutter = vtkClipPolyData()
        cutter.SetClipFunction(plane)
        cutter.SetOutputPointsPrecision(1)  # double
    cutter.SetInputData(polydata.Polygons(mesh.vertices / unit, np.full(mesh.n_faces, 3), mesh.faces.ravel()).dataset())
    cutter.Update()
    if not cutter.GetOutput().GetNumberOfPolys():
        raise ValueError("surface must have a part in front of the plane, it has none")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimplexMeshWarning)  # about slivers where the plane passes through a vertex
        found = as_triangles(vtk.from_dataset(cutter.GetOutput(), "surface"))
    found = TriangleMesh(unit * found.vertices, found.faces)
    return found.welded(tolerance=TOLERANCE * mesh.diagonal, report=False)
