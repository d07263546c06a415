"""Whether a PLY file can hold as many elements as its header says."""

from __future__ import annotations

import re
from pathlib import Path

_SIZES = {
    b"char": 1, b"uchar": 1, b"short": 2, b"ushort": 2, b"int": 4, b"uint": 4, b"float": 4, b"double": 8, b"int8": 1,
    b"uint8": 1, b"int16": 2, b"uint16": 2, b"int32": 4, b"uint32": 4, b"float32": 4, b"float64": 8,
}  # fmt: skip
_HEAD = 1 << 16


def check_counts(path: Path) -> None:
    """Refuse counts of elements that need more bytes than there are, before arrays of that size are made."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head, end, _ = file.read(_HEAD).partition(b"end_header")
    text = re.search(rb"\bformat\s+ascii", head) is not None
    wanted = len(head) + len(end)
    for part in re.split(rb"(?m)^element\s", head)[1:]:
        words = part.split()
        if len(words) < 2 or not re.fullmatch(rb"\d{1,30}", words[1]):
            raise OSError(f"{path.name} has a damaged header: an element must have a name and a count")
        kinds = [line.split()[1:3] for line in part.splitlines() if line.startswith(b"property")]
        sizes = [_SIZES.get(kind[-1] if kind[:1] == [b"list"] else kind[0], 1) for kind in kinds if kind]
        wanted += int(words[1]) * (max(2 * len(sizes) if text else sum(sizes), 1))
    if wanted > size + 1:
        raise OSError(f"{path.name} must have {wanted:,} bytes or more by its header, it has {size:,}: truncated")
