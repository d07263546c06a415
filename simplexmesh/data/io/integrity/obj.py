"""What the faces of OBJ files refer to, which VTK follows without a look at how much there is."""

from __future__ import annotations

import re
from pathlib import Path

_CELLS = re.compile(rb"(?m)^[ \t]*[flp]([ \t][^\n]*)")
_PLACES = {b"v": rb"\s(-?\d+)", b"vt": rb"\s-?\d+/(-?\d+)", b"vn": rb"\s-?\d+/(?:-?\d+)?/(-?\d+)"}


def is_plain(path: Path) -> bool:
    """Return true if faces refer to positions, textures and normals that the file holds, else raise an OSError."""
    content = path.read_bytes()
    cells = b"\n".join(_CELLS.findall(content))
    for name, place in _PLACES.items():
        if name != b"v" and b"/" not in cells:
            break
        numbers = [int(number) for number in set(re.findall(place, cells))]
        count = len(re.findall(rb"(?m)^[ \t]*" + name + rb"[ \t]", content))
        wrong = next((number for number in numbers if not 0 < abs(number) <= count), None)
        if wrong is not None:
            raise OSError(f"{path.name} is damaged: a face refers to {name.decode()} {wrong:.6g}, of {count:,}")
    return True
