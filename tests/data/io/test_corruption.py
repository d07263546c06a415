"""Damage that the file libraries do not report, or that ends the process: offsets of cells, compressed samples."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista
import SimpleITK as sitk

import simplexmesh as sm
from tests.nightly.marks import nightly

VALUES = (np.random.default_rng(0).random((10, 12, 14)) * 200).astype(np.int16)
VTK = (
    "# vtk DataFile Version 5.1\nx\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n"
    "POLYGONS 3 6\nOFFSETS vtktypeint64\n{}\nCONNECTIVITY vtktypeint64\n0 1 2 1 2 3\n"
)


@pytest.mark.parametrize("offsets", ["0 3 99999999999", "0 6 3", *nightly("0 3 -6", "3 3 6", "0 3 5")])
def test_offsets_of_vtk_cells(offsets, tmp_path, capfd):
    (tmp_path / "a.vtk").write_text(VTK.format("0 3 6"))
    assert len(sm.read(tmp_path / "a.vtk").faces) == 2
    (tmp_path / "a.vtk").write_text(VTK.format(offsets))
    with pytest.raises((OSError, ValueError), match=r"a.vtk"):
        sm.read(tmp_path / "a.vtk")
    assert capfd.readouterr().err == ""


def test_offsets_of_pyvista_cells():
    surface = pyvista.Sphere()
    cells = pyvista.CellArray.from_arrays(np.array([0, 3, 2**40]), np.array([0, 1, 2, 1, 2, 3]), deep=True)
    surface.SetPolys(cells)
    with pytest.raises(ValueError, match="faces must end one after the other"):
        sm.dual(sm.decimate(surface, vertices=4))


@pytest.mark.parametrize("ending", [".mha", ".mhd", ".nrrd", ".nhdr", ".nii.gz"])
def test_compressed_samples(ending, tmp_path, capfd):
    path = tmp_path / f"a{ending}"
    sitk.WriteImage(sitk.GetImageFromArray(VALUES), str(path), useCompression=True)
    assert np.array_equal(sm.read(path).values, VALUES.T)
    (data,) = (
        [each for each in tmp_path.iterdir() if each == path]
        if ending in (".mha", ".nrrd", ".nii.gz")
        else [each for each in tmp_path.iterdir() if each != path]
    )
    content = data.read_bytes()
    for at in np.linspace(len(content) // 2, len(content) - 12, 20).astype(int):
        data.write_bytes(content[:at] + bytes([content[at] ^ 0x55]) + content[at + 1 :])
        with pytest.raises(OSError, match=f"a{ending}"):
            sm.read(path)
        assert capfd.readouterr().err == ""
    data.write_bytes(content[:-20])
    with pytest.raises(OSError, match=f"a{ending}"):
        sm.read(path)
    data.write_bytes(content)
    assert np.array_equal(sm.read(path).values, VALUES.T)


def test_compressed_metaimage_without_the_size_of_its_samples(tmp_path, capfd):
    sitk.WriteImage(sitk.GetImageFromArray(VALUES), str(tmp_path / "a.mha"), useCompression=True)
    head, mark, samples = (tmp_path / "a.mha").read_bytes().partition(b"ElementDataFile = LOCAL\n")
    lines = [line for line in head.splitlines(keepends=True) if b"CompressedDataSize" not in line]
    (tmp_path / "a.mha").write_bytes(b"".join(lines) + mark + samples)
    with pytest.raises(OSError, match=r"a.mha is a compressed MetaImage without CompressedDataSize"):
        sm.read(tmp_path / "a.mha")
    assert capfd.readouterr().err == ""


def test_a_pair_of_nifti_files(tmp_path):
    sitk.WriteImage(sitk.GetImageFromArray(VALUES), str(tmp_path / "a.hdr"))
    assert np.array_equal(sm.read(tmp_path / "a.hdr").values, VALUES.T)
    content = (tmp_path / "a.img").read_bytes()
    (tmp_path / "a.img").write_bytes(content[:-100])
    with pytest.raises(OSError, match=r"a.hdr must have 3,360 bytes in a.img, it has 3,260: truncated"):
        sm.read(tmp_path / "a.hdr")
    (tmp_path / "a.img").unlink()
    with pytest.raises(FileNotFoundError, match=r"a.hdr refers to a.img, which is not in its folder"):
        sm.read(tmp_path / "a.hdr")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("NDims = 3", "NDims = 2147483648", "DimSize must have"),
        ("NDims = 3", "NDims = x", "damaged"),
        ("NDims = 3", "NDims = 4", "DimSize must have"),
        ("DimSize = 2 2 2", "DimSize = 2 2", "DimSize must have"),
        ("DimSize = 2 2 2", "DimSize = 2 2 x", "damaged"),
        ("ElementSpacing = 1 1 1", "ElementSpacing = 1 1", "ElementSpacing must have"),
        ("ElementSpacing = 1 1 1", "ElementSpacing = 1 x 1", "damaged"),
        ("ElementSpacing = 1 1 1", "HeaderSize = 4", "must have 12 bytes in a.raw, it has 8: truncated"),
    ],
)
def test_headers_of_metaimages(old, new, message, tmp_path, capfd):
    lines = "NDims = 3\nDimSize = 2 2 2\nElementSpacing = 1 1 1\nElementType = MET_UCHAR\nElementDataFile = a.raw\n"
    (tmp_path / "a.raw").write_bytes(bytes(range(8)))
    (tmp_path / "a.mhd").write_text(lines)
    assert sm.read(tmp_path / "a.mhd").values.sum() == 28
    (tmp_path / "a.mhd").write_text(lines.replace(old, new))
    with pytest.raises(OSError, match=message):
        sm.read(tmp_path / "a.mhd")
    assert capfd.readouterr().err == ""
