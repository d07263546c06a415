"""How finely to divide a shape, from what the caller asked for: numbers of cells, or about how many vertices."""

from __future__ import annotations

import math

from simplexmesh import _check

DEFAULT_VERTICES = 1280
MOST_VERTICES = 100_000_000


def frequency(given: int | None, vertices: int | None, per_square: int) -> int:
    """Return the frequency asked for, or the one whose sphere has about as many vertices as asked for."""
    if given is not None and vertices is not None:
        raise TypeError("give frequency or vertices, not both")
    if given is not None:
        return _check.integer("frequency", given, 1, math.isqrt(MOST_VERTICES // per_square))
    count = DEFAULT_VERTICES if vertices is None else _check.integer("vertices", vertices, 4, MOST_VERTICES)
    return max(1, round(math.sqrt(count / per_square)))


def cells(
    name: str,
    count: int | None,
    other: str,
    other_count: int | None,
    vertices: int | None,
    aspect: float,
    *,
    even: bool = False,
) -> tuple[int, int]:
    """Return the two numbers of cells given, or those of nearly square shape for about so many vertices.

    `aspect` is the length of the first direction over that of the second; two triangles share a cell, whose height is
    that of an equilateral triangle.
    """
    if (count is None) != (other_count is None):
        raise TypeError(f"give both {name} and {other}, or neither")
    if count is not None and other_count is not None:
        if vertices is not None:
            raise TypeError(f"give {name} and {other}, or vertices, not both")
        return count, other_count
    total = DEFAULT_VERTICES if vertices is None else _check.integer("vertices", vertices, 4, MOST_VERTICES)
    first = max(3, round(math.sqrt(total / 2 * aspect * math.sqrt(3) / 2)))
    second = total / 2 / first
    return first, max(4, 2 * round(second / 2)) if even else max(2, round(second) - 1)
