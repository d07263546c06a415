"""Conversion to and from VTK data sets, and VTK's file readers and writers."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkPoints, vtkStringArray, vtkStringOutputWindow
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkTriangleFilter
from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkSTLReader
from vtkmodules.vtkIOLegacy import vtkDataSetReader
from vtkmodules.vtkIOXML import vtkXMLImageDataReader, vtkXMLPolyDataReader, vtkXMLPolyDataWriter

from simplexmesh.data.points import PointCloud, cloud_of_file
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume
from simplexmesh.errors import warn
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.simplex_mesh import SimplexMesh

_TWIN, _HOLES, _TYPES = "simplexmesh_twin", "simplexmesh_hole_darts", "simplexmesh_types"

_READERS: dict[str, Callable[[], Any]] = {
    "vti": vtkXMLImageDataReader,
    "vtp": vtkXMLPolyDataReader,
    "vtk": vtkDataSetReader,
    "stl": vtkSTLReader,
    "obj": vtkOBJReader,
}


def read_dataset(path: Path, kind: str) -> Any:
    """Return the VTK data set in a file; errors that VTK prints are raised.

    Raises
    ------
    OSError
        The file is damaged or truncated.
    """
    reader = _READERS[kind]()
    reader.SetFileName(str(path))
    if kind == "vtk":
        reader.ReadAllScalarsOn()
    with _captured_output() as output:
        reader.Update()
    complaint = output.GetOutput().strip()
    if complaint or reader.GetErrorCode():
        raise OSError(
            f"{path.name} cannot be read as {kind.upper()}: {_reason(complaint).replace(str(path), path.name)}"
        )
    out = reader.GetOutput()
    if out is None or not out.GetNumberOfPoints():
        raise OSError(f"{path.name} holds no points, or is damaged")
    if out.IsA("vtkPolyData") and not out.GetNumberOfCells():
        warn(f"{path.name} holds {out.GetNumberOfPoints():,} points but no polygons: it may be truncated")
    return out


def from_dataset(dataset: Any, name: str, *, owned: bool = False) -> Volume | TriangleMesh | PointCloud | SimplexMesh:
    """Return a VTK image as a Volume, polygons as a TriangleMesh, and points without polygons as a PointCloud.

    Polygons that `polydata` made of a simplex mesh are converted back to that mesh, unless a filter has changed them.
    With `owned`, the samples of an image are not copied: nothing else may refer to it.

    Raises
    ------
    TypeError
        It is another type of VTK data set.

    Warns
    -----
    SimplexMeshWarning
        The polygons of a simplex mesh were changed.
    """
    if dataset.IsA("vtkImageData"):
        return _volume(dataset, name, owned=owned)
    if not dataset.IsA("vtkPolyData"):
        raise TypeError(f"{name} must be a VTK image or polygons (vtkPolyData), not {dataset.GetClassName()}")
    if dataset.GetFieldData().HasArray(_TWIN):
        topology, types = _topology(dataset, name)
        if _has_polygons(dataset, topology):
            return _simplex_mesh(dataset, name, topology, types)
        warn(f"{name}: the polygons are no longer those of the simplex mesh they were, and are read as triangles")
    if dataset.GetNumberOfPolys() or dataset.GetNumberOfStrips():
        return _triangles(dataset)
    normals = dataset.GetPointData().GetNormals()
    return cloud_of_file(name, _points(dataset), None if normals is None else vtk_to_numpy(normals).astype(float))


def _points(dataset: Any) -> NDArray[np.float64]:
    points = dataset.GetPoints()
    if points is None or not points.GetNumberOfPoints():
        return np.zeros((0, 3))
    return np.asarray(vtk_to_numpy(points.GetData()), dtype=np.float64)


def _triangles(dataset: Any) -> TriangleMesh:
    for cells in (dataset.GetPolys(), dataset.GetStrips()):
        corners = vtk_to_numpy(cells.GetConnectivityArray())
        ends = vtk_to_numpy(cells.GetOffsetsArray())  # VTK does not check them, and would read outside its memory
        if ends[0] != 0 or ends[-1] != len(corners) or (ends[1:] < ends[:-1]).any():
            raise ValueError(f"faces must end one after the other, at corner {len(corners)} of {len(corners)}")
        if len(corners) and not 0 <= corners.min() <= corners.max() < dataset.GetNumberOfPoints():
            raise ValueError(f"faces refer to points outside 0..{dataset.GetNumberOfPoints() - 1}")
    cutter = vtkTriangleFilter()
    cutter.SetInputData(dataset)
    cutter.PassVertsOff()
    cutter.PassLinesOff()
    cutter.Update()
    out = cutter.GetOutput()
    corners = vtk_to_numpy(out.GetPolys().GetConnectivityArray()).astype(np.int64)
    return TriangleMesh(_points(out), corners.reshape(-1, 3))


def polygon_triangles(
    points: NDArray[np.float64], sizes: NDArray[Any], corners: NDArray[Any]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return triangles (t, 3) of polygons by ear clipping, and the polygon of each; see `polydata` for the arguments.

    Polygons that VTK cannot cut have none, or not all.
    """
    dataset = polydata(points, sizes, corners, {})
    dataset.GetCellData().AddArray(_array("polygon", np.arange(len(sizes))))
    cutter = vtkTriangleFilter()
    cutter.SetInputData(dataset)
    with _captured_output():
        cutter.Update()
    out = cutter.GetOutput()
    triangles = vtk_to_numpy(out.GetPolys().GetConnectivityArray()).astype(np.int64).reshape(-1, 3)
    return triangles, vtk_to_numpy(out.GetCellData().GetArray("polygon")).astype(np.int64)


