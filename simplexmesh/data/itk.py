"""Volumes from NIfTI, NRRD, MetaImage, DICOM and TIFF: the one door to SimpleITK.

Physical space is ITK's: LPS (x to the left of the patient, y to the back, z to the head). NIfTI files, which say RAS,
are turned into it by ITK: x and y change sign.
"""

from __future__ import annotations

import gzip
import re
import struct
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk  # noqa: N813

from simplexmesh.data import formats
from simplexmesh.data.volume import Volume
from simplexmesh.errors import SimplexMeshWarning


class _Kept:
    """The samples of an ITK image as NumPy sees them, keeping the image alive: a volume is not copied."""

    def __init__(self, image: sitk.Image) -> None:
        self.image = image
        self.__array_interface__ = sitk.GetArrayViewFromImage(image).__array_interface__


def read_image(path: Path) -> Volume:
    """Read a volume from one file (whose header may name another).

    Raises
    ------
    OSError
        The file is damaged, truncated, or refers to a file that is not there.
    ValueError
        It does not hold one three-dimensional image of real numbers.
    """
    kind = formats.format_of(path)
    if kind == "metaimage":
        _check_metaimage(path)
    if kind == "nifti":
        _check_nifti(path)
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(path))
    return _volume(path, _executed(path, reader))


def read_series(folder: Path) -> Volume:
    """Read a volume from a folder of slices: a DICOM series, or TIFF files in the order of their names.

    Raises
    ------
    OSError
        There are no such slices, or they are damaged.
    ValueError
        They do not make one three-dimensional image of real numbers.
    """
    files = sorted((f for f in folder.iterdir() if f.is_file()), key=_natural)
    tiffs = [f for f in files if formats.suffix(f) in (".tif", ".tiff")]
    slices = _dicom_slices(folder) or [str(f) for f in tiffs]
    if not slices:
        raise OSError(f"{folder.name} must be a folder of DICOM or TIFF slices; none of its {len(files)} files is one")
    if len(slices) == 1:
        return read_image(Path(slices[0]))
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames(slices)
    return _volume(folder, _executed(folder, reader))


def _dicom_slices(folder: Path) -> list[str]:
    sitk.ProcessObject.GlobalWarningDisplayOff()
    series: Sequence[str] = sitk.ImageSeriesReader.GetGDCMSeriesIDs(str(folder))
    if not series:
        return []
    found = [list(sitk.ImageSeriesReader.GetGDCMSeriesFileNames(str(folder), name)) for name in series]
    longest = max(found, key=len)
    if len(found) > 1:
        sizes = ", ".join(str(len(slices)) for slices in found)
        warnings.warn(
            f"{folder.name} holds {len(found)} DICOM series ({sizes} slices): the longest was taken",
            SimplexMeshWarning,
            stacklevel=2,
        )
    return longest


def _executed(path: Path, reader: Any) -> sitk.Image:
    sitk.ProcessObject.GlobalWarningDisplayOff()
    try:
        return reader.Execute()
    except RuntimeError as error:
        raise OSError(f"{path.name} cannot be read as a volume: {_reason(str(error))}") from None


