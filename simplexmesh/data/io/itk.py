"""Read and write volumes: NIfTI, NRRD, MetaImage, DICOM and TIFF, by SimpleITK.

Physical space is ITK's, LPS: x to the left of the patient, y to the back, z to the head; of NIfTI too, which is RAS.
"""

from __future__ import annotations

import gzip
import re
import shutil
import struct
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk  # noqa: N813

from simplexmesh._base.errors import warn
from simplexmesh._base.units import known_unit
from simplexmesh.data.io import formats
from simplexmesh.data.io.integrity import volumes
from simplexmesh.data.io.integrity.headers import nrrd_header
from simplexmesh.data.volume import Volume

_SPACING_TOLERANCE = 0.01
_READERS = {"metaimage": "MetaImageIO", "dicom": "GDCMImageIO"}
"""Of formats that ITK looks for by the name of the file, which may end in capitals or not at all."""
_BIG_ENDIAN = b"1.2.840.10008.1.2.2\0"
_NO_IMAGE = "it has no image, or a damaged one, or one in a form that ITK does not know"


class _Samples:
    """NumPy view of the samples of an ITK image that keeps the image alive, so that volumes are not copied."""

    def __init__(self, image: sitk.Image) -> None:
        self.image = image
        self.__array_interface__ = sitk.GetArrayViewFromImage(image).__array_interface__


def read_image(path: Path) -> Volume:
    """Read a volume from one file; its header may refer to another."""
    kind = formats.format_of(path)
    if kind in volumes.CHECKS:
        volumes.CHECKS[kind](path)
    with _unambiguous(path) as unambiguous, _scaled_by_standard(unambiguous, kind) as readable:
        reader = sitk.ImageFileReader()
        reader.SetFileName(str(readable))
        if kind in _READERS:
            reader.SetImageIO(_READERS[kind])
        image = _execute(path, reader, dicom=kind == "dicom")
        if kind == "dicom":
            _check_byte_order(path, image)
        unit = "mm" if kind == "dicom" else _unit(image)
        return volume_of(path.name, image, _unit_of_nrrd(path) if unit is None and kind == "nrrd" else unit)


def _unit(image: sitk.Image) -> str | None:
    """Return the unit of length that the header of a file names."""
    found = {key: image.GetMetaData(key) for key in ("xyzt_units", "unit") if image.HasMetaDataKey(key)}
    if found.get("xyzt_units", "0").isdigit() and int(found.get("xyzt_units", "0")) % 8:
        return "mm"  # ITK converts meters and micrometers
    return known_unit(found.get("unit"))


def _unit_of_nrrd(path: Path) -> str | None:
    """Return the unit of length of all axes of an NRRD file, which ITK does not tell."""
    fields = nrrd_header(path)[0]
    words = set(re.findall(r'"(.*?)"', fields.get("spaceunits", fields.get("units", ""))))
    return known_unit(words.pop()) if len(words) == 1 else None


def volume_of_image(image: sitk.Image, name: str) -> Volume:
    """Return the caller's image as a volume; ITK copies the samples when one of the two changes."""
    return volume_of(name, sitk.Image(image), _unit(image))


@contextmanager
def _unambiguous(path: Path) -> Iterator[Path]:
    """Link `scan.nii.gz` under another name if `scan.nii` exists too: ITK would read the samples of the latter."""
    if formats.suffix(path) != ".nii.gz" or not path.with_name(path.name[:-3]).exists():
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        link = Path(folder, "volume.nii.gz")
        link.symlink_to(path.absolute())
        yield link


