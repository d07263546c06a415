"""Write meshes, points and volumes: the format is chosen by the name of the file."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.drafts import draft
from simplexmesh._base.errors import warn
from simplexmesh._base.named_arrays import OF_MODELS, is_color
from simplexmesh.data import exporting
from simplexmesh.data.io import obj, off, ply, polydata, stl, text
from simplexmesh.data.io.polydata import to_pyvista as to_pyvista
from simplexmesh.data.io.survey import e57, las

SINGLE = (".stl", ".glb")
"""Formats with coordinates in single precision."""

NOTABLE_ROUNDING = 1e-4
"""Rounding by more than this fraction of the extent gives a warning."""

VOLUMES = (".mha", ".nrrd", ".nii", ".nii.gz", ".vti")


class Format(NamedTuple):
    """How a format is written, whether it holds points alone and faces, which named arrays, a check for libraries."""

    write: Callable[[Path, polydata.Polygons], None]
    of_points: bool = False
    of_faces: bool = True
    holds: Callable[[str, NDArray[Any]], bool] = lambda name, values: True
    needs: Callable[[], Any] = lambda: None


def nothing(name: str, values: NDArray[Any]) -> bool:
    """Of a format that holds no arrays."""
    return False


def of_obj(name: str, values: NDArray[Any]) -> bool:
    """Whether an OBJ file holds an array."""
    return (name == "colors" and is_color(values)) or (name == "uv" and obj.is_uv(values))


FORMATS = {
    ".vtp": Format(polydata.write_vtp, of_points=True),
    ".ply": Format(ply.write_ply, of_points=True),
    ".obj": Format(obj.write_obj, holds=of_obj),
    ".off": Format(off.write_off, holds=nothing),
    ".stl": Format(stl.write_stl, holds=nothing),
    ".xyz": Format(text.write_xyz, of_points=True, of_faces=False, holds=nothing),
    ".las": Format(las.write_las, of_points=True, of_faces=False, needs=las.library),
    ".laz": Format(las.write_las, of_points=True, of_faces=False, needs=las.library),
    ".e57": Format(e57.write_e57, of_points=True, of_faces=False, needs=e57.library),
    ".glb": Format(exporting.write_glb, holds=exporting.is_glb_array, needs=exporting.needed),
    ".3mf": Format(exporting.write_3mf, holds=nothing, needs=exporting.needed),
}


def write(path: str | os.PathLike[str], value: Any) -> None:
    """Write a simplex mesh, triangle mesh, point cloud or volume in the format its file name says."""
    where = checks.path("path", path)
    if hasattr(value, "spacing"):
        _write_volume(where, value)
        return
    suffix = where.suffix.lower()
    if suffix not in FORMATS:
        raise ValueError(f"path must end with one of {', '.join(FORMATS)}, not {suffix or 'nothing'} ({where.name})")
    content, chosen = polydata.Polygons.of(value), FORMATS[suffix]
    if not chosen.of_points and not len(content.sizes):
        known = ", ".join(ending for ending, each in FORMATS.items() if each.of_points)
        raise ValueError(f"path must end with one of {known} for points without faces, not {suffix}")
    if suffix in SINGLE:
        _check_single(content.points, suffix)
    with draft(where) as part:
        chosen.write(part, content)
    named = [(name, values) for name, values in content.data.items() if name not in OF_MODELS]
    if lost := ", ".join(name for name, values in named if not chosen.holds(name, values)):
        warn(f"{suffix[1:].upper()} files do not hold these arrays, which were left out: {lost}")


def _check_single(points: Array, suffix: str) -> None:
    """Refuse coordinates that single precision cannot represent, and warn of rounding above NOTABLE_ROUNDING."""
    most = float(np.abs(points).max())
    if most > float(np.finfo(np.float32).max):
        raise ValueError(f"path must not end with {suffix}, whose largest number is 3e38, for vertices at {most:.3g}")
    single = points.astype(np.float32)
    if not (np.ptp(single, axis=0) > 0).sum() >= 2 and (np.ptp(points, axis=0) > 0).sum() >= 2:
        raise ValueError(f"path must not end with {suffix}, whose single precision cannot tell these vertices apart")
    off = float(np.abs(points - single).max())
    if off > NOTABLE_ROUNDING * float(np.ptp(points, axis=0).max()):
        name = suffix[1:].upper()
        warn(f"{name} has single precision, which moves vertices by up to {off:.2g}; VTP, PLY and OBJ have double")


def _write_volume(path: Path, volume: Any) -> None:
    """Write a volume as VTI by VTK, or in a medical format by ITK."""
    if not path.name.lower().endswith(VOLUMES):
        raise ValueError(f"path must end with one of {', '.join(VOLUMES)} for a volume, not {path.name}")
    with draft(path) as part:
        if path.suffix.lower() == ".vti":
            to_pyvista(volume).save(part)
        else:
            from simplexmesh.data.io import itk

            itk.write_image(part, volume)
