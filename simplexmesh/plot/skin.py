"""What is drawn of a thing: its surface or points, the outlines of its polygons, and the numbers to color it by."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from simplexmesh import _check
from simplexmesh.data.convert import as_data
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.targets.triangles import surface_distance

Array = NDArray[np.float64]

MOST_POINTS = 200_000
DIVERGING = {"mean_curvature": ("mean curvature", -1), "simplex_angle": ("simplex angle, rad", 0)}  # name, power


def thing(given: Any) -> Any:
    """Return one of this library's own objects for anything that can be shown."""
    given = getattr(given, "mesh", given)  # a Reconstruction shows its mesh
    return given if isinstance(given, SimplexMesh) else as_data(given)


def geometry(shown: Any, level: float | None, label: int | None) -> tuple[pv.PolyData, pv.PolyData | None]:
    """Return what is drawn, and the outlines of the polygons of a simplex mesh or of triangles."""
    if isinstance(shown, PointCloud):
        points = shown.points
        if len(points) > MOST_POINTS:
            points = points[np.random.default_rng(0).choice(len(points), MOST_POINTS, replace=False)]
        return pv.PolyData(points), None
    if isinstance(shown, SimplexMesh):
        fan = shown.triangulated(method="fan")
        coat = _faces(fan.vertices, fan.faces)
        coat.point_data["Normals"] = per_point(shown, shown.normals)
        coat.point_data.active_normals_name = "Normals"
        return coat, _lines(shown.vertices, shown.connectivity.edge_vertices)
    if isinstance(shown, Volume):
        shown = isosurface(shown, level, label)
    coat = _faces(shown.vertices, shown.faces)
    return coat, coat.extract_all_edges()


def isosurface(volume: Volume, level: float | None, label: int | None) -> TriangleMesh:
    """Return the triangulated surface of a volume at a level or of a label, in physical space, to be looked at."""
    if level is None or label is not None:
        mask = volume.mask(_label(volume, label))
        values, offset = _cropped(mask.values.astype(np.float32))
        level = 0.5
    else:
        low, high = volume.range
        level = _check.number("level", level, low, high)
        values, offset = volume.values, np.zeros(3)
    grid = pv.ImageData(dimensions=values.shape)
    grid.point_data["values"] = np.asarray(values).ravel(order="F")
    found = grid.contour([level], scalars="values", method="flying_edges")
    if not found.n_points:
        raise ValueError(f"the volume has no surface at level {level:g}")
    faces = found.regular_faces
    if np.linalg.det(volume.direction) < 0:
        faces = faces[:, ::-1]
    return TriangleMesh(volume.to_world(np.asarray(found.points, dtype=float) + offset), faces)


def scalars_of(
    mesh: SimplexMesh, wanted: str | ArrayLike, data: Any, level: float | None, label: int | None
) -> tuple[Array, str, int, bool]:
    """Return numbers per vertex, their name, the power of length they are, and whether zero is their middle."""
    if not isinstance(wanted, str):
        return _check.array("scalars", wanted, (mesh.n_vertices,)), "", 0, False
    if wanted in DIVERGING:
        return getattr(mesh, wanted), *DIVERGING[wanted], True
    if wanted == "distance":
        if data is None:
            raise ValueError("scalars 'distance' needs the data to measure to, and data is None")
        return distances(mesh.vertices, thing(data), level, label), "distance to the data", 1, False
    names = [*DIVERGING, "distance", *mesh.data]
    values = np.asarray(mesh.data[_check.choice("scalars", wanted, names)], dtype=float)
    if values.ndim != 1:
        raise ValueError(f"scalars {wanted!r} must have one number for each vertex, not shape {values.shape}")
    return values, wanted.replace("_", " "), 0, bool((values < 0).any() and (values > 0).any())


def distances(points: Array, data: Any, level: float | None, label: int | None) -> Array:
    """Return how far points are from data: from the surface of a volume or triangles, from the nearest point."""
    if isinstance(data, PointCloud):
        nearest, _ = cKDTree(data.points).query(points)
        return np.asarray(nearest)
    if isinstance(data, Volume):
        data = isosurface(data, level, label)
    elif isinstance(data, SimplexMesh):
        data = data.triangulated(method="fan")
    return surface_distance(points, data.vertices, data.faces)


def per_point(mesh: SimplexMesh, values: Array) -> Array:
    """Return values of vertices with their means over each face appended, as the fan has centroids."""
    topology = mesh.connectivity
    sums = np.add.reduceat(values[topology.face_vertices], topology.face_offsets[:-1], axis=0)
    sizes = topology.face_sizes if values.ndim == 1 else topology.face_sizes[:, None]
    return np.concatenate([values, (sums / sizes)[~topology.face_is_hole]])


def _faces(vertices: Array, faces: NDArray[np.integer[Any]]) -> pv.PolyData:
    return pv.PolyData.from_regular_faces(np.asarray(vertices), np.asarray(faces))


def _lines(vertices: Array, edge_vertices: NDArray[np.integer[Any]]) -> pv.PolyData:
    cells = np.insert(edge_vertices.astype(np.int64), 0, 2, axis=1)
    return pv.PolyData(np.asarray(vertices), lines=cells.ravel())


def _label(volume: Volume, label: int | None) -> int:
    """Return the label meant: the one given, or the only one there is."""
    if label is not None:
        return label
    if not volume.is_labels:
        raise ValueError("level must be given to show the surface of a volume")
    labels = [found for found in volume.labels() if found]
    if len(labels) != 1:
        raise ValueError(f"label must be given: the volume has {len(labels)}")
    return labels[0]


def _cropped(values: NDArray[Any]) -> tuple[NDArray[Any], Array]:
    """Return the part of a mask that is not empty, with a rim of zeros around, and where it begins."""
    low, high = np.zeros(3, dtype=int), np.zeros(3, dtype=int)
    for axis in range(3):
        others = tuple(other for other in range(3) if other != axis)
        (there,) = np.nonzero(values.any(axis=others))
        if not len(there):
            return values, np.zeros(3)
        low[axis], high[axis] = there[0], there[-1] + 1
    box = values[low[0] : high[0], low[1] : high[1], low[2] : high[2]]
    return np.pad(box, 1), low - 1.0
