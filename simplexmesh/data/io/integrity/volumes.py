"""Checks of volume files that ITK does not make: it reads truncated files and damaged compressed samples silently."""

from __future__ import annotations

import gzip
import math
import re
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from simplexmesh.data.io.integrity.headers import check_beside, metaimage_header, nrrd_header

_META_BYTES = {"CHAR": 1, "SHORT": 2, "INT": 4, "LONG": 4, "LONG_LONG": 8, "FLOAT": 4, "DOUBLE": 8}
_NRRD_BYTES = (("char", 1), ("short", 2), ("long", 8), ("double", 8), ("int", 4), ("float", 4))
_MOST_UNPACKED = {"raw": 1, "gzip": 1040, "gz": 1040, "txt": 4, "text": 4, "ascii": 4, "hex": 1}
"""Bytes of samples, of eight at most, that one byte of a file can hold, by encoding."""

_PIECE = 1 << 16  # bytes read at once; unpacked they may be a thousand times as many
MEGABYTE = 1 << 20
LONGEST_AXIS = 1e6  # of a rotation: one
_ANY_STREAM, _GZIP = 47, b"\x1f\x8b"
_SUBFILE, _SAMPLES, _TILE_WIDTH, _PAGE_KIND = 254, 277, 322, (256, 257, 277, 339, 258)
"""Tags of TIFF; the last are width, height, samples of a pixel, their format and their bits, of colors elsewhere."""

_SHORT, _PAGE = 3, 2  # a type of numbers, and the mark of one page of many; others are of thumbnails and masks


def check_metaimage(path: Path) -> None:
    """Check that the header is complete and consistent, and that all samples are present and undamaged."""
    fields, listed, start = metaimage_header(path)
    name = fields.get("ElementDataFile")
    if name is None or not {"DimSize", "ElementType"} <= fields.keys():
        raise OSError(f"{path.name} is a MetaImage header without DimSize, ElementType or ElementDataFile")
    try:
        wanted, skipped = _meta_size(path.name, fields), max(0, int(fields.get("HeaderSize", "0")))
    except ValueError:
        raise OSError(f"{path.name} is a MetaImage with a damaged header") from None
    _check_turn(path.name, fields)
    if name.startswith("LIST") or "%" in name:
        for each in [_pattern(name), *(listed if "%" not in name else ())]:
            check_beside(path, each)
        return
    packed = fields.get("CompressedData", "False")[:1] in ("T", "t", "1")
    if packed and "CompressedDataSize" not in fields:
        raise OSError(f"{path.name} is a compressed MetaImage without CompressedDataSize")
    raw = path
    if name in ("LOCAL", "Local", "local"):
        skipped = start
    else:
        check_beside(path, name)
        raw = path.parent / name
        if not raw.is_file():
            raise FileNotFoundError(f"{path.name} refers to {name}, which is not in its folder")
    stored = int(fields["CompressedDataSize"]) if packed else wanted
    _check_length(path, raw, skipped + stored)
    if packed and _unpacked_size(raw, skipped, stored, wanted) != wanted:
        raise OSError(f"{path.name} has damaged compressed samples")


def _pattern(name: str) -> str:
    """Return the pattern of numbered files, which the first, last and step may follow."""
    return re.sub(r"(\s+-?\d+){0,3}\s*$", "", name)


def _check_turn(name: str, fields: dict[str, str]) -> None:
    """Refuse axes that no rotation has: with large numbers ITK does not end."""
    for line in ("TransformMatrix", "Rotation", "Orientation"):
        try:
            numbers = [float(word) for word in fields.get(line, "").split()]
        except ValueError:
            numbers = [math.inf]
        if not all(abs(number) <= LONGEST_AXIS for number in numbers):
            raise OSError(f"{name} has a damaged header: {line} = {fields[line][:60]}")


def _meta_size(name: str, fields: dict[str, str]) -> int:
    """Return the number of bytes of the samples of a MetaImage."""
    dimensions = int(fields.get("NDims", "3"))
    for line in ("DimSize", "ElementSpacing", "ElementSize"):
        words = fields.get(line, "").split()
        if line in fields and len(words) != dimensions:
            raise OSError(f"{name} has a damaged header: {line} must have {dimensions} numbers, not {len(words)}")
        if line != "DimSize" and any(float(word) <= 0 for word in words):
            raise OSError(f"{name} must have positive spacing, not {line} = {fields[line]}")
    size = _META_BYTES.get(fields["ElementType"].removeprefix("MET_").replace("UCHAR", "CHAR").removeprefix("U"), 0)
    for word in [*fields["DimSize"].split(), fields.get("ElementNumberOfChannels", "1")]:
        size *= int(word)
    return size


