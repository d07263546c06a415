"""The scaling of NIfTI samples, and the units of their positions."""

from __future__ import annotations

import gzip
import struct

import numpy as np
import pytest
import SimpleITK as sitk
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm

VALUES = np.arange(60, dtype=np.int16).reshape(5, 4, 3) - 7


def nifti1(order, slope, offset, *, magic=b"n+1\0", start=352.0):
    head = bytearray(352)
    struct.pack_into(order + "i", head, 0, 348)
    struct.pack_into(order + "8h", head, 40, 3, 3, 4, 5, 1, 1, 1, 1)
    struct.pack_into(order + "2h", head, 70, 4, 16)
    struct.pack_into(order + "8f", head, 76, 1, 0.5, 1, 2, 1, 1, 1, 1)
    struct.pack_into(order + "3f", head, 108, start, slope, offset)
    head[123], head[344:348] = 2, magic
    return bytes(head)


def write(path, form, order, slope, offset):
    samples = VALUES.astype(order + "i2").tobytes()
    if form == "pair":
        path.with_suffix(".hdr").write_bytes(nifti1(order, slope, offset, magic=b"ni1\0", start=0.0)[:348])
        path.with_suffix(".img").write_bytes(samples)
        return path.with_suffix(".hdr")
    content = nifti1(order, slope, offset) + samples
    ending = ".nii.gz" if form == "zipped" else ".nii"
    path.with_suffix(ending).write_bytes(gzip.compress(content) if form == "zipped" else content)
    return path.with_suffix(ending)


@pytest.mark.parametrize("form", ["plain", "zipped", "pair"])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(
    ("slope", "offset", "expected"),
    [
        (1.0, 0.0, VALUES),
        (2.0, 5.0, 2 * VALUES + 5),
        (1.0, 5.0, VALUES + 5),
        (0.0, 0.0, VALUES),
        (0.0, 5.0, VALUES),
        (np.nan, 5.0, VALUES),
    ],
)
def test_a_slope_of_zero_means_no_scaling(form, order, slope, offset, expected, tmp_path):
    path = write(tmp_path / "scan", form, order, slope, offset)
    volume = sm.read_volume(path)
    assert_array_equal(volume.values, expected.T)
    assert_allclose(volume.spacing, (0.5, 1, 2))
    if slope in (0, 1) and expected is VALUES:
        assert volume.values.dtype == np.int16


@pytest.mark.parametrize(("unit", "factor"), [(0, 1.0), (1, 1000.0), (2, 1.0), (3, 1e-3)])
def test_lengths_are_in_millimeters(unit, factor, tmp_path):
    path = tmp_path / "scan.nii"
    image = sitk.GetImageFromArray(VALUES)
    image.SetSpacing((0.5, 1.0, 2.0))
    sitk.WriteImage(image, str(path))
    content = bytearray(path.read_bytes())
    content[123] = unit
    path.write_bytes(content)
    assert_allclose(sm.read_volume(path).spacing, factor * np.array([0.5, 1, 2]))
