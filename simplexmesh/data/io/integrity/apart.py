"""Files of VTK read in another process, which damage may end: what it could read comes back in a file of its own."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

SECONDS, BUSY_SECONDS, BYTES_A_SECOND = 60, 10, 1_000_000
"""Time that any file may take, and time of the processor, which ends the process even if nobody waits for it."""

ROOM, MOST_PACKED = 2 << 30, 1040
"""Memory that any file may need, and for each of its bytes: zlib packs zeros to a thousandth."""


@contextmanager
def sound_copy(path: Path, kind: str) -> Iterator[Path]:
    """Yield a VTP or VTI file with what the reader of VTK understood of a file, or raise with its complaint."""
    from simplexmesh.data.io.polydata import vtk_reason  # here, as the script below knows only VTK

    size = path.stat().st_size
    with tempfile.TemporaryDirectory() as folder:
        libraries = str(Path(sys.modules["vtkmodules"].__path__[0]).parent)
        limits = ROOM + MOST_PACKED * size, BUSY_SECONDS + size // BYTES_A_SECOND
        words = [libraries, kind, str(path), folder, *map(str, limits)]
        try:
            done = subprocess.run(
                [sys.executable, "-I", "-S", __file__, *words],
                capture_output=True,
                timeout=SECONDS + size / BYTES_A_SECOND,
                check=True,
            )
            answer = json.loads(done.stdout)
        except (subprocess.SubprocessError, ValueError):
            raise OSError(f"{path.name} cannot be read as {kind.upper()}: it is damaged") from None
        if "complaint" in answer:
            reason = vtk_reason(answer["complaint"]).replace(str(path), path.name)
            raise OSError(f"{path.name} cannot be read as {kind.upper()}: {reason}")
        if "class" in answer:
            raise OSError(f"{path.name} must be a VTK image or polygons (vtkPolyData), not {answer['class']}")
        yield Path(folder, answer["file"])


def _limit(room: int, seconds: int) -> None:
    """Limit memory and processor time of this process, also for when the one that waits for it is killed."""
    try:
        import resource
    except ImportError:  # on Windows
        return
    for kind, most in ((resource.RLIMIT_CORE, 0), (resource.RLIMIT_CPU, seconds), (resource.RLIMIT_AS, room)):
        with suppress(ValueError, OSError):  # a lower limit is set already, or the system has none, as macOS of memory
            resource.setrlimit(kind, (most, most))


def _main(libraries: str, kind: str, path: str, folder: str, room: str, seconds: str) -> None:
    """Read a file and write it again, and print the name of the new one or what is wrong; run as a script."""
    sys.path.append(libraries)
    _limit(int(room), int(seconds))
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow
    from vtkmodules.vtkIOLegacy import vtkDataSetReader
    from vtkmodules.vtkIOXML import (
        vtkXMLImageDataReader,
        vtkXMLImageDataWriter,
        vtkXMLPolyDataReader,
        vtkXMLPolyDataWriter,
    )

    printed = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(printed)
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    readers = {"vti": vtkXMLImageDataReader, "vtp": vtkXMLPolyDataReader, "vtk": vtkDataSetReader}
    reader: Any = readers[kind]()
    reader.SetFileName(path)
    if kind == "vtk":
        reader.ReadAllScalarsOn()
    reader.Update()
    out = reader.GetOutput()
    complaint = printed.GetOutput().strip()
    surface = out is not None and out.IsA("vtkPolyData")
    for cells in (out.GetVerts(), out.GetLines(), out.GetPolys(), out.GetStrips()) if surface else ():
        ends = cells.GetOffsetsArray()
        last = ends.GetNumberOfTuples() - 1
        if last >= 0 and (ends.GetTuple1(0), ends.GetTuple1(last)) != (0, cells.GetNumberOfConnectivityIds()):
            complaint = complaint or "its faces do not end one after the other"
    if complaint or out is None or reader.GetErrorCode():
        answer = {"complaint": complaint[:10_000]}
    elif out.GetClassName() not in ("vtkImageData", "vtkStructuredPoints", "vtkPolyData"):
        answer = {"class": out.GetClassName()}
    else:
        answer = {"file": "copy.vtp" if surface else "copy.vti"}
        _make_plain(out)
        writer = vtkXMLPolyDataWriter() if surface else vtkXMLImageDataWriter()
        writer.SetFileName(f"{folder}/{answer['file']}")
        writer.SetInputData(out)
        writer.SetDataModeToAppended()
        writer.EncodeAppendedDataOff()
        writer.SetCompressorTypeToNone()
        writer.SetHeaderTypeToUInt64()
        writer.Write()
    sys.stdout.write(json.dumps(answer))


def _make_plain(dataset: Any) -> None:
    """Make a data set one that the check of the copy knows, of floats and whole bytes; VTK escapes no names."""
    from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkUnsignedCharArray

    points = dataset.GetPoints() if dataset.IsA("vtkPolyData") else None
    if points is not None and points.GetData().GetDataTypeAsString() not in ("float", "double"):
        exact = vtkDoubleArray()
        exact.DeepCopy(points.GetData())
        points.SetData(exact)
    if points is not None:
        points.GetData().GetInformation().Clear()
    for given in (dataset.GetPointData(), dataset.GetCellData(), dataset.GetFieldData()):
        for i in range(given.GetNumberOfArrays()):
            array = given.GetAbstractArray(i)
            array.GetInformation().Clear()
            for k in range(array.GetNumberOfComponents() if array.HasAComponentName() else 0):
                array.SetComponentName(k, str(k))
            array.SetName(_escaped(array.GetName() or f"array {i}"))
            if array.IsA("vtkBitArray"):
                whole = vtkUnsignedCharArray()
                whole.DeepCopy(array)
                given.AddArray(whole)  # in the place of that name


def _escaped(name: str) -> str:
    """Return a name as an attribute of XML, where control characters cannot be."""
    named = {"\t": "&#9;", "\n": "&#10;", "\r": "&#13;"}
    return "".join(named.get(each, "_" if ord(each) < 32 else each) for each in escape(name, {'"': "&quot;"}))


if __name__ == "__main__":
    _main(*sys.argv[1:])
