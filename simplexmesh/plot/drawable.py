"""PyVista geometry of meshes, point clouds and volumes: surface, polygon edges, and scalars per vertex."""

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
from simplexmesh.motion.evolve import mean_edge
from simplexmesh.motion.subjects import as_subject

Array = NDArray[np.float64]

MOST_POINTS = 200_000
CREASE = 30.0  # feature angle in degrees: triangles that meet at a larger one are shaded with a sharp edge
CREASE_OF_VOLUMES = 60.0  # the same for isosurfaces, which have voxel steps
DISK, CORNERS = 0.5, 8  # radius of a point's disk, in distances to its neighbors, and its number of corners
DIVERGING = {"mean_curvature": ("mean curvature", -1), "simplex_angle": ("simplex angle, rad", 0)}  # name, power
SIGNED = ("simplex angle (rad)",)  # vertex arrays with a scale symmetric about zero even where all are positive


def as_drawable(given: Any) -> Any:
    """Return an object of this library for anything that can be plotted."""
    given = getattr(given, "mesh", given)  # a Reconstruction shows its mesh
    return given if isinstance(given, SimplexMesh) else as_data(given)


def oriented_like(cloud: PointCloud, mesh: SimplexMesh) -> PointCloud:
    """Return a cloud with its normals reversed where they point into a model of it, as some scanners' do."""
    if cloud.normals is None:
        return cloud
    _, nearest = cKDTree(mesh.vertices).query(cloud.points, workers=-1)
    return PointCloud(cloud.points, -cloud.normals) if (cloud.normals * mesh.normals[nearest]).sum() < 0 else cloud


def geometry(
    shown: Any, level: float | None, label: int | None, inside: str = "above"
) -> tuple[pv.PolyData, pv.PolyData | None]:
    """Return the geometry to draw, with normals, and the edges of a mesh's polygons or triangles."""
    if isinstance(shown, PointCloud):
        return _cloud(shown), None
    if isinstance(shown, SimplexMesh):
        fan = shown.triangulated(method="fan")
        polydata = _faces(fan.vertices, fan.faces)
        polydata.point_data["Normals"] = per_point(shown, shown.normals)
        polydata.point_data.active_normals_name = "Normals"
        return polydata, _lines(shown.vertices, shown.connectivity.edge_vertices)
    if isinstance(shown, Volume):
        surface = isosurface(shown, level, label, inside)
        return _lit(_faces(surface.vertices, surface.faces), CREASE_OF_VOLUMES), None
    polydata = _faces(shown.vertices, shown.faces)
    return _lit(polydata, CREASE), polydata.extract_all_edges()


def _lit(polydata: pv.PolyData, crease: float) -> pv.PolyData:
    """Return a surface with vertex normals, its vertices split at edges sharper than the feature angle in degrees."""
    return polydata.compute_normals(
        cell_normals=False,
        split_vertices=True,
        feature_angle=crease,
        consistent_normals=False,
        auto_orient_normals=False,
    )


def kept_points(count: int) -> NDArray[np.int64]:
    """Return the indices of the points that are drawn, a random subset of very many."""
    if count <= MOST_POINTS:
        return np.arange(count)
    return np.random.default_rng(0).choice(count, MOST_POINTS, replace=False)


def _cloud(cloud: PointCloud) -> pv.PolyData:
    """Return points; with normals, as small disks perpendicular to them, for shading and hidden-surface removal."""
    kept = kept_points(len(cloud.points))
    points, normals = cloud.points[kept], None if cloud.normals is None else cloud.normals[kept]
    if normals is None or len(points) < 4:
        return pv.PolyData(points)
    spacing = cKDTree(points).query(points, k=4, workers=-1)[0][:, 3]
    radius = DISK * np.minimum(spacing, 3 * np.median(spacing))
    helper = np.eye(3)[np.abs(normals).argmin(axis=1)]
    side = np.cross(normals, helper)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-300)
    other = np.cross(normals, side)
    turns = 2 * np.pi * np.arange(CORNERS) / CORNERS
    rim = np.cos(turns)[:, None] * side[:, None] + np.sin(turns)[:, None] * other[:, None]
    corners = (points[:, None] + radius[:, None, None] * rim).reshape(-1, 3)
    disks = _faces(corners, np.arange(len(corners)).reshape(-1, CORNERS))
    disks.point_data["Normals"] = np.repeat(normals, CORNERS, axis=0)
    disks.point_data.active_normals_name = "Normals"
    return disks


