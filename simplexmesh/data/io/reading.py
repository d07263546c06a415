"""Read files: with the type detected from the content, or with the type the caller expects."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.errors import TopologyError, warn
from simplexmesh.data.exporting import read_gifti, read_scene
from simplexmesh.data.foreign import converted
from simplexmesh.data.io import formats
from simplexmesh.data.io.off import read_off
from simplexmesh.data.io.pcd import read_pcd
from simplexmesh.data.io.ply import read_ply
from simplexmesh.data.io.survey.e57 import read_e57
from simplexmesh.data.io.survey.las import read_las
from simplexmesh.data.io.text import read_text
from simplexmesh.data.points import PointCloud, cloud_of_file, cloud_of_vertices
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume

_SINGLE_PRECISION = 1e-7
_READERS: dict[str, Callable[[Path], Any]] = {
    "ply": read_ply,
    "off": read_off,
    "pcd": read_pcd,
    "text": read_text,
    "las": lambda path: cloud_of_file(path.name, *read_las(path), missing=True),
    "e57": lambda path: cloud_of_file(path.name, *read_e57(path), missing=True),
    "gifti": lambda path: converted(read_gifti(path), path.name),
    "glb": lambda path: converted(read_scene(path, "glb"), path.name),
    "3mf": lambda path: converted(read_scene(path, "3mf"), path.name),
}
"""Of the formats that neither ITK nor VTK reads, whose import takes longer than all of these."""


def read(path: str | os.PathLike[str]) -> Any:
    """Read a file, or a folder of slices, as the type of data it holds.

    The format is detected from the content; a warning is issued if the name contradicts it.

    Parameters
    ----------
    path : str or Path
        Volumes: MetaImage, NRRD, NIfTI, VTI, DICOM, TIFF, a folder of DICOM or TIFF slices. Surfaces and points:
        PLY, STL, OBJ, OFF, VTK, VTP, PCD, XYZ and CSV text; LAS, LAZ and E57 with the extra `survey`; GLB and
        3MF with `export`; GIFTI with nibabel.

    Returns
    -------
    Volume, PointCloud, TriangleMesh or SimplexMesh
        The vertices of triangles are merged by position; coordinates in a texture become an array `uv` where they have
        no seams, and are left out where they have.

    Raises
    ------
    OSError
        The file does not exist, is empty, damaged or truncated, or has an unknown format.
    ValueError
        Its content is invalid: NaN, fewer than four points, a volume that is not three-dimensional.

    Warns
    -----
    SimplexMeshWarning
        Something was repaired.

    Examples
    --------
    >>> import tempfile, simplexmesh as sm
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sm.sphere(3).save(f"{folder}/ball.vtp")
    ...     read(f"{folder}/ball.vtp")
    SimplexMesh(180 vertices, 92 faces, genus 0, 0 holes)
    """
    where = _existing(path)
    with _errors_naming(where), np.errstate(invalid="ignore", over="ignore"):  # of casts of NaN; they are refused later
        if where.is_dir():
            from simplexmesh.data.io import itk

            return itk.read_series(where)
        kind = formats.format_of(where)
        named = formats.SUFFIXES.get(formats.suffix(where), kind)
        if named != kind and not (named == "text" or {named, kind} <= {"vti", "vtp", "vtk"}):
            warn(f"{where.name} is {formats.called(kind)} file by its content and was read as such")
        return _read_kind(where, kind)


def read_volume(path: str | os.PathLike[str], *, spacing: ArrayLike | None = None) -> Volume:
    """Read a volume.

    Parameters
    ----------
    path : str or Path
        A file, or a folder of DICOM or TIFF slices.
    spacing : float or (3,) array of float, optional
        Distance between samples; overrides the file's (TIFF stacks have none).

    Raises
    ------
    OSError
        As `read`.
    ValueError
        The file holds something else.

    Examples
    --------
    >>> import tempfile, SimpleITK, simplexmesh as sm
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     SimpleITK.WriteImage(SimpleITK.Image(4, 5, 6, SimpleITK.sitkUInt8), f"{folder}/empty.nii.gz")
    ...     read_volume(f"{folder}/empty.nii.gz", spacing=2.0)
    Volume(shape=(4, 5, 6), uint8, spacing=(2, 2, 2), range=(0, 0))
    """
    out = read(path)
    if not isinstance(out, Volume):
        raise _wrong_content("a volume", path, out)
    if spacing is None:
        return out
    return replace(out, spacing=checks.any_array("spacing", spacing))


def read_points(path: str | os.PathLike[str]) -> PointCloud:
    r"""Read a point cloud; a triangle mesh or simplex mesh gives its vertices and their normals.

    Raises
    ------
    OSError
        As `read`.
    ValueError
        The file holds a volume.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "corners.xyz")
    ...     _ = path.write_text("0 0 0\n1 0 0\n0 1 0\n0 0 1\n")
    ...     read_points(path)
    PointCloud(4 points, without normals, diagonal 1.73205)
    """
    out = read(path)
    if isinstance(out, PointCloud):
        return out
    if isinstance(out, TriangleMesh) or hasattr(out, "connectivity"):
        return cloud_of_vertices(out)
    raise _wrong_content("points", path, out)


def read_triangles(path: str | os.PathLike[str]) -> TriangleMesh:
    """Read a triangle mesh; polygons are triangulated.

    Raises
    ------
    OSError
        As `read`.
    ValueError
        The file holds a volume, or points without faces.

    Examples
    --------
    >>> import tempfile, simplexmesh as sm
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sm.sphere(3).save(f"{folder}/ball.ply")
    ...     read_triangles(f"{folder}/ball.ply")
    TriangleMesh(180 vertices, 356 faces, closed)
    """
    out = read(path)
    if isinstance(out, TriangleMesh):
        return out
    if hasattr(out, "triangulated"):
        return out.triangulated()
    raise _wrong_content("triangles", path, out)


def read_mesh(path: str | os.PathLike[str]) -> Any:
    """Read a simplex mesh saved as VTP: identical to the saved one, with its topology, holes and arrays.

    Raises
    ------
    OSError
        As `read`.
    ValueError
        The file holds something else.

    Examples
    --------
    >>> import tempfile, simplexmesh as sm
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sm.plane(4, 5).with_data(weight=range(sm.plane(4, 5).n_vertices)).save(f"{folder}/sheet.vtp")
    ...     sheet = read_mesh(f"{folder}/sheet.vtp")
    >>> sheet.n_holes, sorted(sheet.data)
    (1, ['weight'])
    """
    out = read(path)
    if not hasattr(out, "connectivity"):
        raise _wrong_content("a simplex mesh", path, out)
    return out


def _read_kind(path: Path, kind: str) -> Any:
    if kind in ("metaimage", "nrrd", "nifti", "dicom", "tiff"):
        from simplexmesh.data.io import itk

        return itk.read_image(path)
    if kind in _READERS:
        return _welded(_READERS[kind](path), kind)
    from simplexmesh.data.io import vtk

    if kind == "stl":
        from simplexmesh.data.io.stl import readable_by_vtk

        with readable_by_vtk(path) as plain:
            return _welded(vtk.from_dataset(vtk.read_dataset(plain, kind), path.name), kind)
    if kind != "obj":
        return _welded(vtk.from_dataset(vtk.read_dataset(path, kind), path.name, owned=True), kind)
    from simplexmesh.data.io import obj

    with obj.without_refused(path) as plain:
        dataset = vtk.read_dataset(plain, kind)
    out = vtk.from_dataset(dataset, path.name, owned=True)
    if not isinstance(out, TriangleMesh):
        return out
    return obj.with_colors(_welded(obj.with_texture(out, dataset), kind), path)


def _welded(out: Any, kind: str) -> Any:
    """Merge equal positions; without a warning for STL, OBJ and GLB, which duplicate vertices by design."""
    if not isinstance(out, TriangleMesh):
        return out
    out = out.welded(report=kind not in ("stl", "obj", "glb"))
    if kind == "stl" and not out.is_closed:
        # copies of one vertex may be rounded differently to single precision
        out = out.welded(tolerance=_SINGLE_PRECISION * out.diagonal, report=False)
    return out


@contextmanager
def _errors_naming(path: Path) -> Iterator[None]:
    """Prefix the file name to errors about its content."""
    try:
        yield
    except (ValueError, TypeError) as error:
        message = str(error)
        kinds = (TopologyError, ValueError, TypeError)
        kind = next(kind for kind in kinds if isinstance(error, kind))
        raise kind(message if path.name in message else f"{path.name}: {message}") from None


def _existing(path: str | os.PathLike[str]) -> Path:
    where = checks.path("path", path)
    if not where.exists():
        raise FileNotFoundError(f"path must be a file or folder, {os.fspath(path)!r} does not exist")
    return where if where.name not in ("", "..") else where.resolve()  # messages name the folder itself


def _wrong_content(wanted: str, path: Any, got: Any) -> ValueError:
    return ValueError(f"path must hold {wanted}, {Path(path).name} holds a {type(got).__name__}")
