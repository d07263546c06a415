"""PyVista geometry of meshes, point clouds and volumes, with values or colors at their points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import tangents
from simplexmesh.data.box import box_around, box_slices
from simplexmesh.data.conversion import as_data
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume
from simplexmesh.mesh.face_geometry import face_centroids
from simplexmesh.mesh.simplex_mesh import SimplexMesh

MOST_POINTS = 200_000
"""Points drawn of a cloud, of more a random subset, or an even one beside primitives."""

CREASE, SMOOTH = 30.0, 60.0
"""Feature angles in degrees: triangles that meet at a larger one are shaded with a sharp edge. The second is for
isosurfaces, which have voxel steps, and for scalars on scans."""

CORNERS = 8
"""Corners of the disk drawn for a point with a normal."""


def as_drawable(given: Any) -> Any:
    """Return an object of this library for anything that can be plotted."""
    given = getattr(given, "mesh", given)  # a Reconstruction shows its mesh
    return given if isinstance(given, SimplexMesh) else as_data(given)


def check_choice(things: Sequence[Any], level: float | None, label: int | None, inside: str) -> None:
    """Refuse `level` and `label` without a volume, both of them, and `inside` without a level."""
    checks.choice("inside", inside, ("above", "below"))
    things = [as_drawable(one) for one in things if one is not None]
    volumes = any(isinstance(one, Volume) for one in things)
    if level is not None and label is not None:
        raise ValueError("give level or label, not both")
    if (level, label) != (None, None) and not volumes:
        raise ValueError(f"level and label are for volumes, not for {type(things[-1]).__name__}")
    of = "labels" if volumes else type(things[-1]).__name__
    if inside != "above" and level is None:
        raise ValueError(f"inside is for a level of a volume, not for {of}")


def as_surface(given: Any) -> Any:
    """Return a mesh, with all its vertices, or a cloud, for anything per-vertex values can be drawn on."""
    if isinstance(given, tuple | list) and len(given) == 2:
        given = TriangleMesh(given[0], given[1])
    shown = given if isinstance(given, PointCloud) else as_drawable(given)
    if isinstance(shown, Volume | Mapping):
        raise TypeError(f"surface must be a mesh or points, not {checks.type_name(shown)}")
    return shown


def points_of(shown: Any) -> Array:
    """Return the (n, 3) points of a cloud or vertices of a mesh."""
    return np.asarray(shown.points if isinstance(shown, PointCloud) else shown.vertices)


def oriented_like(cloud: PointCloud, mesh: SimplexMesh) -> PointCloud:
    """Return a cloud with its normals reversed where they point into a model of it, as some scanners' do."""
    if cloud.normals is None:
        return cloud
    _, nearest = cKDTree(mesh.vertices).query(cloud.points, workers=-1)
    inward = (cloud.normals * mesh.normals[nearest]).sum() < 0
    return replace(cloud, normals=-cloud.normals) if inward else cloud


def geometry(
    shown: Any, level: float | None = None, label: int | None = None, inside: str = "above"
) -> tuple[pv.PolyData, pv.PolyData | None]:
    """Return the geometry to draw, with normals, and the edges of a mesh's polygons or triangles."""
    if isinstance(shown, PointCloud):
        return _cloud(shown), None
    if isinstance(shown, SimplexMesh):
        edges = np.insert(shown.connectivity.edge_vertices.astype(np.int64), 0, 2, axis=1)
        return _fan(shown), pv.PolyData(np.asarray(shown.vertices), lines=edges.ravel())
    if isinstance(shown, Volume):
        surface = isosurface(shown, level, label, inside)
        return _lit(_faces(surface.vertices, surface.faces), SMOOTH), None
    polydata = _faces(shown.vertices, shown.faces)
    return _lit(polydata, CREASE), polydata.extract_all_edges()