def _volume(image: Any, name: str, *, owned: bool) -> Volume:
    points = image.GetPointData()
    on_cells = not points.GetNumberOfArrays()
    data = image.GetCellData() if on_cells else points
    single = _single_arrays(data)
    active = data.GetScalars()
    array = active if active is not None else single[0] if single else data.GetArray(0)
    if array is None:
        raise ValueError(f"{name} must hold samples, it has none")
    if array.GetNumberOfComponents() != 1:
        raise ValueError(f"{name} must hold one number per voxel, not {array.GetNumberOfComponents()}")
    shape = np.array(image.GetDimensions()) - on_cells
    if array.GetNumberOfTuples() != np.prod(shape):
        raise OSError(f"{name} must hold {np.prod(shape)} samples, not {array.GetNumberOfTuples()}")
    values = vtk_to_numpy(array).reshape(shape, order="F")
    values.setflags(write=not owned)
    others = [
        other for other in single + ([] if on_cells else _single_arrays(image.GetCellData())) if other is not array
    ]
    if others:
        which = "first" if active is None else "active"
        left = ", ".join(repr(other.GetName()) for other in others)
        warn(f"{name} holds several arrays: {array.GetName()!r}, the {which} one, was read, not {left}")
    matrix = image.GetDirectionMatrix()
    direction = np.array([[matrix.GetElement(i, j) for j in range(3)] for i in range(3)])
    spacing = np.array(image.GetSpacing())
    first = np.array(image.GetExtent()[::2]) + 0.5 * on_cells
    origin = np.array(image.GetOrigin()) + direction @ (spacing * first)
    return Volume(values, spacing, origin, direction)


def _single_arrays(data: Any) -> list[Any]:
    """Return the arrays of numbers with one component."""
    arrays = [data.GetArray(i) for i in range(data.GetNumberOfArrays())]
    return [array for array in arrays if array is not None and array.GetNumberOfComponents() == 1]


def _reason(complaint: str) -> str:
    lines = [line.strip() for line in complaint.splitlines() if line.strip()]
    lines = [line for line in lines if not line.startswith(("ERROR:", "Warning:", "Generic Warning:"))]
    text = lines[0] if lines else "it is damaged"
    return text.split("): ", 1)[-1].rstrip(".")


@contextmanager
def _captured_output() -> Iterator[Any]:
    """Capture what VTK would print."""
    before = vtkOutputWindow.GetInstance()
    output = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(output)
    verbosity = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        yield output
    finally:
        vtkLogger.SetStderrVerbosity(verbosity)
        vtkOutputWindow.SetInstance(before)


