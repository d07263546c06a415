"""Headers of MetaImage and NRRD files as ITK understands them, and where the samples may lie that they name."""

from __future__ import annotations

import glob
import mmap
import re
from pathlib import Path

_LONGEST = 1 << 22  # of a header, in bytes
_LONGEST_LINE = 500  # longer ones overflow what ITK composes its complaints in
_SAMPLES_OF_META = b"ElementDataFile"


def check_beside(path: Path, name: str) -> None:
    """Refuse samples that are not in the folder of their header or below: any file could be read as samples."""
    folders, name = {path.parent.resolve(), path.resolve().parent}, name.strip()  # a linked header has linked samples
    if len(name) > _LONGEST_LINE or not re.fullmatch(r"[^%\0]*(%\d{0,2}[di][^%\0]*)?", name):
        raise OSError(f"{path.name} refers to {name[:60]}, which is no name of a file")
    windows = re.match(r"[a-zA-Z]:\\|\\", name) is not None or ".." in name.split("\\")
    numbered = glob.escape(re.sub(r"%\d*[di]", "%", name)).replace("%", "*")
    files = [path.parent / name, *map(Path, glob.glob(str(Path(glob.escape(str(path.parent)), numbered))))]
    try:
        real = [each.resolve() for each in files]
        inside = not windows and all(any(each.is_relative_to(folder) for folder in folders) for each in real)
    except (OSError, RuntimeError):  # links in a circle
        inside = False
    if not inside:
        raise OSError(f"{path.name} refers to {name}, which is not in its folder or below")


def metaimage_header(path: Path) -> tuple[dict[str, str], list[str], int]:
    """Return the fields of a MetaImage, the lines after them (of a list of files), and where its samples start."""
    with path.open("rb") as file:
        if not path.stat().st_size:
            return {}, [], 0
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            at = content.find(_SAMPLES_OF_META)
            if at < 0:
                return {}, [], 0
            end = content.find(b"\n", at) + 1 or len(content)
            if end > _LONGEST:
                raise OSError(f"{path.name} has a header of more than {_LONGEST:,} bytes")
            twice = content.find(_SAMPLES_OF_META, at + 1) >= 0  # of two, ITK may open either
            text, rest = content[:end].decode("latin-1"), content[end : end + _LONGEST].decode("latin-1")
    pairs = re.findall(r"^[^\S\n]*(\w+)\s*[=:][=:\s]*(.*?)\s*$", text, re.MULTILINE)
    fields = dict(pairs)
    if twice or len(fields) < len(pairs) or _SAMPLES_OF_META.decode() not in fields or "\0" in text:
        raise OSError(f"{path.name} is a MetaImage with a damaged header: a field is given twice or out of place")
    if fields[_SAMPLES_OF_META.decode()].upper().startswith("LIST") and len(rest) == _LONGEST:
        raise OSError(f"{path.name} has a header of more than {_LONGEST:,} bytes")
    return fields, rest.splitlines(), end


def nrrd_header(path: Path) -> tuple[dict[str, str], list[str], int]:
    """Return the fields of an NRRD file, the names of a list of files, and where samples after the header start."""
    fields: dict[str, str] = {}
    names: list[str] = []
    with path.open("rb") as file:
        while line := file.readline(_LONGEST + 1):
            if file.tell() > _LONGEST:
                raise OSError(f"{path.name} has a header of more than {_LONGEST:,} bytes")
            text = line.decode("latin-1").removesuffix("\n").removesuffix("\r")
            listed = fields.get("datafile", "").startswith("LIST")
            if not text and not listed:
                return fields, [], file.tell()
            if listed:
                names.append(text)
            elif not text.startswith("#"):
                _add_field(path.name, text, fields)
            if "\r" in text or "\0" in text:
                raise OSError(f"{path.name} has a damaged header: a line ends early")
    return fields, names, 0


def _add_field(name: str, line: str, fields: dict[str, str]) -> None:
    """Add a field of an NRRD header under its name in small letters without spaces; pairs with `:=` mean nothing."""
    key, separator, value = line.partition(":")
    if value.startswith("="):
        return
    if len(line) > _LONGEST_LINE:
        raise OSError(f"{name} has a damaged header: a line of {len(line):,} characters, {line[:30]!r}")
    key = re.sub(r"[\s_]", "", key.lower())
    if separator and key in fields:
        raise OSError(f"{name} has a damaged header: {key[:60]} is given twice")
    if separator:
        fields[key] = value.strip()
