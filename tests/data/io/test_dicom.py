"""Positions of DICOM slices that are no regular grid: tilted gantries, series in time, no positions."""

from __future__ import annotations

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