def polydata(
    points: NDArray[np.float64],
    sizes: NDArray[Any],
    corners: NDArray[Any],
    data: Mapping[str, NDArray[Any]],
    topology: Connectivity | None = None,
) -> Any:
    """Return a `vtkPolyData` of polygons, or of points if there are none.

    Parameters
    ----------
    points : (n, 3) array of float
    sizes : (f,) array of int
        Number of corners of each polygon.
    corners : (sum of sizes,) array of int
        Their corners, polygon by polygon.
    data : mapping of str to (n, ...) array
        Point data.
    topology : Connectivity, optional
        Topology of a simplex mesh, stored as field data, so that `from_dataset` returns the identical mesh.
    """
    out = vtkPolyData()
    positions = vtkPoints()
    positions.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
    out.SetPoints(positions)
    if not len(sizes):
        out.SetVerts(_cells(np.arange(len(points) + 1), np.arange(len(points))))
    else:
        out.SetPolys(_cells(np.concatenate([[0], np.cumsum(sizes)]), corners))
    for name, values in data.items():
        out.GetPointData().AddArray(_array(name, values))
    if "Normals" in data and topology is None:
        out.GetPointData().SetActiveNormals("Normals")
    if topology is not None:
        types = vtkStringArray()
        types.SetName(_TYPES)
        types.InsertNextValue(json.dumps({name: [a.dtype.str, a.shape[1:]] for name, a in data.items()}))
        out.GetFieldData().AddArray(types)
        out.GetFieldData().AddArray(_array(_TWIN, topology.twin))
        out.GetFieldData().AddArray(_array(_HOLES, topology.hole_darts))
    return out


def write_vtp(path: Path, dataset: Any) -> None:
    """Write polygons to a VTP file, binary and compressed; names of point data are escaped, which VTK does not do.

    Raises
    ------
    OSError
        VTK could not write it.
    """
    for i in range(dataset.GetPointData().GetNumberOfArrays()):
        array = dataset.GetPointData().GetAbstractArray(i)
        array.SetName(escape(array.GetName(), {'"': "&quot;", "\n": "&#10;", "\t": "&#9;", "\r": "&#13;"}))
    writer = vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(dataset)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToZLib()
    with _captured_output() as output:
        written = writer.Write()
    if not written or output.GetOutput().strip():
        raise OSError(f"the file cannot be written: {_reason(output.GetOutput())}")


def _cells(offsets: NDArray[Any], corners: NDArray[Any]) -> Any:
    cells = vtkCellArray()
    offsets, corners = (numpy_to_vtk(np.ascontiguousarray(a, dtype=np.int64), deep=True) for a in (offsets, corners))
    cells.SetData(offsets, corners)
    return cells


def _array(name: str, values: NDArray[Any]) -> Any:
    """Return a VTK array; bool is stored as bytes, and float types unknown to VTK as single or double."""
    if values.dtype.kind == "f" and values.dtype.itemsize not in (4, 8):
        values = values.astype(np.float32 if values.dtype.itemsize == 2 else np.float64)
    values = (
        values.view(np.uint8) if values.dtype == bool else values.astype(values.dtype.newbyteorder("="), copy=False)
    )
    out = numpy_to_vtk(np.ascontiguousarray(values).reshape(len(values), int(np.prod(values.shape[1:]))), deep=True)
    out.SetName(name)
    return out


def _topology(dataset: Any, name: str) -> tuple[Connectivity, dict[str, Any]]:
    """Return the topology of a simplex mesh stored with its polygons, and the types of its data."""
    fields = dataset.GetFieldData()
    try:
        types = dict(json.loads(fields.GetAbstractArray(_TYPES).GetValue(0)))
        twin = np.array(vtk_to_numpy(fields.GetArray(_TWIN))).reshape(-1, 3)
        holes = fields.GetArray(_HOLES)
        hole_darts: NDArray[np.int32] = np.array([] if holes is None else vtk_to_numpy(holes), np.int32).reshape(-1)
    except (AttributeError, ValueError, TypeError):
        raise OSError(f"{name} is a simplex mesh with damaged topology or arrays") from None
    return Connectivity(twin, hole_darts), types


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
    return SimplexMesh(_points(dataset), topology, data)
