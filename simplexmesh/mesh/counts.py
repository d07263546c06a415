"""How finely to divide a shape, from what the caller asked for: numbers of cells, or about how many vertices."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from simplexmesh import _check

DEFAULT_VERTICES = 1280
MOST_VERTICES = 100_000_000
_WINDOW = 16
_MISSED = 0.03


def frequency(given: int | None, vertices: int | None, per_square: int) -> int:
    """Return the frequency asked for, or the one whose sphere has most nearly as many vertices as asked for."""
    if given is not None and vertices is not None:
        raise TypeError("give frequency or vertices, not both")
    if given is not None:
        return _check.integer("frequency", given, 1, math.isqrt(MOST_VERTICES // per_square))
    return _nearest(_total(vertices), per_square)


def base_for(vertices: int | None, per_square: Mapping[str, int]) -> str:
    """Return the first base that comes within 10 % of so many vertices, or else the one that comes nearest.

    Examples
    --------
    >>> base_for(130, {"icosahedron": 20, "octahedron": 8, "tetrahedron": 4})
    'octahedron'
    """
    total = _total(vertices)
    off = {base: abs(m * _nearest(total, m) ** 2 - total) for base, m in per_square.items()}
    first = next(iter(off))
    return first if off[first] <= 0.1 * total else min(off, key=lambda base: off[base])


def _nearest(total: int, per_square: int) -> int:
    below = max(1, math.isqrt(total // per_square))
    return min((below, below + 1), key=lambda f: abs(per_square * f**2 - total))


def _total(vertices: int | None) -> int:
    return DEFAULT_VERTICES if vertices is None else _check.integer("vertices", vertices, 4, MOST_VERTICES)


@dataclass(frozen=True)
class Grid:
    """A shape divided in two directions.

    Attributes
    ----------
    name, other : str
        What the numbers of cells are called.
    count : callable
        Takes the two numbers to the number of vertices; linear in each (in the second, of equal parity).
    least : (2,) tuple of int
        The smallest numbers.
    step : int
        2 when the second must be even.
    """

    name: str
    other: str
    count: Callable[[int, int], int]
    least: tuple[int, int]
    step: int = 1


def cells(grid: Grid, first: int | None, second: int | None, vertices: int | None, aspect: float) -> tuple[int, int]:
    """Return the two numbers of cells given, or those that come nearest to so many vertices and to equal sides.

    Numbers off by 3 % weigh as much as sides off by a factor of e: exact numbers often leave only slivers.

    Parameters
    ----------
    grid : Grid
        The shape.
    first, second : int, optional
        What the caller gave.
    vertices : int, optional
        About how many.
    aspect : float
        Length of the first direction over that of the second; two triangles share a cell, whose height is that of an
        equilateral triangle.

    Examples
    --------
    >>> ring = Grid("around", "along", lambda n, m: 2 * n * (m + 1), (3, 1))
    >>> cells(ring, None, None, 100, 3.0)
    (10, 4)
    """
    if (first is None) != (second is None):
        raise TypeError(f"give both {grid.name} and {grid.other}, or neither")
    if first is not None and second is not None:
        if vertices is not None:
            raise TypeError(f"give {grid.name} and {grid.other}, or vertices, not both")
        return _check.integer(grid.name, first, grid.least[0]), _check.integer(grid.other, second, grid.least[1])
    total, wanted = _total(vertices), aspect * math.sqrt(3) / 2

    def cost(pair: tuple[int, int]) -> float:
        missed = grid.count(*pair) / total - 1
        return (missed / _MISSED) ** 2 + abs(math.log(pair[0] / pair[1] / wanted))

    return min(_pairs(grid, total, wanted), key=cost)


def _pairs(grid: Grid, total: int, wanted: float) -> Iterator[tuple[int, int]]:
    """Run through pairs with about so many vertices whose ratio is about as wanted."""
    low, least = grid.least[0], max(2, grid.least[1])
    per_first = grid.count(low + 1, least) - grid.count(low, least)
    most = low + max(0, total - grid.count(low, least)) // per_first
    middle = min(max(round(math.sqrt(total / 2 * wanted)), low), most)
    for n in range(max(low, middle - _WINDOW), middle + _WINDOW + 1):
        base = grid.count(n, least)
        per_step = (grid.count(n, least + 2) - base) / 2 * grid.step
        steps = max(0, math.floor((total - base) / per_step))
        for extra in (-1, 0, 1):
            yield n, least + grid.step * max(0, steps + extra)