def _reason(text: str) -> str:
    """Return what ITK complains of, without the places in its sources."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    lines = [
        re.sub(r"^(sitk::ERROR|itk::ERROR|ITK ERROR): ", "", line) for line in lines if "Exception thrown" not in line
    ]
    lines = [re.sub(r"^\w+\(0x[0-9a-f]+\): ", "", line) for line in lines]
    return re.sub(r"^\[nrrd\] \w+: ", "", lines[-1]).rstrip(".") if lines else "no reason given"


def _volume(path: Path, image: sitk.Image) -> Volume:
    if image.GetNumberOfComponentsPerPixel() != 1:
        raise ValueError(f"{path.name} must hold one number per voxel, not {image.GetNumberOfComponentsPerPixel()}")
    while image.GetDimension() > 3 and image.GetSize()[-1] == 1:
        image = image[(slice(None),) * (image.GetDimension() - 1) + (0,)]
    if image.GetDimension() != 3:
        raise ValueError(f"{path.name} must hold one volume of 3 dimensions, not an image of size {image.GetSize()}")
    values = np.asarray(_Kept(image)).T
    direction = np.reshape(image.GetDirection(), (3, 3))
    return Volume(values, spacing=image.GetSpacing(), origin=image.GetOrigin(), direction=direction)


def _natural(path: Path) -> list[Any]:
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", path.name.lower())]


_META_BYTES = {"CHAR": 1, "SHORT": 2, "INT": 4, "LONG": 4, "LONG_LONG": 8, "FLOAT": 4, "DOUBLE": 8}


def _check_metaimage(path: Path) -> None:
    """Check that the samples are there; ITK itself prints its complaints and says little."""
    with path.open("rb") as file:
        text = file.read(1 << 16).decode("latin-1")
    fields = dict(re.findall(r"^\s*(\w+)\s*=\s*(.*?)\s*$", text.split("\0")[0], re.MULTILINE))
    name = fields.get("ElementDataFile")
    if name is None or not {"DimSize", "ElementType"} <= fields.keys():
        raise OSError(f"{path.name} is a MetaImage header without DimSize, ElementType or ElementDataFile")
    for line in ("ElementSpacing", "ElementSize"):
        if any(float(word) <= 0 for word in fields.get(line, "").split()):
            raise ValueError(f"{path.name} must have positive spacing, not {line} = {fields[line]}")
    if name.upper() in ("LOCAL", "LIST") or "%" in name:
        return
    raw = path.parent / name
    if not raw.is_file():
        raise FileNotFoundError(f"{path.name} refers to {name}, which is not in its folder")
    wanted = _META_BYTES.get(fields["ElementType"].removeprefix("MET_").replace("UCHAR", "CHAR").removeprefix("U"), 0)
    wanted *= int(fields.get("ElementNumberOfChannels", "1"))
    for word in fields["DimSize"].split():
        wanted *= int(word)
    if fields.get("CompressedData", "False").lower() != "true" and raw.stat().st_size < wanted:
        raise OSError(f"{path.name} needs {wanted:,} bytes in {name}, which has {raw.stat().st_size:,}: truncated")


def _check_nifti(path: Path) -> None:
    """Check that no sample is missing; ITK reads truncated NIfTI files without a word."""
    with path.open("rb") as file:
        zipped = file.read(2) == b"\x1f\x8b"
    with gzip.open(path) if zipped else path.open("rb") as stream:
        head = stream.read(352)
        wanted = _nifti_size(head)
    if zipped:
        with path.open("rb") as file:
            file.seek(-4, 2)
            if int.from_bytes(file.read(4), "little") == wanted % (1 << 32):
                return
        have = _unzipped_size(path)
    else:
        have = path.stat().st_size
    if have < wanted:
        raise OSError(f"{path.name} must have {wanted:,} bytes, it has {have:,}: truncated")


def _nifti_size(head: bytes) -> int:
    little = "<" if head[:4] in (b"\x5c\x01\0\0", b"\x1c\x02\0\0") else ">"
    if head[4:7] in (b"n+2", b"ni2"):
        bits = struct.unpack(little + "h", head[14:16])[0]
        dims = struct.unpack(little + "8q", head[16:80])
        offset = struct.unpack(little + "q", head[168:176])[0]
    else:
        dims = struct.unpack(little + "8h", head[40:56])
        bits = struct.unpack(little + "h", head[72:74])[0]
        offset = int(struct.unpack(little + "f", head[108:112])[0])
    samples = 1
    for n in dims[1 : 1 + min(max(dims[0], 0), 7)]:
        samples *= n
    return offset + samples * bits // 8


def _unzipped_size(path: Path) -> int:
    total = 0
    with gzip.open(path) as stream:
        try:
            while piece := stream.read(1 << 22):
                total += len(piece)
        except (EOFError, OSError):
            pass
    return total
