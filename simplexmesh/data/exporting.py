"""Objects of trimesh and Open3D made of ours, files by trimesh and nibabel; the only module that imports these."""

from __future__ import annotations

import base64
import binascii
import io
import json
import re
import zipfile
import zlib
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.errors import warn
from simplexmesh._base.named_arrays import is_color

if TYPE_CHECKING:
    from simplexmesh.data.io.polydata import Polygons

MOST_UNPACKED = 100
"""Times as large as the file the content of a 3MF or GIFTI file may be: of triangles in a plane it is 10."""

MOST_FACES = 50_000_000
"""Triangles that all copies of the parts of a scene may have."""

EXPORT = "the extra export: pip install 'simplexmesh[export]'"


def to_trimesh(value: Any) -> Any:
    """Return a `trimesh.Trimesh` of a triangle mesh or a `trimesh.PointCloud` of points, with colors and unit."""
    trimesh = _trimesh()
    value = _triangulated(value)
    colors = value.data.get("colors")
    shown = np.array(colors) if colors is not None and is_color(colors) else None
    if not hasattr(value, "faces"):
        out = trimesh.PointCloud(np.array(value.points), colors=shown)
    else:
        others = {name: np.array(values) for name, values in value.data.items() if name != "colors" or shown is None}
        positions = np.array(value.vertices), np.array(value.faces)
        out = trimesh.Trimesh(*positions, process=False, vertex_colors=shown, vertex_attributes=others)
        out.units = value.unit
    return out


def _trimesh() -> Any:
    try:
        import trimesh
    except ImportError as error:
        raise ImportError(f"this needs {EXPORT}") from error
    return trimesh


def needed() -> None:
    """Say how the libraries that GLB and 3MF files need are installed if one is missing."""
    try:
        import lxml  # noqa: F401
        import networkx  # noqa: F401
        import trimesh  # noqa: F401
    except ImportError as error:
        raise ImportError(f"this needs {EXPORT}") from error


def _by_trimesh(surface: Any, kind: str) -> bytes:
    """Return the file that trimesh makes of a triangle mesh: "glb" or "3mf", which needs lxml and networkx."""
    made = to_trimesh(surface)
    try:
        return made.export(file_type=kind)
    except ImportError as error:
        raise ImportError(f"this needs {EXPORT}") from error


def to_open3d(value: Any) -> Any:
    """Return an `open3d.t.geometry` TriangleMesh or PointCloud, with normals, colors as shares, and other arrays."""
    try:
        import open3d
    except ImportError as error:
        raise ImportError("this needs Open3D: pip install open3d") from error
    value = _triangulated(value)
    if hasattr(value, "faces"):
        out = open3d.t.geometry.TriangleMesh()
        table, positions, normals = out.vertex, value.vertices, value.vertex_normals
        out.triangle["indices"] = open3d.core.Tensor(np.array(value.faces))
    else:
        out = open3d.t.geometry.PointCloud()
        table, positions, normals = out.point, value.points, value.normals
    named = {"positions": positions} | ({} if normals is None else {"normals": normals})
    for name, values in (value.data | named).items():
        rows = np.array(values)
        if name == "colors" and is_color(rows):
            rows = (rows[:, :3] / 255).astype(np.float32)
        table[name] = open3d.core.Tensor(rows.reshape(len(rows), -1))
    return out


def _triangulated(value: Any) -> Any:
    return value.triangulated() if hasattr(value, "triangulated") else value


def write_glb(path: Path, content: Polygons) -> None:
    """Write triangles in meters, with colors, and with other arrays of up to four columns in single precision."""
    surface = _in(content.triangles(), "m")
    fitting = {name: values for name, values in surface.data.items() if is_glb_array(name, values)}
    data = {name: v if name == "colors" else v.astype(np.float32) for name, v in fitting.items()}
    path.write_bytes(_by_trimesh(replace(surface, data=data), "glb"))


