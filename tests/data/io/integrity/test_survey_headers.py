"""Headers of LAS and E57 files, made by hand: at the edge of what is sound, and one beyond it."""

from __future__ import annotations

import struct

import pytest

from simplexmesh.data.io.integrity import survey

WIDTHS = {0: 20, 1: 28, 2: 26, 3: 34, 4: 57, 5: 63, 6: 30, 7: 36, 8: 38, 9: 59, 10: 67}


def las(version=2, header=None, start=None, records=0, kind=0, width=None, count=3, size=None, major=1):
    """A file of zeros but for the public header block."""
    header = (375 if version >= 4 else 227) if header is None else header
    start = header + 54 * records if start is None else start
    width = WIDTHS.get(kind & 63, 20) if width is None else width
    head = bytearray(375)
    head[24], head[25] = major, version
    struct.pack_into("<HIIBHI", head, 94, header, start, records, kind, width, 99 if version >= 4 else count)
    if version >= 4:
        struct.pack_into("<Q", head, 247, count)
    size = start + count * width if size is None else size
    return bytes(head).ljust(size, b"\0")[:size]


def laz(at, chunks=1, size=600, count=3):
    """A packed file whose table of chunks is at a place, which is at its start or, if negative, at its end."""
    out = bytearray(las(kind=128 + 1, size=size, count=count))
    struct.pack_into("<q", out, 227, at if at >= 0 else -1)
    if at < 0:
        struct.pack_into("<q", out, size - 8, -at)
    if 0 <= abs(at) <= size - 8:
        struct.pack_into("<II", out, abs(at), 0, chunks)
    return bytes(out)


def said(content, folder, check=survey.check_las):
    """What a file is refused with, nothing if it is sound."""
    (folder / "a.file").write_bytes(content)
    try:
        check(folder / "a.file")
    except OSError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    "content",
    [
        *(las(version, kind=kind) for kind in WIDTHS for version in (2, 4)),
        *(las(records=2), las(header=230), las(width=21), las(start=300), laz(-500), laz(235), laz(592)),
        *(laz(500, chunks=500 - 227), laz(235, count=200 * 600)),
    ],
)
def test_what_is_at_the_edge_is_sound(content, tmp_path):
    assert said(content, tmp_path) == ""


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (las()[:226], "a.file is a LAS file with 226 bytes, less than its header has: truncated"),
        (las(4, count=0)[:374], "a.file is a LAS file with 374 bytes, less than its header has: truncated"),
        (las(major=2), "a.file must be LAS 1 with points of format 0 to 10, not 2 with 0"),
        (las(kind=11), "a.file must be LAS 1 with points of format 0 to 10, not 1 with 11"),
        (las(header=226), "a.file is a LAS file with a damaged header"),
        (las(header=230, start=229), "a.file is a LAS file with a damaged header"),
        (las(records=2, start=227 + 107), "a.file is a LAS file with a damaged header"),
        *((las(kind=kind, width=width - 1), "damaged header") for kind, width in WIDTHS.items()),
        (las(count=0), "a.file must have points, its header says 0"),
        (las()[:-1], "a.file must have 287 bytes or more by its header, it has 286: truncated"),
        (las(4)[:-1], "a.file must have 435 bytes or more by its header, it has 434: truncated"),
        (laz(235, count=200 * 600 + 1), "a.file must have 600 bytes or more"),
        (laz(0)[:234], "a.file must have 235 bytes or more"),
        (laz(234), "a.file is a LAZ file without its table of chunks: truncated or damaged"),
        (laz(593), "a.file is a LAZ file without its table of chunks: truncated or damaged"),
        (laz(-593), "a.file is a LAZ file without its table of chunks: truncated or damaged"),
        (laz(500, chunks=500 - 227 + 1), "a.file is a LAZ file with 274 chunks in 273 bytes: damaged"),
    ],
)
def test_one_beyond(content, message, tmp_path):
    assert message in said(content, tmp_path)


def e57(text, at=48, length=None, page=1024, count=None, pages=2):
    """A file of pages with four bytes of checks each, and a description at a place of the pages without these."""
    logical = bytearray(pages * 1020)
    start = at // 1024 * 1020 + at % 1024
    logical[start : start + len(text)] = text
    out = b"".join(bytes(logical[k : k + 1020]) + b"<!\0\0" for k in range(0, len(logical), 1020))
    head = struct.pack("<QQQQ", len(out) if length is None else length, at, len(text) if count is None else count, page)
    return out[:16] + head + out[48:]


TEXT = b"<e57Root><!-- a --><![CDATA[ b ]]>" + b"x" * 900 + b"</e57Root>"


@pytest.mark.parametrize("content", [*(e57(TEXT, at) for at in (48, 500, 1024, 1060)), e57(b"x" * (2040 - 48))])
def test_descriptions_across_pages_and_to_the_end_are_sound(content, tmp_path):
    assert said(content, tmp_path, survey.check_e57) == ""


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (e57(TEXT)[:47], "a.file is an E57 file with 47 bytes, less than its header has: truncated"),
        (e57(TEXT, length=2049), "a.file must have 2,049 bytes by its header, it has 2,048: truncated"),
        (e57(TEXT, length=2047), "a.file must have 2,047 bytes by its header, it has 2,048: damaged"),
        (e57(TEXT, page=1023), "a.file is an E57 file with a damaged header"),
        (e57(TEXT, count=2049), "a.file is an E57 file with a damaged header"),
        (e57(b"x", at=48).replace(struct.pack("<Q", 48), struct.pack("<Q", 2049), 1), "with a damaged header"),
        (e57(TEXT, count=2040 - 47), "whose description is damaged or defines entities"),
        (e57(TEXT.replace(b"x", b"\0", 1)), "whose description is damaged or defines entities"),
        (e57(TEXT.replace(b"xx", b"<!", 1)), "whose description is damaged or defines entities"),
        (e57(TEXT, count=len(TEXT) + 1), "whose description is damaged or defines entities"),
    ],
)
def test_damaged_descriptions(content, message, tmp_path):
    assert message in said(content, tmp_path, survey.check_e57)
