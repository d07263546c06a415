"""DICOM: slices that are no regular grid (tilted gantries, series in time, no positions), byte orders, damage."""

from __future__ import annotations

import struct

import numpy as np
import pytest
import SimpleITK as sitk

import simplexmesh as sm
from simplexmesh._base.errors import SimplexMeshWarning

VALUES = np.arange(4 * 5 * 6, dtype=np.int16).reshape(4, 5, 6)


def write(folder, positions, *, located=True, angle=0.0):
    """Write slices at the given positions, their rows turned about x."""
    writer = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    for k, position in enumerate(positions):
        image = sitk.GetImageFromArray(VALUES[k])
        tags = {"0020|000e": "1.2.3", "0020|0013": str(k), "0008|0018": f"1.2.3.{k + 1}", "0008|0060": "CT"}
        if located:
            tags["0020|0037"] = f"1\\0\\0\\0\\{np.cos(angle):.6f}\\{np.sin(angle):.6f}"
            tags["0020|0032"] = "\\".join(f"{x:.4f}" for x in position)
        for tag, value in tags.items():
            image.SetMetaData(tag, value)
        writer.SetFileName(str(folder / f"{k}.dcm"))
        writer.Execute(image)


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_slices_along_their_normal(angle, tmp_path):
    normal = np.array([0.0, -np.sin(angle), np.cos(angle)])
    write(tmp_path, [(10, 20, 30) + 2 * k * normal for k in range(4)], angle=angle)
    volume = sm.read(tmp_path)
    assert np.array_equal(volume.values, VALUES.T)
    assert volume.spacing[2] == pytest.approx(2, rel=1e-3)
    assert volume.direction[:, 2] == pytest.approx(normal, abs=1e-4)


@pytest.mark.parametrize("count", [2, 4])
def test_a_tilted_gantry_is_refused(count, tmp_path):
    write(tmp_path, [(10, 20 + 0.5 * k, 30 + 2 * k) for k in range(count)])
    with pytest.raises(OSError, match=r"has slices shifted by 0.5 mm against each other, as with a tilted gantry"):
        sm.read(tmp_path)


def test_slices_at_one_position_are_reported(tmp_path):
    write(tmp_path, [(0, 0, 0)] * 4, located=False)
    with pytest.warns(SimplexMeshWarning, match="4 slices at one position, or without any: a series in time, or of un"):
        volume = sm.read_volume(tmp_path, spacing=(1, 1, 2))
    assert np.array_equal(volume.values, VALUES.T)


RT_DOSE = "1.2.840.10008.5.1.4.1.1.481.2"


def dicom(path, values, *, big=False, content=None):
    """Write a file of several slices element by element, as SimpleITK writes no big-endian ones."""

    def element(tag, kind, value, order):
        value += (b"\0" if kind == "UI" else b" ") * (len(value) % 2)
        size = struct.pack(f"{order}2xI" if kind in ("OB", "OW") else f"{order}H", len(value))
        return struct.pack(f"{order}2H", *tag) + kind.encode() + size + value

    order, bits = "<>"[big], 8 * values.itemsize
    syntax = b"1.2.840.10008.1.2.2" if big else b"1.2.840.10008.1.2.1"
    meta = element((2, 2), "UI", RT_DOSE.encode(), "<") + element((2, 16), "UI", syntax, "<")
    elements = [
        ((8, 0x16), "UI", RT_DOSE), ((8, 0x60), "CS", "RTDOSE"), ((0x18, 0x50), "DS", "2"),
        ((0x20, 0x32), "DS", "0\\0\\0"), ((0x20, 0x37), "DS", "1\\0\\0\\0\\1\\0"),
        ((0x28, 2), "US", 1), ((0x28, 4), "CS", "MONOCHROME2"), ((0x28, 8), "IS", str(len(values))),
        ((0x28, 0x10), "US", values.shape[1]), ((0x28, 0x11), "US", values.shape[2]), ((0x28, 0x30), "DS", "1\\1"),
        ((0x28, 0x100), "US", bits), ((0x28, 0x101), "US", bits), ((0x28, 0x102), "US", bits - 1),
        ((0x28, 0x103), "US", 0), ((0x3004, 0xC), "DS", "\\".join(str(2 * k) for k in range(len(values)))),
    ]  # fmt: skip
    packed = [(t, k, struct.pack(f"{order}H", v) if k == "US" else v.encode()) for t, k, v in elements]
    samples = values.astype(values.dtype.newbyteorder(order)).tobytes() if content is None else content
    body = b"".join(element(*each, order) for each in [*packed, ((0x7FE0, 0x10), "OW", samples)])
    begin = element((2, 0), "UL", struct.pack("<I", len(meta)), "<")
    path.write_bytes(bytes(128) + b"DICM" + begin + meta + body)


@pytest.mark.parametrize("big", [False, True])
def test_either_byte_order(big, tmp_path):
    dicom(tmp_path / "dose.dcm", VALUES.astype(np.uint16), big=big)
    assert np.array_equal(sm.read(tmp_path / "dose.dcm").values, VALUES.T)


def test_long_samples_in_big_endian_order_are_refused(tmp_path):
    """GDCM swaps the bytes of each half of them only."""
    dicom(tmp_path / "dose.dcm", VALUES.astype(np.uint32))
    assert np.array_equal(sm.read(tmp_path / "dose.dcm").values, VALUES.T)
    folder = tmp_path / "folder"
    folder.mkdir()
    for name in ("a.dcm", "b.dcm"):
        dicom(folder / name, VALUES.astype(np.uint32), big=True)
    for path in (folder / "a.dcm", folder):
        with pytest.raises(OSError, match=r"a.dcm has samples of 32 bits in big-endian order, .*: convert it"):
            sm.read(path)


def test_one_that_begins_as_a_tiff(tmp_path):
    dicom(tmp_path / "dose.dcm", VALUES.astype(np.uint16))
    (tmp_path / "dose.dcm").write_bytes(b"II*\0" + (tmp_path / "dose.dcm").read_bytes()[4:])
    assert np.array_equal(sm.read(tmp_path / "dose.dcm").values, VALUES.T)


def test_damage_is_one_sentence(tmp_path):
    dicom(tmp_path / "none.dcm", VALUES.astype(np.uint16), content=b"")
    whole = tmp_path / "whole.dcm"
    dicom(whole, VALUES.astype(np.uint16))
    (tmp_path / "cut.dcm").write_bytes(whole.read_bytes()[:300])
    for name in ("none.dcm", "cut.dcm"):
        with pytest.raises(OSError, match=f"^{name} cannot be read as a volume: it has no image, or a damaged one, or"):
            sm.read(tmp_path / name)