@contextmanager
def _scaled_by_standard(path: Path, kind: str) -> Iterator[Path]:
    """Copy a NIfTI file whose slope is zero, which means no scaling: ITK would add the offset."""
    with path.open("rb") as file:
        opened: Any = gzip.open if file.read(2) == b"\x1f\x8b" else open
    at, form, slope, offset = 0, "", 1.0, 0.0
    if kind == "nifti":
        with opened(path, "rb") as file:
            head = file.read(352)
        at, form, slope, offset = volumes.nifti_scaling(head)
    if offset == 0 or (slope != 0 and np.isfinite(slope)):
        yield path
        return
    pair = volumes.is_nifti_pair(head)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "volume.hdr" if pair else "volume.nii")
        with opened(path, "rb") as source, copy.open("w+b") as out:
            left = max(volumes.nifti_size(head), len(head))  # what follows may be without end
            while left > 0 and (piece := source.read(min(left, volumes.MEGABYTE))):
                out.write(piece)
                left -= len(piece)
            out.seek(at)
            out.write(struct.pack(form, 1.0, 0.0))
        samples = volumes.nifti_samples(path) if pair else None
        if samples is not None:
            Path(folder, "volume" + samples.name[len(path.stem) :]).symlink_to(samples.absolute())
        yield copy


def read_series(folder: Path) -> Volume:
    """Read a volume from a folder of slices: a DICOM series, or TIFF files in the order of their names."""
    files = sorted((f for f in folder.iterdir() if f.is_file()), key=_natural_order)
    tiffs = [f for f in files if formats.suffix(f) in (".tif", ".tiff")]
    dicom = _dicom_slices(folder)
    _check_positions(folder, dicom)
    slices = dicom or [str(f) for f in tiffs]
    if not slices:
        raise OSError(f"{folder.name} must be a folder of DICOM or TIFF slices; none of its {len(files)} files is one")
    if len(slices) == 1:
        return read_image(Path(slices[0]))
    for file in [] if dicom else tiffs:
        if formats.format_of(file) == "tiff":
            volumes.check_tiff(file)
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames(slices)
    return volume_of(folder.name, _execute(folder, reader, dicom=bool(dicom)), "mm" if dicom else None)


def _dicom_slices(folder: Path) -> list[str]:
    sitk.ProcessObject.GlobalWarningDisplayOff()
    series: Sequence[str] = sitk.ImageSeriesReader.GetGDCMSeriesIDs(str(folder))
    if not series:
        return []
    found = [list(sitk.ImageSeriesReader.GetGDCMSeriesFileNames(str(folder), name)) for name in series]
    longest = max(found, key=len)
    if len(found) > 1:
        sizes = ", ".join(str(len(slices)) for slices in found)
        warn(f"{folder.name} holds {len(found)} DICOM series ({sizes} slices): the longest was read")
    return longest


def _check_positions(folder: Path, slices: Sequence[str]) -> None:
    """Check that slices are equally spaced along their normal: ITK would use the mean distance, stretch or shear."""
    if len(slices) < 2:
        return
    reader = sitk.ImageFileReader()
    reader.SetImageIO("GDCMImageIO")
    origins, normals = [], []
    for name in slices:
        reader.SetFileName(name)
        try:
            reader.ReadImageInformation()
        except RuntimeError:
            raise OSError(f"{folder.name}: {Path(name).name} cannot be read: {_NO_IMAGE}") from None
        _check_byte_order(Path(name), reader)
        origins.append(reader.GetOrigin())
        normals.append(np.reshape(reader.GetDirection(), (3, 3))[:, 2])
    steps = np.diff(origins, axis=0)
    along = (steps * normals[0]).sum(axis=1)
    gaps = np.abs(along)
    if not gaps.any():
        found = "slices at one position, or without any: a series in time, or of unknown order and distance"
        warn(f"{folder.name} holds {len(slices)} {found}")
        return
    usual = float(np.median(gaps[gaps > 0]))
    k = int(np.abs(gaps - usual).argmax())
    if abs(gaps[k] - usual) > _SPACING_TOLERANCE * usual:
        seems = "a slice seems to be missing" if gaps[k] > usual else "slices seem to be duplicated"
        raise OSError(
            f"{folder.name} has a gap of {gaps[k]:g} mm between slices {k + 1} and {k + 2}, others {usual:g} mm; "
            f"{seems}"
        )
    aside = float(np.linalg.norm(steps - along[:, None] * normals[0], axis=1).max())
    if aside > _SPACING_TOLERANCE * usual:
        raise OSError(
            f"{folder.name} has slices shifted by {aside:g} mm against each other, as with a tilted gantry; "
            "the axes of a volume must be perpendicular"
        )