def read_scene(path: Path, kind: str) -> Any:
    """Return what a file, "glb" or "3mf", has as an object of trimesh, its parts in place; other files stay closed."""
    trimesh, content = _trimesh(), path.read_bytes()
    try:
        _check_sizes(content, kind)
        scene = trimesh.load_scene(io.BytesIO(content), file_type=kind, process=False)
        parts = (scene.geometry[scene.graph[node][1]] for node in scene.graph.nodes_geometry)
        if sum(len(getattr(part, "faces", ())) for part in parts) > MOST_FACES:
            raise ValueError("too many copies of parts")
        out = scene.to_geometry()
    except ImportError as error:
        raise ImportError(f"this needs {EXPORT}") from error
    except Exception as error:  # whatever damage makes of the numbers in it
        raise OSError(f"{path.name} is damaged, or uses extensions that trimesh does not know") from error
    if not isinstance(out, trimesh.Trimesh | trimesh.PointCloud):
        raise ValueError("must hold triangles or points, it has neither")
    if others := sum(not isinstance(each, type(out)) for each in scene.geometry.values()):
        warn(f"{path.name}: parts of the scene of another kind are left out: {others}")
    out.units = "m" if kind == "glb" else scene.units
    if hasattr(out, "vertex_attributes"):  # the format begins names of its users with an underscore
        rows = {name.removeprefix("_"): np.array(values) for name, values in out.vertex_attributes.items()}
        out.vertex_attributes = {name: v[:, 0] if v.shape[1:] == (1,) else v for name, v in rows.items()}
    return out


def _check_sizes(content: bytes, kind: str) -> None:
    """Refuse files that would take much more memory than they have bytes."""
    if kind == "3mf":
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size, most = sum(member.file_size for member in archive.infolist()), MOST_UNPACKED * len(content)
    else:
        described = json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])
        size, most = max((each["count"] for each in described.get("accessors", ())), default=0), len(content)
    if size > most:
        raise ValueError("more entries than bytes")


def read_gifti(path: Path) -> Any:
    """Return what a GIFTI file, packed or not, has as an object of nibabel; other files that it names stay closed."""
    try:
        import nibabel
    except ImportError as error:
        raise ImportError("this needs nibabel: pip install nibabel") from error
    content = path.read_bytes()
    most = MOST_UNPACKED * len(content)
    try:
        if content.startswith(b"\x1f\x8b"):
            content = _unpacked(content, most, wbits=31)
        if re.search(rb"Dimensionality\s*=\s*[\"'][^\"'>]{3}", content):
            raise ValueError("more dimensions than nibabel counts in reasonable time")
        for text in re.split(rb"<Data\s*>", content)[1:]:
            with suppress(zlib.error, binascii.Error):  # of numbers as they are
                _unpacked(base64.b64decode(text.partition(b"<")[0]), most)
        return nibabel.GiftiImage.from_bytes(content)
    except Exception as error:  # whatever damage makes of the numbers in it
        raise OSError(f"{path.name} is damaged, or its arrays are in other files") from error


def _unpacked(content: bytes, most: int, wbits: int = zlib.MAX_WBITS) -> bytes:
    """Return what is packed, or raise if it is more than the most."""
    out = zlib.decompressobj(wbits).decompress(content, most)
    if len(out) == most:
        raise ValueError("more content than that of a surface")
    return out


def write_3mf(path: Path, content: Polygons) -> None:
    """Write triangles in millimeters, with colors."""
    path.write_bytes(_by_trimesh(_in(content.triangles(), "mm"), "3mf"))


def is_glb_array(name: str, values: NDArray[Any]) -> bool:
    """Whether a GLB file holds an array."""
    return values.size <= 4 * len(values)


def _in(surface: Any, unit: str) -> Any:
    """Return a surface of known unit in the one of a format, any other as it is."""
    return surface if surface.unit is None else surface.in_unit(unit)