def _check_length(path: Path, raw: Path, wanted: int) -> None:
    if raw.stat().st_size < wanted:
        where = "" if raw == path else f" in {raw.name}"
        needed = f"{wanted:,}" if wanted < 1 << 64 else "more than 2^64"
        raise OSError(f"{path.name} must have {needed} bytes{where}, it has {raw.stat().st_size:,}: truncated")


def _unpacked_size(path: Path, start: int, stored: int, enough: int) -> int:
    """Return the bytes in a zlib or gzip stream, at most a megabyte more than `enough`; -1 if it is damaged."""
    unpack, total, piece, end = zlib.decompressobj(wbits=_ANY_STREAM), 0, b"", start + stored
    with path.open("rb") as file:
        file.seek(start)
        try:
            while piece or (piece := file.read(max(0, min(end - file.tell(), _PIECE)))):
                if unpack.eof and not piece.startswith(_GZIP):
                    break
                unpack = zlib.decompressobj(wbits=_ANY_STREAM) if unpack.eof else unpack
                total += len(unpack.decompress(piece))
                piece = unpack.unused_data
                if total > enough + MEGABYTE:
                    return total
        except zlib.error:
            return -1
    return total if unpack.eof else -1


def check_nrrd(path: Path) -> None:
    """Check that all samples are present, as far as their encoding tells, and undamaged if compressed by gzip."""
    fields, listed, start = nrrd_header(path)
    name = fields.get("datafile")
    for each in listed if name is None or name.startswith("LIST") else [_pattern(name)]:
        drive = each.strip()[1:2] == ":"  # taken for one by ITK, which then looks in the current folder
        check_beside(path, str(Path(each.strip()).absolute()) if drive else each)
    raw = path if name is None else path.parent / name
    if not raw.is_file() or (name is None and not start):  # several files, or none: left to ITK
        return
    start, wanted, encoding = 0 if name else start, _nrrd_size(fields), fields.get("encoding", "").lower()
    have = _MOST_UNPACKED.get(encoding, math.inf) * (raw.stat().st_size - start)
    if have >= wanted and encoding in ("gzip", "gz") and not {"lineskip", "byteskip"} & fields.keys():
        have = _unpacked_size(raw, start, raw.stat().st_size, wanted)
        if have < 0:
            raise OSError(f"{path.name} has damaged compressed samples")
    if have < wanted:
        raise OSError(f"{path.name} must have {wanted:,} bytes of samples, it has {have:,} at most: truncated")


def _nrrd_size(fields: dict[str, str]) -> int:
    """Return the number of bytes of the samples of an NRRD file, 0 if its header does not tell."""
    words, kind = fields.get("sizes", "").split(), fields.get("type", "").lower()
    bits = re.search(r"\d+", kind)
    size = int(bits[0]) // 8 if bits else next((n for word, n in _NRRD_BYTES if word in kind), 0)
    return size * math.prod(int(word) for word in words) if all(word.isdigit() for word in words) else 0


def check_nifti(path: Path) -> None:
    """Check that all samples are present, and undamaged if compressed."""
    with path.open("rb") as file:
        zipped = file.read(2) == _GZIP
    try:
        with gzip.open(path) if zipped else path.open("rb") as stream:
            head = stream.read(352)
    except (zlib.error, EOFError):
        raise OSError(f"{path.name} has damaged compressed samples") from None
    try:
        wanted = nifti_size(head)
    except ValueError:  # NaN for a place
        raise OSError(f"{path.name} is a NIfTI file with a damaged header") from None
    raw = nifti_samples(path) if is_nifti_pair(head) else path
    if raw is None:
        raise FileNotFoundError(f"{path.name} refers to {path.stem}.img, which is not in its folder")
    if raw != path:
        check_beside(path, raw.name)
        zipped = raw.suffix == ".gz"
    if not zipped:
        _check_length(path, raw, wanted)
    elif (have := _unpacked_size(raw, 0, raw.stat().st_size, wanted)) < wanted:
        found = "is truncated or damaged" if have < 0 else f"must have {wanted:,} bytes, it has {have:,}: truncated"
        raise OSError(f"{raw.name} {found}")


def is_nifti_pair(head: bytes) -> bool:
    """Whether the samples of a NIfTI header are in a file beside it."""
    return head[344:347] == b"ni1" or head[4:7] == b"ni2"