def _check_byte_order(path: Path, header: Any) -> None:
    """Refuse big-endian samples of DICOM longer than two bytes: ITK swaps the bytes of their halves only."""
    with path.open("rb") as file:
        big = _BIG_ENDIAN in file.read(formats.HEAD)
    bits = header.GetMetaData("0028|0100") if header.HasMetaDataKey("0028|0100") else "0"
    if big and int(bits) > 16:
        found = f"{path.name} has samples of {int(bits)} bits in big-endian order, which ITK gets wrong"
        raise OSError(f"{found}: convert it to little-endian, as with dcmconv +te")


def _execute(path: Path, reader: Any, *, dicom: bool) -> sitk.Image:
    sitk.ProcessObject.GlobalWarningDisplayOff()
    try:
        return reader.Execute()
    except RuntimeError as error:
        reason = _NO_IMAGE if dicom else _reason(str(error))
        raise OSError(f"{path.name} cannot be read as a volume: {reason}") from None


def _reason(text: str) -> str:
    """Return the error message of ITK without its source locations."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    lines = [
        re.sub(r"^(sitk::ERROR|itk::ERROR|ITK ERROR): ", "", line) for line in lines if "Exception thrown" not in line
    ]
    lines = [re.sub(r"^\w+\(0x[0-9a-f]+\): ", "", line) for line in lines if line != "Reason: Success"]
    return re.sub(r"^\[nrrd\] \w+: ", "", lines[-1]).rstrip(".") if lines else "no reason given"


def volume_of(name: str, image: sitk.Image, unit: str | None = None) -> Volume:
    """Return an image of ITK as a volume that shares its samples."""
    if image.GetNumberOfComponentsPerPixel() != 1:
        raise ValueError(f"{name} must hold one number per voxel, not {image.GetNumberOfComponentsPerPixel()}")
    while image.GetDimension() > 3 and image.GetSize()[-1] == 1:
        image = image[(slice(None),) * (image.GetDimension() - 1) + (0,)]
    if image.GetDimension() != 3:
        raise ValueError(f"{name} must hold one volume of 3 dimensions, not an image of size {image.GetSize()}")
    if min(image.GetSize()) < 2:
        raise ValueError(f"{name} must hold a volume, not one slice {image.GetSize()}; give the folder of all slices")
    values = np.asarray(_Samples(image)).T
    direction = np.reshape(image.GetDirection(), (3, 3))
    return Volume(values, spacing=image.GetSpacing(), origin=image.GetOrigin(), direction=direction, unit=unit)


def _natural_order(path: Path) -> list[Any]:
    """Return a sort key that compares runs of digits as numbers."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", path.name.lower())]


def write_image(part: Path, volume: Volume) -> None:
    """Write a volume in the medical format its name says."""
    nifti = ".nii" in part.name.lower()[-7:]
    if nifti and volume.unit is not None:
        volume = volume.in_unit("mm")  # what ITK writes into the header
    image = sitk.GetImageFromArray(volume.values.T)
    if volume.unit is not None and not nifti:
        image.SetMetaData("unit", volume.unit)
    image.SetSpacing(volume.spacing.tolist())
    image.SetOrigin(volume.origin.tolist())
    image.SetDirection(volume.direction.ravel().tolist())
    try:
        if nifti and volume.unit is None:
            _write_nifti_without_unit(image, part)
        else:
            sitk.WriteImage(image, str(part), useCompression=True)
    except RuntimeError as error:
        raise OSError(f"{part.name} cannot be written: {str(error).splitlines()[-1]}") from None


def _write_nifti_without_unit(image: Any, part: Path) -> None:
    """Write a NIfTI file whose unit of length is unknown: ITK always says millimeters."""
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder, "volume.nii")
        sitk.WriteImage(image, str(plain))
        with plain.open("r+b") as file:
            head = file.read(352)
            at = volumes.nifti_unit_place(head)
            file.seek(at)
            file.write(bytes([head[at] & ~7]))  # the other bits are the unit of time
            file.seek(0)
            with gzip.open(part, "wb", 6) if part.suffix == ".gz" else part.open("wb") as out:
                shutil.copyfileobj(file, out)
