"""Images of VTK with several arrays, of which one is read, and TIFF files in tiles, which are refused."""

from __future__ import annotations

import struct
import warnings

import numpy as np
import pytest
import pyvista
import SimpleITK

import simplexmesh as sm
from simplexmesh._base.errors import SimplexMeshWarning
from simplexmesh.data.conversion import as_volume

HEAD = "# vtk DataFile Version 3.0\nimage\nASCII\nDATASET STRUCTURED_POINTS\n"
GRID = "DIMENSIONS 2 2 2\nORIGIN 0 0 0\nSPACING 1 1 1\n"


def image(*, active=None, vectors_first=False):
    grid = pyvista.ImageData(dimensions=(3, 4, 5))
    if vectors_first:
        grid["gradient"] = np.zeros((60, 3))
    grid["ct"] = np.arange(60.0)
    grid["mask"] = np.arange(100.0, 160)
    grid["gradient"] = np.zeros((60, 3))
    grid.cell_data["dose"] = np.zeros(24)
    grid.set_active_scalars(active)
    return grid


@pytest.mark.parametrize("ending", [".vti", ".vtk"])
@pytest.mark.parametrize("vectors_first", [False, True])
@pytest.mark.parametrize(
    ("active", "message"),
    [
        (None, "holds several arrays: 'ct', the first one, was read, not 'mask', 'dose'"),
        ("ct", "holds several arrays: 'ct', the active one, was read, not 'mask', 'dose'"),
        ("mask", "holds several arrays: 'mask', the active one, was read, not 'ct', 'dose'"),
    ],
)
def test_the_array_that_is_read_is_named(ending, vectors_first, active, message, tmp_path):
    grid = image(active=active, vectors_first=vectors_first)
    grid.save(tmp_path / f"a{ending}")
    for found, name in ((lambda: sm.read(tmp_path / f"a{ending}"), f"a{ending}"), (lambda: as_volume(grid), "volume")):
        with pytest.warns(SimplexMeshWarning, match=f"^{name} {message}$"):
            assert found().values.min() == (100 if active == "mask" else 0)


def test_further_scalars_of_old_files_are_named(tmp_path):
    rows = "".join(
        f"SCALARS {name} float 1\nLOOKUP_TABLE default\n1 2 3 4 5 6 7 {last}\n" for name, last in ("a8", "b9")
    )
    (tmp_path / "a.vtk").write_text(f"{HEAD}{GRID}POINT_DATA 8\n{rows}")
    with pytest.warns(
        SimplexMeshWarning, match=r"^a.vtk holds several arrays: 'a', the active one, was read, not 'b'$"
    ):
        assert sm.read(tmp_path / "a.vtk").values.max() == 8


@pytest.mark.parametrize("ending", [".vti", ".vtk"])
def test_one_array_needs_no_word(ending, tmp_path):
    grid = pyvista.ImageData(dimensions=(3, 4, 5))
    grid["gradient"], grid["ct"] = np.zeros((60, 3)), np.arange(60.0)
    grid.set_active_scalars(None)
    grid.save(tmp_path / f"a{ending}")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert sm.read(tmp_path / f"a{ending}").values.max() == 59


def tiled_tiff(path, slices):
    """Write a TIFF file of 16 x 16 tiles, one page for each slice."""
    out, last = bytearray(b"II*\0\0\0\0\0"), 4
    for page in slices:
        height, width = page.shape
        corners = [(y, x) for y in range(0, height, 16) for x in range(0, width, 16)]
        starts = [len(out) + 16 * 16 * page.itemsize * k for k in range(len(corners))]
        for y, x in corners:
            out += np.ascontiguousarray(page[y : y + 16, x : x + 16]).tobytes()
        lists = len(out)
        out += struct.pack(f"<{2 * len(starts)}I", *starts, *[16 * 16 * page.itemsize] * len(starts))
        values = {256: width, 257: height, 258: 8 * page.itemsize, 259: 1, 262: 1, 277: 1, 322: 16, 323: 16}
        entries = [(tag, 1, value) for tag, value in values.items()]
        entries += [(324, len(starts), lists), (325, len(starts), lists + 4 * len(starts))]
        out[last : last + 4] = struct.pack("<I", len(out))
        out += struct.pack("<H", len(entries))
        out += b"".join(struct.pack("<HHII", tag, 4, count, value) for tag, count, value in entries)
        last = len(out)
        out += bytes(4)
    path.write_bytes(out)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_tiled_tiff_is_refused_by_name(kind, tmp_path):
    slices = np.arange(5 * 32 * 48).reshape(5, 32, 48).astype(kind)
    tiled_tiff(tmp_path / "stack.tif", slices)
    (tmp_path / "folder").mkdir()
    for k in range(5):
        tiled_tiff(tmp_path / "folder" / f"slice{k}.tif", slices[k : k + 1])
    for path, name in ((tmp_path / "stack.tif", "stack"), (tmp_path / "folder", "slice0")):
        with pytest.raises(OSError, match=rf"^{name}.tif is a tiled TIFF file; only strips are supported$"):
            sm.read(path)


def test_truncated_slices_are_refused_by_name(tmp_path):
    for k in range(3):
        image = SimpleITK.GetImageFromArray(np.full((32, 48), k, np.uint8))
        SimpleITK.WriteImage(image, str(tmp_path / f"slice{k}.tif"))
    assert sm.read(tmp_path).shape == (48, 32, 3)
    whole = (tmp_path / "slice1.tif").read_bytes()
    (tmp_path / "slice1.tif").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(OSError, match=r"slice1.tif ends within page 1 of its images: truncated"):
        sm.read(tmp_path)
