"""Polygons with all they have, as data sets of VTK and PyVista and VTP files, and what VTK prints."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkPoints, vtkStringArray, vtkStringOutputWindow
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkTriangleFilter
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh.mesh.connectivity import Connectivity

TWIN, HOLES, TYPES = "simplexmesh_twin", "simplexmesh_hole_darts", "simplexmesh_types"
CONTOURS = "simplexmesh_contours"
UNIT, BOOLS = "unit", "simplexmesh_bools"


@dataclass(frozen=True, eq=False)
class Polygons:
    """What is written: points, polygons (possibly none), normals, point data, unit, and a simplex mesh's topology."""

    points: Array
    sizes: NDArray[Any]
    corners: NDArray[Any]
    normals: Array | None = None
    data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    unit: str | None = None
    topology: Connectivity | None = None
    triangles: Any = None  # a function that returns them as a TriangleMesh

    @staticmethod
    def of(value: Any) -> Polygons:
        """Return those of a simplex mesh, a triangle mesh or a cloud."""
        if hasattr(value, "connectivity"):
            topology = value.connectivity
            surface = ~topology.face_is_hole
            corners = topology.face_vertices[np.repeat(surface, topology.face_sizes)]
            sizes = topology.face_sizes[surface]
            data = value.data, value.unit
            return Polygons(value.vertices, sizes, corners, None, *data, topology, value.triangulated)
        if hasattr(value, "vertices") and hasattr(value, "faces"):
            sizes, corners = np.full(len(value.faces), 3), value.faces.ravel()
            return Polygons(value.vertices, sizes, corners, None, value.data, value.unit, triangles=lambda: value)
        if hasattr(value, "points") and hasattr(value, "normals"):
            none = np.zeros(0, dtype=np.int64)
            return Polygons(value.points, none, none, value.normals, value.data, value.unit)
        raise TypeError(f"value must be a SimplexMesh, TriangleMesh or PointCloud, not {checks.type_name(value)}")

    @property
    def loops(self) -> Iterator[list[int]]:
        """The corners of each polygon."""
        flat, at = self.corners.tolist(), 0
        for size in self.sizes.tolist():
            yield flat[at : at + size]
            at += size

    def dataset(self) -> Any:
        """Return a `vtkPolyData` of the polygons, or of the points without any."""
        out, positions, topology = vtkPolyData(), vtkPoints(), self.topology
        positions.SetData(numpy_to_vtk(np.ascontiguousarray(self.points), deep=True))
        out.SetPoints(positions)
        if not len(self.sizes):
            out.SetVerts(_cells(np.arange(len(self.points) + 1), np.arange(len(self.points))))
        else:
            out.SetPolys(_cells(np.concatenate([[0], np.cumsum(self.sizes)]), self.corners))
        data = dict(self.data) | ({} if self.normals is None else {"Normals": self.normals})
        for name, values in data.items():
            out.GetPointData().AddArray(vtk_array(name, values))
        if "Normals" in data and topology is None:
            out.GetPointData().SetActiveNormals("Normals")
        if self.unit is not None:
            out.GetFieldData().AddArray(_text_array(UNIT, self.unit))
        if topology is None and (bools := [name for name, values in data.items() if values.dtype == bool]):
            out.GetFieldData().AddArray(_text_array(BOOLS, *bools))
        if topology is not None:
            types = json.dumps({name: [a.dtype.str, a.shape[1:]] for name, a in data.items()})
            out.GetFieldData().AddArray(_text_array(TYPES, types))
            out.GetFieldData().AddArray(vtk_array(TWIN, topology.twin))
            out.GetFieldData().AddArray(vtk_array(HOLES, topology.hole_darts))
            if topology.contour_darts:
                contours = {name: darts.tolist() for name, darts in topology.contour_darts.items()}
                out.GetFieldData().AddArray(_text_array(CONTOURS, json.dumps(contours)))
        return out


def polygon_triangles(points: Array, sizes: NDArray[Any], corners: NDArray[Any]) -> tuple[Indices, Indices]:
    """Return triangles (t, 3) of polygons by ear clipping, and the polygon of each; given as to `Polygons`."""
    dataset = Polygons(points, sizes, corners).dataset()
    dataset.GetCellData().AddArray(vtk_array("polygon", np.arange(len(sizes))))
    cutter = vtkTriangleFilter()
    cutter.SetInputData(dataset)
    with captured_output():
        cutter.Update()
    out = cutter.GetOutput()
    triangles = vtk_to_numpy(out.GetPolys().GetConnectivityArray()).astype(np.int64).reshape(-1, 3)
    return triangles, vtk_to_numpy(out.GetCellData().GetArray("polygon")).astype(np.int64)


def _text_array(name: str, *texts: str) -> Any:
    out = vtkStringArray()
    out.SetName(name)
    for text in texts:
        out.InsertNextValue(text)
    return out


def write_vtp(path: Path, content: Polygons) -> None:
    """Write polygons to a VTP file, binary and compressed; names of point data are escaped, which VTK does not do."""
    for name, values in content.data.items():
        if not name or any(ord(letter) < 32 and letter not in "\t\n\r" for letter in name):
            raise ValueError(f"arrays must have printable names to be saved as VTP, not {name!r}")
        if not values[0].size:
            raise ValueError(f"array {name!r} must have columns to be saved as VTP, not shape {values.shape}")
    dataset = content.dataset()
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
    text = re.sub(r" ?\(0x[0-9a-f]+\)", "", lines[0].split("): ", 1)[-1]) if lines else "Algorithm"
    if text.startswith("Algorithm"):  # which says what VTK did, not what the file lacks
        return "it is damaged"
    return re.split(r"\.(?:\s|$)", text)[0][:200]  # it quotes words of the file, which may have any length


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


def to_pyvista(value: Any) -> Any:
    """Return a `pyvista.ImageData` of a volume, a `PolyData` of a mesh (a simplex mesh without its holes) or cloud."""
    import pyvista

    if not hasattr(value, "spacing"):
        return pyvista.PolyData(Polygons.of(value).dataset(), deep=False)
    out = pyvista.ImageData(dimensions=value.shape, spacing=value.spacing, origin=value.origin)
    out.direction_matrix = value.direction
    out.point_data["values"] = value.values.flatten(order="F")
    if value.unit is not None:
        out.field_data[UNIT] = [value.unit]
    return out


def polylines(points: Array, cells: NDArray[Any]) -> Any:
    """Return a `pyvista.PolyData` of lines, each the number of its points (at least two) and their indices."""
    import pyvista

    return pyvista.PolyData(points, lines=cells) if len(cells) else pyvista.PolyData()
