"""VTK's files and objects: the one door of this chapter to VTK and PyVista."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow
from vtkmodules.vtkFiltersCore import vtkTriangleFilter
from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkSTLReader
from vtkmodules.vtkIOLegacy import vtkDataSetReader
from vtkmodules.vtkIOXML import vtkXMLImageDataReader, vtkXMLPolyDataReader

from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume

_READERS: dict[str, Callable[[], Any]] = {
    "vti": vtkXMLImageDataReader,
    "vtp": vtkXMLPolyDataReader,
    "vtk": vtkDataSetReader,
    "stl": vtkSTLReader,
    "obj": vtkOBJReader,
}


def read_dataset(path: Path, kind: str) -> Any:
    """Return the VTK data set in a file, with VTK's own complaints turned into an error.

    Raises
    ------
    OSError
        The file is damaged or truncated.
    """
    reader = _READERS[kind]()
    reader.SetFileName(str(path))
    before = vtkOutputWindow.GetInstance()
    said = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(said)
    try:
        reader.Update()
    finally:
        vtkOutputWindow.SetInstance(before)
    complaint = said.GetOutput().strip()
    if complaint or reader.GetErrorCode():
        raise OSError(f"{path.name} cannot be read as {kind.upper()}: {_reason(complaint)}")
    out = reader.GetOutput()
    if out is None or not out.GetNumberOfPoints():
        raise OSError(f"{path.name} holds no points, or is damaged")
    return out


def from_dataset(dataset: Any, name: str) -> Volume | TriangleMesh | PointCloud:
    """Return a VTK image as a Volume, polygons as a TriangleMesh, points alone as a PointCloud.

    Raises
    ------
    TypeError
        It is another kind of VTK data set.
    """
    if dataset.IsA("vtkImageData"):
        return _volume(dataset, name)
    if not dataset.IsA("vtkPolyData"):
        raise TypeError(f"{name} must be a VTK image or polygons (vtkPolyData), not {dataset.GetClassName()}")
    if dataset.GetNumberOfPolys() or dataset.GetNumberOfStrips():
        return _triangles(dataset)
    normals = dataset.GetPointData().GetNormals()
    return PointCloud(_points(dataset), None if normals is None else vtk_to_numpy(normals).astype(float))


def _points(dataset: Any) -> NDArray[np.float64]:
    points = dataset.GetPoints()
    if points is None or not points.GetNumberOfPoints():
        return np.zeros((0, 3))
    return np.asarray(vtk_to_numpy(points.GetData()), dtype=np.float64)


def _triangles(dataset: Any) -> TriangleMesh:
    cutter = vtkTriangleFilter()
    cutter.SetInputData(dataset)
    cutter.PassVertsOff()
    cutter.PassLinesOff()
    cutter.Update()
    out = cutter.GetOutput()
    corners = vtk_to_numpy(out.GetPolys().GetConnectivityArray()).astype(np.int64)
    return TriangleMesh(_points(out), corners.reshape(-1, 3))


def _volume(image: Any, name: str) -> Volume:
    points = image.GetPointData()
    on_cells = not points.GetNumberOfArrays()
    data = image.GetCellData() if on_cells else points
    array = data.GetScalars() or data.GetArray(0)
    if array is None:
        raise ValueError(f"{name} must hold samples, it has none")
    if array.GetNumberOfComponents() != 1:
        raise ValueError(f"{name} must hold one number per voxel, not {array.GetNumberOfComponents()}")
    shape = np.array(image.GetDimensions()) - on_cells
    if array.GetNumberOfTuples() != np.prod(shape):
        raise OSError(f"{name} must hold {np.prod(shape)} samples, not {array.GetNumberOfTuples()}")
    values = vtk_to_numpy(array).reshape(shape, order="F")
    values.setflags(write=False)
    matrix = image.GetDirectionMatrix()
    direction = np.array([[matrix.GetElement(i, j) for j in range(3)] for i in range(3)])
    spacing = np.array(image.GetSpacing())
    first = np.array(image.GetExtent()[::2]) + 0.5 * on_cells
    origin = np.array(image.GetOrigin()) + direction @ (spacing * first)
    return Volume(values, spacing, origin, direction)


def _reason(complaint: str) -> str:
    lines = [line.strip() for line in complaint.splitlines() if line.strip()]
    lines = [line for line in lines if not line.startswith(("ERROR:", "Warning:", "Generic Warning:"))]
    text = lines[0] if lines else "it is damaged"
    return text.split("): ", 1)[-1].rstrip(".")