def _nifti_kind(head: bytes) -> tuple[str, bool]:
    """Return the byte order of a NIfTI header, and whether it is of version 2."""
    return "<" if head[:4] in (b"\x5c\x01\0\0", b"\x1c\x02\0\0") else ">", head[4:7] in (b"n+2", b"ni2")


def nifti_samples(path: Path) -> Path | None:
    """Return the file of the samples beside a NIfTI header."""
    names = (path.with_suffix(ending) for ending in (".img", ".IMG", ".img.gz"))
    return next((each for each in names if each.is_file()), None)


def nifti_scaling(head: bytes) -> tuple[int, str, float, float]:
    """Return the place and form of slope and offset in a NIfTI header, and these."""
    order, second = _nifti_kind(head)
    at, form = (176, order + "2d") if second else (112, order + "2f")
    slope, offset = struct.unpack_from(form, head, at)
    return at, form, slope, offset


def nifti_unit_place(head: bytes) -> int:
    """Return the place of the byte in a NIfTI header that holds the units."""
    order, second = _nifti_kind(head)
    return 123 if not second else 500 if order == "<" else 503


def nifti_size(head: bytes) -> int:
    """Return the number of bytes of a NIfTI file with this header, samples included if they are in it."""
    order, second = _nifti_kind(head)
    if second:
        bits = struct.unpack(order + "h", head[14:16])[0]
        dims = struct.unpack(order + "8q", head[16:80])
        offset = struct.unpack(order + "q", head[168:176])[0]
    else:
        dims = struct.unpack(order + "8h", head[40:56])
        bits = struct.unpack(order + "h", head[72:74])[0]
        offset = int(min(max(struct.unpack(order + "f", head[108:112])[0], 0.0), 1e18))
    samples = 1
    for n in dims[1 : 1 + min(max(dims[0], 0), 7)]:
        samples *= n
    return offset + samples * bits // 8


def check_tiff(path: Path) -> None:
    """Check that the list of pages is not cut off, and that no page is tiled, of which ITK makes colors."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(16)
        order = "<" if head[:2] == b"II" else ">"
        big = struct.unpack(order + "H", head[2:4])[0] == 43
        if len(head) < 16:
            raise OSError(f"{path.name} has only {size} bytes: truncated")
        page = struct.unpack(order + "Q", head[8:16])[0] if big else struct.unpack(order + "I", head[4:8])[0]
        pages = 0
        seen, kinds = set(), set()
        while page and page not in seen:
            seen.add(page)
            following, kind = _next_page(file, page, order, big=big)
            if following is None:
                raise OSError(f"{path.name} ends within page {pages + 1} of its images: truncated")
            kinds |= {kind} if kind else set()
            page, pages = following, pages + 1
        if len(kinds) > 1:  # ITK makes room for the first
            raise OSError(f"{path.name} must have images of one size and type in its {pages} pages")


def _next_page(file: BinaryIO, page: int, order: str, *, big: bool) -> tuple[int | None, tuple[int, ...]]:
    """Return where the next page is, None in a truncated file, and the size and type of this one unless it is small."""
    count_form, entry, offset_form = ("Q", 20, "Q") if big else ("H", 12, "I")
    file.seek(page)
    count = file.read(struct.calcsize(order + count_form))
    if len(count) < struct.calcsize(order + count_form):
        return None, ()
    length = entry * struct.unpack(order + count_form, count)[0]
    tags = file.read(min(length, _PIECE))
    values = {}
    for at in range(0, len(tags) - entry + 1, entry):
        tag, form = struct.unpack_from(order + "2H", tags, at)
        values[tag] = struct.unpack_from(order + ("H" if form == _SHORT else "I"), tags, at + (12 if big else 8))[0]
    if _TILE_WIDTH in values:
        raise OSError(f"{Path(file.name).name} is a tiled TIFF file; only strips are supported")
    gray = values.get(_SAMPLES, 1) == 1
    kind = () if values.get(_SUBFILE, 0) & ~_PAGE else tuple(values.get(tag, 1) for tag in _PAGE_KIND[: 4 + gray])
    file.seek(page + struct.calcsize(order + count_form) + length)
    offset = file.read(struct.calcsize(order + offset_form))
    whole = len(offset) == struct.calcsize(order + offset_form)
    return (struct.unpack(order + offset_form, offset)[0] if whole else None), kind


CHECKS: dict[str, Callable[[Path], None]] = {
    "metaimage": check_metaimage,
    "nrrd": check_nrrd,
    "nifti": check_nifti,
    "tiff": check_tiff,
}