def isosurface(volume: Volume, level: float | None, label: int | None, inside: str = "above") -> TriangleMesh:
    """Return the triangulated isosurface of a level or a label of a volume, in physical space, for display.

    The volume is padded with background, so that objects cut by its border are closed there, as in a model of it.
    """
    if level is None or label is not None:
        mask = volume.mask(_label(volume, label))
        values, offset = _cropped(mask.values.astype(np.float32))
        level, inside = 0.5, "above"
    else:
        low, high = volume.range
        level = _check.number("level", level, low, high)
        background = low if inside == "above" else high
        values, offset = np.pad(volume.values, 1, constant_values=background), np.full(3, -1.0)
    grid = pv.ImageData(dimensions=values.shape)
    grid.point_data["values"] = np.asarray(values).ravel(order="F")
    found = grid.contour([level], scalars="values", method="flying_edges")
    if not found.n_points:
        raise ValueError(f"the volume has no surface at level {level:g}")
    faces = found.regular_faces
    if (np.linalg.det(volume.direction) < 0) != (inside == "below"):
        faces = faces[:, ::-1]
    return TriangleMesh(volume.to_world(np.asarray(found.points, dtype=float) + offset), faces)


def scalars_of(
    mesh: SimplexMesh,
    wanted: str | ArrayLike,
    data: Any,
    level: float | None,
    label: int | None,
    inside: str = "above",
) -> tuple[Array, str, int, bool]:
    """Return scalars per vertex, their name, their power of the unit of length, and whether they are diverging."""
    if not isinstance(wanted, str):
        return _check.array("scalars", wanted, (mesh.n_vertices,)), "", 0, False
    if wanted in DIVERGING:
        return getattr(mesh, wanted), *DIVERGING[wanted], True
    if wanted == "distance" and data is not None:
        return distances(mesh, as_drawable(data), level, label, inside), "distance to the data", 1, False
    if wanted == "distance" and "distance" not in mesh.data:
        raise ValueError("scalars 'distance' needs data to measure to: data is None, and the mesh has no such array")
    names = list(dict.fromkeys([*DIVERGING, "distance", *mesh.data]))
    values = np.asarray(mesh.data[_check.choice("scalars", wanted, names)], dtype=float)
    if values.ndim != 1:
        raise ValueError(f"scalars {wanted!r} must have one number for each vertex, not shape {values.shape}")
    signed = wanted in SIGNED or ((values < 0).any() and (values > 0).any())
    if wanted == "distance":
        return values, "distance to the data", 1, False
    return values, wanted.replace("_", " "), 0, bool(signed)


def distances(mesh: SimplexMesh, data: Any, level: float | None, label: int | None, inside: str = "above") -> Array:
    """Return distances of vertices to the surface in the data along their normals, NaN where none is near.

    These are the distances from mesh to data of `Reconstruction.distance`; near is within two samples or one edge.
    """
    if isinstance(data, SimplexMesh):
        data = data.triangulated(method="fan")
    subject = as_subject(data, level=level, label=label, inside=inside, components="all")
    reach = max(2 * subject.resolution, mean_edge(mesh))
    gaps = subject.target.gap(np.ascontiguousarray(mesh.vertices), np.ascontiguousarray(mesh.normals), reach)
    return np.abs(np.asarray(gaps))


def per_point(mesh: SimplexMesh, values: Array) -> Array:
    """Return values of vertices with their mean over each face appended, for the centroids of the fan."""
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
    """Return the given label, or the only one of the volume."""
    if label is not None:
        return label
    if not volume.is_labels:
        raise ValueError("level must be given to show the surface of a volume")
    labels = [found for found in volume.labels() if found]
    if len(labels) != 1:
        raise ValueError(f"label must be given: the volume has {len(labels)}")
    return labels[0]


def _cropped(values: NDArray[Any]) -> tuple[NDArray[Any], Array]:
    """Return a mask cropped to its nonzero part and padded with zeros, and the index where it begins."""
    low, high = np.zeros(3, dtype=int), np.zeros(3, dtype=int)
    for axis in range(3):
        others = tuple(other for other in range(3) if other != axis)
        (there,) = np.nonzero(values.any(axis=others))
        if not len(there):
            return values, np.zeros(3)
        low[axis], high[axis] = there[0], there[-1] + 1
    box = values[low[0] : high[0], low[1] : high[1], low[2] : high[2]]
    return np.pad(box, 1), low - 1.0
