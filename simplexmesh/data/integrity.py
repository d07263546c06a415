"""Completeness checks of volume files that ITK does not make: it reads truncated NIfTI and TIFF files silently.

For MetaImage it only prints the errors.
"""

from __future__ import annotations

import gzip
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

_META_BYTES = {"CHAR": 1, "SHORT": 2, "INT": 4, "LONG": 4, "LONG_LONG": 8, "FLOAT": 4, "DOUBLE": 8}


def check_metaimage(path: Path) -> None:
    """Check that the header is complete and that all samples are present."""
    with path.open("rb") as file:
        text = file.read(1 << 16).decode("latin-1")
    fields = dict(re.findall(r"^\s*(\w+)\s*=\s*(.*?)\s*$", text.split("\0")[0], re.MULTILINE))
    name = fields.get("ElementDataFile")
    if name is None or not {"DimSize", "ElementType"} <= fields.keys():
        raise OSError(f"{path.name} is a MetaImage header without DimSize, ElementType or ElementDataFile")
    for line in ("ElementSpacing", "ElementSize"):
        if any(float(word) <= 0 for word in fields.get(line, "").split()):
            raise ValueError(f"{path.name} must have positive spacing, not {line} = {fields[line]}")
    if name.upper() == "LIST" or "%" in name:
        return
    wanted = _META_BYTES.get(fields["ElementType"].removeprefix("MET_").replace("UCHAR", "CHAR").removeprefix("U"), 0)
    for word in [*fields["DimSize"].split(), fields.get("ElementNumberOfChannels", "1")]:
        wanted *= int(word)
    if fields.get("CompressedData", "False").lower() == "true":
        wanted = int(fields.get("CompressedDataSize", "0"))
    raw = path
    if name.upper() == "LOCAL":
        end = re.search(r"ElementDataFile\s*=\s*LOCAL\s*?\n", text, re.IGNORECASE)
        wanted += end.end() if end else 0
    else:
        raw = path.parent / name
        if not raw.is_file():
            raise FileNotFoundError(f"{path.name} refers to {name}, which is not in its folder")
    if raw.stat().st_size < wanted:
        where = "" if raw == path else f" in {name}"
        raise OSError(f"{path.name} must have {wanted:,} bytes{where}, it has {raw.stat().st_size:,}: truncated")


def check_nifti(path: Path) -> None:
    """Check that all samples are present."""
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
            while piece := stream.read(1 << 16):
                total += len(piece)
        except (EOFError, OSError):
            pass
    return total


def check_tiff(path: Path) -> None:
    """Check that the linked list of pages is not cut off by the end of the file."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(16)
        order = "<" if head[:2] == b"II" else ">"
        big = struct.unpack(order + "H", head[2:4])[0] == 43
        if len(head) < 16:
            raise OSError(f"{path.name} has only {size} bytes: truncated")
        page = struct.unpack(order + "Q", head[8:16])[0] if big else struct.unpack(order + "I", head[4:8])[0]
        pages = 0
        seen = set()
        while page and page not in seen:
            seen.add(page)
            following = _next_page(file, page, order, big=big)
            if following is None:
                raise OSError(f"{path.name} ends within page {pages + 1} of its images: truncated")
            page, pages = following, pages + 1


def _next_page(file: BinaryIO, page: int, order: str, *, big: bool) -> int | None:
    count_form, entry, offset_form = ("Q", 20, "Q") if big else ("H", 12, "I")
    file.seek(page)
    count = file.read(struct.calcsize(order + count_form))
    if len(count) < struct.calcsize(order + count_form):
        return None
    file.seek(entry * struct.unpack(order + count_form, count)[0], 1)
    offset = file.read(struct.calcsize(order + offset_form))
    return (
        struct.unpack(order + offset_form, offset)[0] if len(offset) == struct.calcsize(order + offset_form) else None
    )


CHECKS: dict[str, Callable[[Path], None]] = {"metaimage": check_metaimage, "nifti": check_nifti, "tiff": check_tiff}
