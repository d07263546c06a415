"""Colors, texture and unit of OBJ files, of which VTK leaves the unit and spoils the colors, and writing of them."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from vtkmodules.util.numpy_support import vtk_to_numpy

from simplexmesh._base.errors import counted, warn
from simplexmesh._base.named_arrays import is_color
from simplexmesh._base.units import known_unit
from simplexmesh.data.columns import as_colors
from simplexmesh.data.io.text import write_lines
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.welding import is_single_valued

if TYPE_CHECKING:
    from simplexmesh.data.io.polydata import Polygons

_MATERIALS = re.compile(rb"(?m)^[ \t]*(mtllib|usemtl)\b[^\r\n]*")
_LOOSE = re.compile(rb"(?m)^[ \t]*f(?:[ \t]+[^\s\\#]+){0,2}[ \t]*(?=[\r\n#])")
_UNIT = re.compile(r"(?im)^#[^\n]*\bunits?\s*[:=]\s*(\S+)")


@contextmanager
def without_refused(path: Path) -> Iterator[Path]:
    """Give the path, or that of a copy without what VTK refuses: names of materials with spaces, and loose edges."""
    plain, materials = _MATERIALS.subn(b"", path.read_bytes())
    plain, loose = _LOOSE.subn(b"", plain)
    if loose:
        warn(f"{path.name}: left out {counted(loose, 'face', 'faces')} of fewer than three corners")
    if not (materials or loose):
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, path.name)
        copy.write_bytes(plain)
        yield copy


def with_texture(surface: TriangleMesh, dataset: Any) -> TriangleMesh:
    """Return the surface of a data set with the array `uv` of its coordinates in a texture, unless these have seams."""
    given = dataset.GetPointData().GetTCoords()
    if given is None or given.GetNumberOfTuples() != surface.n_vertices:
        return surface
    uv = np.array(vtk_to_numpy(given))[:, :2].astype(np.float64)
    single = np.isfinite(uv).all() and is_single_valued(surface.vertices, uv)
    return surface.with_data(uv=uv) if single else surface


def with_colors(surface: TriangleMesh, path: Path) -> TriangleMesh:
    """Return the surface read from an OBJ file with its colors in lines `v x y z r g b`, and its unit."""
    text = path.read_text(encoding="latin-1")
    unit = _UNIT.search(text)
    surface = replace(surface, unit=known_unit(unit[1]) if unit else None)
    words = [line.split() for line in text.splitlines() if line.startswith("v ")]
    rows = [each[1:7] for each in words if len(each) in (7, 8)]
    try:
        numbers = np.array(rows, dtype=np.float64).reshape(-1, 6)
    except ValueError:
        raise OSError(f"{path.name} must have numbers as colors of its vertices") from None
    if not len(rows) or not np.isfinite(numbers).all():
        return surface
    gaps, nearest = cKDTree(numbers[:, :3]).query(surface.vertices)
    single = np.finfo(np.float32).eps * np.abs(surface.vertices).max(initial=0)  # the precision of VTK before 9.7
    if (gaps > single).any():  # vertices without a color
        return surface
    return surface.with_data(colors=as_colors(numbers[nearest, 3:]))


def write_obj(path: Path, content: Polygons) -> None:
    """Write points, with colors and places in a texture, and polygons."""
    rows = content.points
    if "colors" in content.data and is_color(content.data["colors"]):
        rows = np.hstack([rows, content.data["colors"][:, :3] / 255])
    head = [f"# unit: {content.unit}\n"] if content.unit else []
    vertices = (f"v {' '.join(map(repr, row))}\n" for row in rows.tolist())
    textured = "uv" in content.data and is_uv(content.data["uv"])
    at = (f"vt {u!r} {v!r}\n" for u, v in (content.data["uv"].tolist() if textured else ()))
    corner = "{0}/{0}" if textured else "{0}"
    faces = (f"f {' '.join(corner.format(i + 1) for i in loop)}\n" for loop in content.loops)
    write_lines(path, head, vertices, at, faces)


def is_uv(values: NDArray[Any]) -> bool:
    """Whether an array holds places in a texture, as OBJ has them."""
    return values.dtype.kind == "f" and values.shape[1:] == (2,) and bool(np.isfinite(values).all())
