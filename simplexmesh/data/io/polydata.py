"""Conversion to VTK data sets, the writers of VTK, and what VTK prints; knows no class of data."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkPoints, vtkStringArray, vtkStringOutputWindow
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

from simplexmesh._base.arrays import Array
from simplexmesh.mesh.connectivity import Connectivity

TWIN, HOLES, TYPES = "simplexmesh_twin", "simplexmesh_hole_darts", "simplexmesh_types"
CONTOURS = "simplexmesh_contours"
UNIT = "unit"


def polydata(
    points: Array,
    sizes: NDArray[Any],
    corners: NDArray[Any],
    data: Mapping[str, NDArray[Any]],
    topology: Connectivity | None = None,
    unit: str | None = None,
) -> Any:
    """Return a `vtkPolyData` of polygons given by their sizes (f,) and all their corners, or of points without any."""
    out = vtkPolyData()
    positions = vtkPoints()
    positions.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
    out.SetPoints(positions)
    if not len(sizes):
        out.SetVerts(_cells(np.arange(len(points) + 1), np.arange(len(points))))
    else:
        out.SetPolys(_cells(np.concatenate([[0], np.cumsum(sizes)]), corners))
    for name, values in data.items():
        out.GetPointData().AddArray(vtk_array(name, values))
    if "Normals" in data and topology is None:
        out.GetPointData().SetActiveNormals("Normals")
    if unit is not None:
        out.GetFieldData().AddArray(_text_array(UNIT, unit))
    if topology is not None:
        types = json.dumps({name: [a.dtype.str, a.shape[1:]] for name, a in data.items()})
        out.GetFieldData().AddArray(_text_array(TYPES, types))
        out.GetFieldData().AddArray(vtk_array(TWIN, topology.twin))
        out.GetFieldData().AddArray(vtk_array(HOLES, topology.hole_darts))
        if topology.contour_darts:
            contours = {name: darts.tolist() for name, darts in topology.contour_darts.items()}
            out.GetFieldData().AddArray(_text_array(CONTOURS, json.dumps(contours)))
    return out


def _text_array(name: str, text: str) -> Any:
    out = vtkStringArray()
    out.SetName(name)
    out.InsertNextValue(text)
    return out


def write_vtp(path: Path, dataset: Any) -> None:
    """Write polygons to a VTP file, binary and compressed; names of point data are escaped, which VTK does not do."""
    for i in range(dataset.GetPointData().GetNumberOfArrays()):
        array = dataset.GetPointData().GetAbstractArray(i)
        array.SetName(escape(array.GetName(), {'"': "&quot;", "\n": "&#10;", "\t": "&#9;", "\r": "&#13;"}))
    writer = vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(dataset)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToZLib()
    with captured_output() as output:
        written = writer.Write()
    if not written or output.GetOutput().strip():
        raise OSError(f"the file cannot be written: {vtk_reason(output.GetOutput())}")


def _cells(offsets: NDArray[Any], corners: NDArray[Any]) -> Any:
    cells = vtkCellArray()
    offsets, corners = (numpy_to_vtk(np.ascontiguousarray(a, dtype=np.int64), deep=True) for a in (offsets, corners))
    cells.SetData(offsets, corners)
    return cells


def vtk_array(name: str, values: NDArray[Any]) -> Any:
    """Return a VTK array; bool is stored as bytes, and float types unknown to VTK as single or double."""
    if values.dtype.kind == "f" and values.dtype.itemsize not in (4, 8):
        values = values.astype(np.float32 if values.dtype.itemsize == 2 else np.float64)
    values = (
        values.view(np.uint8) if values.dtype == bool else values.astype(values.dtype.newbyteorder("="), copy=False)
    )
    out = numpy_to_vtk(np.ascontiguousarray(values).reshape(len(values), int(np.prod(values.shape[1:]))), deep=True)
    out.SetName(name)
    return out


def vtk_reason(complaint: str) -> str:
    """Return the first sentence of what VTK printed."""
    lines = [line.strip() for line in complaint.splitlines() if line.strip()]
    lines = [line for line in lines if not line.startswith(("ERROR:", "Warning:", "Generic Warning:"))]
    text = lines[0] if lines and not lines[0].startswith("Algorithm") else "it is damaged"
    return re.sub(r" ?\(0x[0-9a-f]+\)", "", text.split("): ", 1)[-1]).rstrip(".")


@contextmanager
def captured_output() -> Iterator[Any]:
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
