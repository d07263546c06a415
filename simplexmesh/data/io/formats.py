"""File format detection, by the first bytes and then by the name."""

from __future__ import annotations

import gzip
import re
import zlib
from pathlib import Path

_FORMATS = {
    "metaimage": ("a MetaImage", ".mhd .mha"),
    "nrrd": ("an NRRD", ".nrrd .nhdr"),
    "nifti": ("a NIfTI", ".nii .nii.gz"),
    "dicom": ("a DICOM", ".dcm"),
    "tiff": ("a TIFF", ".tif .tiff"),
    "vti": ("a VTI", ".vti"),
    "vtp": ("a VTP", ".vtp"),
    "vtk": ("a VTK", ".vtk"),
    "ply": ("a PLY", ".ply"),
    "stl": ("an STL", ".stl"),
    "obj": ("an OBJ", ".obj"),
    "off": ("an OFF", ".off"),
    "gifti": ("a GIFTI", ".gii .gii.gz"),
    "glb": ("a GLB", ".glb"),
    "3mf": ("a 3MF", ".3mf"),
    "pcd": ("a PCD", ".pcd"),
    "las": ("an LAS", ".las .laz"),
    "e57": ("an E57", ".e57"),
    "text": ("an XYZ", ".xyz .xyzn .xyzc .csv .txt .pts .asc"),
}
"""How messages call each format, and how the names of its files end."""

SUFFIXES = {ending: kind for kind, (_, endings) in _FORMATS.items() for ending in endings.split()}
HEAD = 4096
MARK = "\xef\xbb\xbf"  # the byte order mark of UTF-8, which spreadsheets write, as Latin-1
_MAGIC = {
    "nrrd": (b"NRRD000",),
    "ply": (b"ply\n", b"ply\r"),
    "vtk": (b"# vtk DataFile",),
    "tiff": (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
    "pcd": (b"# .PCD", b"VERSION"),
    "las": (b"LASF",),
    "e57": (b"ASTM-E57",),
    "glb": (b"glTF",),
}
_DATABASE = b"SQLite format 3\0"


def suffix(path: Path) -> str:
    """Return the file name extension in lower case, `.nii.gz` and `.gii.gz` as one."""
    name = path.name.lower()
    return name[-7:] if name.endswith((".nii.gz", ".gii.gz")) else path.suffix.lower()


def format_of(path: Path) -> str:
    """Return the format of a file: "ply", "metaimage" and the like."""
    if not path.is_file():
        raise OSError(f"{path.name} must be a regular file, not a pipe or a device")
    size = path.stat().st_size
    if not size:
        raise OSError(f"{path.name} is empty")
    with path.open("rb") as file:
        head = file.read(HEAD)
    if (found := _by_content(head, size)) is not None:
        return found
    named = SUFFIXES.get(suffix(path))
    if (named == "text" and _is_text(head)) or (named == "3mf" and head.startswith(b"PK")):
        return named
    if named == "stl" and is_binary_stl(head, size):
        return "stl"
    if named == "stl" and not _is_text(head) and len(head) >= 84:
        raise OSError(
            f"{path.name} must have {stl_size(head):,} bytes as STL, it has {size:,}: truncated, or not an STL file"
        )
    if named is not None:
        raise OSError(f"{path.name} is not {called(named)} file, or its beginning is damaged")
    if head.startswith(_DATABASE):
        raise OSError(f"{path.name} is an SQLite database: open libraries of models with sm.ModelLibrary")
    known = ", ".join(sorted(SUFFIXES))
    raise OSError(f"{path.name} has an unknown format; known ones are {known}")


def called(kind: str) -> str:
    """Return the name of a format with its indefinite article."""
    return _FORMATS[kind][0]


def _by_content(head: bytes, size: int) -> str | None:
    if head[128:132] == b"DICM":  # before it there may be a TIFF header
        return "dicom"
    for kind, beginnings in _MAGIC.items():
        if head.startswith(beginnings):
            return kind
    if head[:2] == b"\x1f\x8b":
        inner = _unzipped(head)
        return "nifti" if _is_nifti(inner) else "gifti" if b"<GIFTI" in inner else None
    if _is_nifti(head):
        return "nifti"
    if _is_stl(head, size):
        return "stl"
    return _by_text(head)


def _by_text(head: bytes) -> str | None:
    text = head.decode("latin-1").removeprefix(MARK)
    if "<VTKFile" in text:
        kind = re.search(r'<VTKFile[^>]*\btype="(\w+)"', text)
        return {"ImageData": "vti", "PolyData": "vtp"}.get(kind[1]) if kind else None
    if "<GIFTI" in text:
        return "gifti"
    if re.search(r"^\s*(NDims|ObjectType)\s*=", text, re.MULTILINE):
        return "metaimage"
    if re.match(r"(\s*#[^\n]*\n|\s)*(ST)?C?N?4?n?OFF\b", text):
        return "off"
    if re.match(r"\s*solid\b", text, re.IGNORECASE) and re.search(r"\bfacet\b", text, re.IGNORECASE):
        return "stl"
    number = r"[-+]?(\d+\.?\d*|\.\d+|nan|inf)([eE][-+]?\d+)?"
    if re.search(rf"^(v|vn|vt)\s+(?!\+){number}\s", text, re.MULTILINE):
        return "obj"
    if re.match(r"\s*Points\s*:=\s*\[", text):
        return "text"
    three = rf"^\s*{number}([\s,;]+{number}){{2,}}"
    return "text" if any(re.match(three, row) for row in text.splitlines()[:20]) else None


def _is_text(head: bytes) -> bool:
    return b"\0" not in head


def _is_nifti(head: bytes) -> bool:
    return head[344:348] in (b"n+1\0", b"ni1\0") or head[4:8] in (b"n+2\0", b"ni2\0")


def _is_stl(head: bytes, size: int) -> bool:
    """Whether the file size is that of a binary STL: an 80-byte header, a count, and 50 bytes per triangle."""
    return len(head) >= 84 and size == stl_size(head)


def is_binary_stl(head: bytes, size: int) -> bool:
    """Whether a file known to be STL is binary and complete; some programs write more after the triangles."""
    return _is_stl(head, size) or (not _is_text(head) and 84 < stl_size(head) <= size)


def stl_size(head: bytes) -> int:
    """Return the size of a binary STL file by the number of triangles in its header."""
    return 84 + 50 * int.from_bytes(head[80:84], "little")


def _unzipped(head: bytes) -> bytes:
    try:
        return zlib.decompressobj(wbits=31).decompress(head, 512)
    except (zlib.error, gzip.BadGzipFile):
        return b""
