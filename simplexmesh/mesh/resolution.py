"""Resolution of the primitive shapes: numbers of cells, as given or from an approximate number of vertices."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from simplexmesh._base import checks

DEFAULT_VERTICES = 1280
MAX_VERTICES = 100_000_000


def frequency(given: int | None, vertices: int | None, n_triangles: int) -> int:
    """Return the given frequency, or the one for which `n_triangles * frequency**2` is nearest to `vertices`."""
    if given is not None and vertices is not None:
        raise TypeError("give frequency or vertices, not both")
    if given is not None:
        return checks.integer("frequency", given, 1, math.isqrt(MAX_VERTICES // n_triangles))
    return _nearest_frequency(_n_wanted(vertices), n_triangles)


def base_for(vertices: int | None, n_triangles: Mapping[str, int]) -> str:
    """Return the first base if its nearest number of vertices is within 10 %, else the base with the nearest one."""
    wanted = _n_wanted(vertices)
    error = {base: abs(n * _nearest_frequency(wanted, n) ** 2 - wanted) for base, n in n_triangles.items()}
    first = next(iter(error))
    return first if error[first] <= 0.1 * wanted else min(error, key=lambda base: error[base])


def _nearest_frequency(wanted: int, n_triangles: int) -> int:
    below = max(1, math.isqrt(wanted // n_triangles))
    return min((below, below + 1), key=lambda f: abs(n_triangles * f**2 - wanted))


def _n_wanted(vertices: int | None) -> int:
    return DEFAULT_VERTICES if vertices is None else checks.integer("vertices", vertices, 4, MAX_VERTICES)


@dataclass(frozen=True)
class Grid:
    """A shape with cells in two directions."""

    first: str  # the names of the two parameters
    second: str
    count: Callable[[int, int], int]  # vertices for numbers of cells; linear in each, the second of equal parity
    minimum: tuple[int, int]
    step: int = 1  # 2 when the second must be even


def cells(grid: Grid, first: int | None, second: int | None, vertices: int | None, aspect: float) -> tuple[int, int]:
    """Return the numbers of cells, given or best for a number of vertices; `aspect` is the ratio of the two lengths."""
    if (first is None) != (second is None):
        raise TypeError(f"give both {grid.first} and {grid.second}, or neither")
    if first is not None and second is not None:
        if vertices is not None:
            raise TypeError(f"give {grid.first} and {grid.second}, or vertices, not both")
        one = checks.integer(grid.first, first, grid.minimum[0])
        two = checks.integer(grid.second, second, grid.minimum[1])
        if (count := grid.count(one, two)) > MAX_VERTICES:
            names = f"{grid.first} and {grid.second}"
            raise ValueError(f"{names} must give at most {MAX_VERTICES:,} vertices, not {count:,}")
        return one, two
    wanted, ratio = _n_wanted(vertices), aspect * math.sqrt(3) / 2

    def cost(pair: tuple[int, int]) -> float:
        # a count off by 3 % costs as much as edges off by a factor of e: the exact count often leaves only slivers
        count_error = grid.count(*pair) / wanted - 1
        return (count_error / 0.03) ** 2 + abs(math.log(pair[0] / pair[1] / ratio))

    return min(_candidates(grid, wanted, ratio), key=cost)


def _candidates(grid: Grid, wanted: int, ratio: float) -> Iterator[tuple[int, int]]:
    """Yield pairs of numbers of cells near the wanted number of vertices and ratio."""
    low, least = grid.minimum[0], max(2, grid.minimum[1])
    per_first = grid.count(low + 1, least) - grid.count(low, least)
    most = low + max(0, wanted - grid.count(low, least)) // per_first
    center = min(max(round(math.sqrt(wanted / 2 * ratio)), low), most)
    for n in range(max(low, center - 16), center + 17):
        base = grid.count(n, least)
        per_step = (grid.count(n, least + 2) - base) / 2 * grid.step
        steps = max(0, math.floor((wanted - base) / per_step))
        for extra in (-1, 0, 1):
            yield n, least + grid.step * max(0, steps + extra)
