"""Whether the headers of LAS and E57 files agree with the files, before libraries make room for what they say."""

from __future__ import annotations

import struct
from pathlib import Path

MOST_POINTS = 200
"""For each byte of a LAZ file: identical points are packed 143 into one."""

_RECORD_BYTES = (20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67)
"""Of the point formats 0 to 10 (LAS 1.4 R15, table 5)."""

_CHUNKS = struct.Struct("<II")


def check_las(path: Path) -> None:
    """Refuse a LAS or LAZ file that is shorter than its header says, or whose header contradicts itself."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(375)
    if len(head) < 227 or (head[25] >= 4 and len(head) < 375):
        raise OSError(f"{path.name} is a LAS file with {size:,} bytes, less than its header has: truncated")
    header, start, records, kind, width, count = struct.unpack_from("<HIIBHI", head, 94)
    if head[25] >= 4:
        (count,) = struct.unpack_from("<Q", head, 247)
    packed, kind = kind > 63, kind & 63
    if head[24] != 1 or kind >= len(_RECORD_BYTES):
        raise OSError(f"{path.name} must be LAS 1 with points of format 0 to 10, not {head[24]} with {kind}")
    if not 227 <= header <= start or width < _RECORD_BYTES[kind] or 54 * records > start - header:
        raise OSError(f"{path.name} is a LAS file with a damaged header")
    if not count:
        raise OSError(f"{path.name} must have points, its header says 0")
    wanted = start + (8 if packed else count * width)
    if wanted > size or (packed and count > MOST_POINTS * size):
        wanted = max(wanted, count // MOST_POINTS)
        raise OSError(f"{path.name} must have {wanted:,} bytes or more by its header, it has {size:,}: truncated")
    if packed:
        _check_chunks(path, start, size)


def _check_chunks(path: Path, start: int, size: int) -> None:
    """Refuse a LAZ file whose table of chunks is not in it or longer than it; programs stopped early leave none."""
    with path.open("rb") as file:
        file.seek(start)
        (at,) = struct.unpack("<q", file.read(8))
        if at == -1:  # written at the end by programs that cannot go back
            file.seek(size - 8)
            (at,) = struct.unpack("<q", file.read(8))
        if not start + 8 <= at <= size - _CHUNKS.size:
            raise OSError(f"{path.name} is a LAZ file without its table of chunks: truncated or damaged")
        file.seek(at)
        _, chunks = _CHUNKS.unpack(file.read(_CHUNKS.size))
    if chunks > at - start:
        raise OSError(f"{path.name} is a LAZ file with {chunks:,} chunks in {at - start:,} bytes: damaged")


def check_e57(path: Path) -> None:
    """Refuse an E57 file of another length than its header says, or whose XML defines entities."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(48)
        if len(head) < 48:
            raise OSError(f"{path.name} is an E57 file with {size:,} bytes, less than its header has: truncated")
        length, at, count, page = struct.unpack_from("<QQQQ", head, 16)
        if length != size:
            cut = "truncated" if length > size else "damaged"
            raise OSError(f"{path.name} must have {length:,} bytes by its header, it has {size:,}: {cut}")
        if page != 1024 or count > size or at > size:
            raise OSError(f"{path.name} is an E57 file with a damaged header")
        first = at - at % page
        file.seek(first)
        pages = file.read((at - first + count) // (page - 4) * page + page)
    text = b"".join(pages[k : k + page - 4] for k in range(0, len(pages), page))[at - first :][:count]
    if len(text) < count or b"<!" in text.replace(b"<!--", b"").replace(b"<![CDATA[", b"") or b"\0" in text:
        raise OSError(f"{path.name} is an E57 file whose description is damaged or defines entities")