def colored(shown: Any, name: str, values: Array) -> pv.PolyData:
    """Return the geometry of a surface or cloud with an array of values or colors at its points."""
    if isinstance(shown, SimplexMesh):
        polydata = _fan(shown, **{name: per_point(shown, values)})
    elif isinstance(shown, PointCloud):
        kept = _kept(len(values))
        polydata = _cloud(shown.selected(kept))
        polydata[name] = np.repeat(values[kept], polydata.n_points // len(kept), axis=0)
    else:
        polydata = _faces(shown.vertices, shown.faces)
        polydata[name] = values
        polydata = _lit(polydata, SMOOTH)
    return polydata


def painted_with(shown: Any, name: str) -> pv.PolyData:
    """Return the geometry of a mesh or cloud with an array of colors at its points, as `colors`."""
    if not isinstance(shown, SimplexMesh):
        return colored(shown, "colors", shown.data[name])
    return _fan(shown, colors=shown.triangulated().data[name])


def _fan(mesh: SimplexMesh, **arrays: Array) -> pv.PolyData:
    """Return a mesh as triangles with normals and arrays at their points, which are several along creases."""
    fan = mesh.triangulated(method="fan")
    polydata = _faces(fan.vertices, fan.faces)
    for name, values in arrays.items():
        polydata[name] = values
    if "crease" in mesh.data:
        return _lit(polydata, CREASE)
    return _with_normals(polydata, per_point(mesh, mesh.normals))


def vertex_cells(shown: TriangleMesh, name: str, colors: Array) -> pv.PolyData:
    """Return a surface divided into barycentric cells of the vertices, so that colors of classes do not blend."""
    faces = shown.faces
    a, b, c = faces, np.roll(faces, -1, axis=1), np.roll(faces, 1, axis=1)

    def corners(values: Array) -> Array:
        middle = values[faces].mean(axis=1, keepdims=True) + np.zeros((1, 3, 1))
        parts = values[a], 0.5 * (values[a] + values[b]), middle, 0.5 * (values[a] + values[c])
        return np.stack(parts, axis=2).reshape(-1, 3)

    points = corners(shown.vertices)
    polydata = _faces(points, np.arange(len(points)).reshape(-1, 4))
    polydata[name] = np.repeat(colors[faces].reshape(-1, 3), 4, axis=0)
    return _with_normals(polydata, corners(shown.vertex_normals))


def per_point(mesh: SimplexMesh, values: Array) -> Array:
    """Return values of vertices with their mean over each face appended, for the centroids of the fan."""
    topology = mesh.connectivity
    means = face_centroids(values, topology.face_vertices, topology.face_offsets)
    return np.concatenate([values, means[~topology.face_is_hole]])


def _faces(vertices: Array, faces: NDArray[np.integer[Any]]) -> pv.PolyData:
    return pv.PolyData.from_regular_faces(np.asarray(vertices), np.asarray(faces))


def _with_normals(polydata: pv.PolyData, normals: Array) -> pv.PolyData:
    polydata.point_data.set_array(normals, "Normals")  # not the scalars too, as then pages have no normals
    polydata.point_data.active_normals_name = "Normals"
    return polydata


def _lit(polydata: pv.PolyData, crease: float) -> pv.PolyData:
    """Return a surface with vertex normals, its vertices split at edges sharper than the feature angle in degrees."""
    return polydata.compute_normals(
        cell_normals=False,
        split_vertices=True,
        feature_angle=crease,
        consistent_normals=False,
        auto_orient_normals=False,
    )


def _kept(count: int) -> Indices:
    if count <= MOST_POINTS:
        return np.arange(count)
    return np.random.default_rng(0).choice(count, MOST_POINTS, replace=False)


def _cloud(cloud: PointCloud) -> pv.PolyData:
    """Return points; with normals, as small disks perpendicular to them, for shading and hidden-surface removal."""
    kept = _kept(len(cloud.points))
    points, normals = cloud.points[kept], None if cloud.normals is None else cloud.normals[kept]
    if normals is None or len(points) < 4:
        return pv.PolyData(points)
    spacing = cKDTree(points).query(points, k=4, workers=-1)[0][:, 3]
    radius = 0.5 * np.minimum(spacing, 3 * np.median(spacing))
    side, other = tangents(normals)
    turns = 2 * np.pi * np.arange(CORNERS) / CORNERS
    around = np.cos(turns)[:, None] * side[:, None] + np.sin(turns)[:, None] * other[:, None]
    corners = (points[:, None] + radius[:, None, None] * around).reshape(-1, 3)
    disks = _faces(corners, np.arange(len(corners)).reshape(-1, CORNERS))
    return _with_normals(disks, np.repeat(normals, CORNERS, axis=0))


def isosurface(volume: Volume, level: float | None, label: int | None, inside: str = "above") -> TriangleMesh:
    """Return the isosurface of a level or a label of a volume, padded so that objects at its border are closed."""
    if level is None or label is not None:
        mask = volume.mask(_label(volume, label))
        box = box_around(mask.values > 0)
        assert box is not None  # `mask` refuses labels that are absent
        values, offset = np.pad(mask.values[box_slices(*box, mask.shape)].astype(np.float32), 1), box[0] - 1.0
        level, inside = 0.5, "above"
    else:
        low, high = volume.range
        level = checks.number("level", level, low, high)
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
