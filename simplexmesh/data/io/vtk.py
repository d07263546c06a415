"""Conversion from VTK data sets, and VTK's file readers."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkSTLReader
from vtkmodules.vtkIOXML import vtkXMLImageDataReader, vtkXMLPolyDataReader

from simplexmesh._base.arrays import Array, Indices, Indices32
from simplexmesh._base.errors import warn
from simplexmesh._base.named_arrays import is_color
from simplexmesh._base.units import known_unit
from simplexmesh.data.io.integrity import apart, obj, xml
from simplexmesh.data.io.polydata import (
    BOOLS,
    CONTOURS,
    HOLES,
    TWIN,
    TYPES,
    UNIT,
    captured_output,
    vtk_reason,
)
from simplexmesh.data.io.polygons import strips, triangulated
from simplexmesh.data.points import PointCloud, cloud_of_file
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.simplex_mesh import SimplexMesh

_READERS: dict[str, Callable[[], Any]] = {
    "vti": vtkXMLImageDataReader,
    "vtp": vtkXMLPolyDataReader,
    "stl": vtkSTLReader,
    "obj": vtkOBJReader,
}


def read_dataset(path: Path, kind: str) -> Any:
    """Return the VTK data set in a file, or raise what VTK prints; one that may end the process is read in another."""
    plain = {"vtp": xml.is_plain, "vti": xml.is_plain, "vtk": lambda _: False, "obj": obj.is_plain}.get(kind)
    if plain is None or plain(path):
        return _dataset(path, kind, path.name)
    with apart.sound_copy(path, kind) as copy:
        if not xml.is_plain(copy):
            raise OSError(f"{path.name} cannot be read as {kind.upper()}: it is damaged")
        return _dataset(copy, copy.suffix[1:], path.name)


def _dataset(path: Path, kind: str, name: str) -> Any:
    """Return the VTK data set in a file that does no harm to VTK; `name` is what messages call it."""
    reader = _READERS[kind]()
    reader.SetFileName(str(path))
    with captured_output() as output:
        reader.Update()
    complaint = output.GetOutput().strip()
    if complaint or reader.GetErrorCode():
        raise OSError(f"{name} cannot be read as {kind.upper()}: {vtk_reason(complaint).replace(str(path), name)}")
    out = reader.GetOutput()
    if out is None or not out.GetNumberOfPoints():
        raise OSError(f"{name} holds no points, or is damaged")
    if out.IsA("vtkPolyData") and not out.GetNumberOfCells():
        warn(f"{name} holds {out.GetNumberOfPoints():,} points but no polygons: it may be truncated")
    return out


def from_dataset(dataset: Any, name: str, *, owned: bool = False) -> Volume | TriangleMesh | PointCloud | SimplexMesh:
    """Return what a VTK data set holds; with `owned`, nothing else refers to it, and samples are not copied."""
    if dataset.IsA("vtkImageData"):
        return _volume(dataset, name, owned=owned)
    if not dataset.IsA("vtkPolyData"):
        raise TypeError(f"{name} must be a VTK image or polygons (vtkPolyData), not {dataset.GetClassName()}")
    if dataset.GetFieldData().HasArray(TWIN):
        topology, types = _topology(dataset, name)
        if _has_polygons(dataset, topology):
            return _simplex_mesh(dataset, name, topology, types)
        warn(f"{name}: the polygons are no longer those of the simplex mesh they were, and are read as triangles")
    if dataset.GetNumberOfPolys() or dataset.GetNumberOfStrips():
        return _triangles(dataset)
    normals = dataset.GetPointData().GetNormals()
    normals = None if normals is None else vtk_to_numpy(normals).astype(float)
    return cloud_of_file(name, _points(dataset), normals, _data(dataset), _unit(dataset))


def _data(dataset: Any) -> dict[str, NDArray[Any]]:
    """Return the arrays of the points, but normals, coordinates in a texture, and arrays that VTK does not name."""
    given = dataset.GetPointData()
    other = {each.GetName() for each in (given.GetNormals(), given.GetTCoords()) if each is not None}
    found, bools = {}, _texts(dataset, BOOLS)
    for array in _number_arrays(given):
        if (
            array.GetName()
            and array.GetName() not in other
            and array.GetNumberOfTuples() == dataset.GetNumberOfPoints()
        ):
            values = np.array(vtk_to_numpy(array))
            if array.GetName() in bools and values.dtype == np.uint8 and values.max(initial=0) <= 1:
                values = values.view(bool)
            found["colors" if array.GetName() in ("RGB", "RGBA") and is_color(values) else array.GetName()] = values
    return found


def _unit(dataset: Any) -> str | None:
    """Return the unit of length that the field data names."""
    texts = _texts(dataset, UNIT)
    return known_unit(texts[0]) if texts else None


def _texts(dataset: Any, name: str) -> list[str]:
    """Return the texts of an array of the field data, none if it has no such array."""
    array = dataset.GetFieldData().GetAbstractArray(name)
    known = array is not None and array.IsA("vtkStringArray")
    return [array.GetValue(i) for i in range(array.GetNumberOfValues())] if known else []


def _points(dataset: Any) -> Array:
    points = dataset.GetPoints()
    if points is None or not points.GetNumberOfPoints():
        return np.zeros((0, 3))
    return np.asarray(vtk_to_numpy(points.GetData()), dtype=np.float64)


def _triangles(dataset: Any) -> TriangleMesh:
    points, (flat, ends), (bands, last) = _points(dataset), _cells(dataset, "Polys"), _cells(dataset, "Strips")
    cut = [triangulated(points, np.diff(ends), flat), strips(np.insert(bands, last[1:], -1))]
    return TriangleMesh(points, np.concatenate(cut), _data(dataset), _unit(dataset))


def _cells(dataset: Any, kind: str) -> tuple[Indices, Indices]:
    """Return the corners of polygons or strips, one after the other, and where each ends, after a 0."""
    cells = getattr(dataset, f"Get{kind}")()
    corners, ends = (
        vtk_to_numpy(array).astype(np.int64) for array in (cells.GetConnectivityArray(), cells.GetOffsetsArray())
    )  # VTK does not check them, and would read outside its memory
    if ends[0] != 0 or ends[-1] != len(corners) or (ends[1:] < ends[:-1]).any():
        raise ValueError(f"faces must end one after the other, at corner {len(corners)} of {len(corners)}")
    if len(corners) and not 0 <= corners.min() <= corners.max() < dataset.GetNumberOfPoints():
        raise ValueError(f"faces refer to points outside 0..{dataset.GetNumberOfPoints() - 1}")
    return corners, ends


def _volume(image: Any, name: str, *, owned: bool) -> Volume:
    on_points, on_cells = _number_arrays(image.GetPointData()), _number_arrays(image.GetCellData())
    centered = not on_points
    own = on_points or on_cells
    if not own:
        raise ValueError(f"{name} must hold samples, it has none")
    active = (image.GetCellData() if centered else image.GetPointData()).GetScalars()
    array = active if active is not None else next((a for a in own if a.GetNumberOfComponents() == 1), own[0])
    if array.GetNumberOfComponents() != 1:
        raise ValueError(f"{name} must hold one number per voxel, not {array.GetNumberOfComponents()}")
    shape = np.array(image.GetDimensions()) - centered
    if array.GetNumberOfTuples() != np.prod(shape):
        raise OSError(f"{name} must hold {np.prod(shape)} samples, not {array.GetNumberOfTuples()}")
    values = vtk_to_numpy(array).reshape(shape, order="F")
    values.setflags(write=not owned)
    others = [a for a in on_points + on_cells if a.GetNumberOfComponents() == 1 and a is not array]
    if others:
        which = "first" if active is None else "active"
        left = ", ".join(repr(other.GetName()) for other in others)
        warn(f"{name} holds several arrays: {array.GetName()!r}, the {which} one, was read, not {left}")
    matrix = image.GetDirectionMatrix()
    direction = np.array([[matrix.GetElement(i, j) for j in range(3)] for i in range(3)])
    spacing = np.array(image.GetSpacing())
    first = np.array(image.GetExtent()[::2]) + 0.5 * centered
    origin = np.array(image.GetOrigin()) + direction @ (spacing * first)
    return Volume(values, spacing, origin, direction, _unit(image))


def _number_arrays(data: Any) -> list[Any]:
    """Return the arrays of numbers: for one of words VTK returns None."""
    arrays = [data.GetArray(i) for i in range(data.GetNumberOfArrays())]
    return [array for array in arrays if array is not None]


def _topology(dataset: Any, name: str) -> tuple[Connectivity, dict[str, Any]]:
    """Return the topology of a simplex mesh stored with its polygons, and the types of its data."""
    fields = dataset.GetFieldData()
    try:
        types = dict(json.loads(fields.GetAbstractArray(TYPES).GetValue(0)))
        twin = np.array(vtk_to_numpy(fields.GetArray(TWIN))).reshape(-1, 3)
        holes = fields.GetArray(HOLES)
        hole_darts: Indices32 = np.array([] if holes is None else vtk_to_numpy(holes), np.int32).reshape(-1)
        found = fields.GetAbstractArray(CONTOURS)
        listed = {} if found is None else dict(json.loads(found.GetValue(0)))
        contours = {contour: np.array(darts, np.int64).reshape(-1) for contour, darts in listed.items()}
    except (AttributeError, ValueError, TypeError):
        raise OSError(f"{name} is a simplex mesh with damaged topology or arrays") from None
    return Connectivity(twin, hole_darts, contours), types


def _has_polygons(dataset: Any, topology: Connectivity) -> bool:
    """Whether the polygons are the faces of a simplex mesh: filters of VTK change polygons but keep the topology."""
    surface = ~topology.face_is_hole
    ends = np.concatenate([[0], np.cumsum(topology.face_sizes[surface])])
    corners = topology.face_vertices[np.repeat(surface, topology.face_sizes)]
    cells = dataset.GetPolys()
    return (
        dataset.GetNumberOfPoints() == topology.n_vertices
        and np.array_equal(vtk_to_numpy(cells.GetOffsetsArray()), ends)
        and np.array_equal(vtk_to_numpy(cells.GetConnectivityArray()), corners)
    )


def _simplex_mesh(dataset: Any, name: str, topology: Connectivity, types: dict[str, Any]) -> SimplexMesh:
    data = {}
    try:
        for key, (kind, shape) in types.items():
            values = np.array(vtk_to_numpy(dataset.GetPointData().GetArray(key)))
            values = values.view(bool) if np.dtype(kind) == bool else values.astype(kind)
            data[key] = values.reshape(len(values), *shape)
    except (AttributeError, ValueError, TypeError):
        raise OSError(f"{name} is a simplex mesh with damaged topology or arrays") from None
    return SimplexMesh(_points(dataset), topology, data, _unit(dataset))
