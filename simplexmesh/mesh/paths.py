"""Paths along the edges of a mesh, closed or open: what makes one, and finding them again after edits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Indices, Indices32

Named = Mapping[str, NDArray[np.integer[Any]]]
"""Contours by name, each as its darts in order."""


def first_repeated(values: NDArray[np.integer[Any]]) -> int:
    """Return the smallest value that occurs more than once in an array, -1 when all differ."""
    ordered = np.sort(values)
    repeated = ordered[1:][ordered[1:] == ordered[:-1]]
    return int(repeated[0]) if len(repeated) else -1


def refusal_of_path(vertices: Indices, neighbors: NDArray[np.integer[Any]], *, closed: bool = True) -> str:
    """Return what is wrong with a contour of vertices (k,) with these neighbors (k, 3), "" if it is one."""
    if len(vertices) < (fewest := 3 if closed else 2):
        return f"must have at least {fewest} vertices, not {len(vertices)}"
    if (repeated := first_repeated(vertices)) >= 0:
        return f"must not touch itself, but visits vertex {repeated} twice"
    steps = slice(None if closed else -1)
    ahead = np.roll(vertices, -1)[steps]
    if (apart := (neighbors[steps] != ahead[:, None]).all(axis=1)).any():
        i = int(apart.argmax())
        where = "is not closed:" if i == len(vertices) - 1 else "must run along edges;"
        return f"{where} vertices {vertices[i]} and {ahead[i]} are not neighbors"
    if (full := np.isin(neighbors, vertices).all(axis=1)).any():
        return f"vertex {vertices[full.argmax()]} has all three neighbors on the contour"
    return ""


def path_vertices(darts: NDArray[np.integer[Any]], twin: Indices32) -> tuple[Indices, bool]:
    """Return the vertices of a path given by its darts (k,), and whether it is closed: k vertices, or k + 1 if open."""
    tails, end = darts.astype(np.int64) // 3, int(twin.reshape(-1)[darts[-1]]) // 3
    closed = bool(end == tails[0])
    return (tails if closed else np.append(tails, end)), closed


def refusal_of_darts(darts: NDArray[np.integer[Any]], twin: Indices32) -> str:
    """Return why the contour along some darts (k,) is none, "" if it is one."""
    if not len(darts):
        return "must have at least one edge"
    vertices, closed = path_vertices(darts, twin)
    if (jump := twin.reshape(-1)[darts[:-1]] // 3 != darts[1:] // 3).any():
        return f"must run along edges; dart {darts[:-1][jump][0]} does not lead to the next one"
    return refusal_of_path(vertices, twin[vertices] // 3, closed=closed)


def same_edges(one: NDArray[np.integer[Any]], other: NDArray[np.integer[Any]], twin: Indices32) -> bool:
    """Return whether two contours, given by their darts (k,), have the same edges."""
    edges = [np.sort(np.minimum(darts, twin.reshape(-1)[darts])) for darts in (one, other)]
    return np.array_equal(edges[0], edges[1])


def marked_darts(contours: Named, twin: Indices32) -> Indices32:
    """Return (3n,) for each dart the number of the contour along it, from 1 on, negative against it; else 0.

    Without contours, an array of no length.
    """
    marks = np.zeros(twin.size if contours else 0, np.int32)
    for number, darts in enumerate(contours.values(), 1):
        marks[darts], marks[twin.reshape(-1)[darts]] = number, -number
    return marks


def followed(marks: Indices32, twin: Indices32, number: int, first: NDArray[np.integer[Any]]) -> Indices | None:
    """Return the darts of the contour with a number in marks (3n,), or None if these are no longer one path.

    A closed one starts at the first vertex of `first` that is on it.
    """
    darts = np.flatnonzero(marks == number)
    ends = twin.reshape(-1)[darts]
    tails, heads = darts // 3, ends // 3
    if not len(darts) or (marks[ends] != -number).any() or first_repeated(tails) >= 0 or first_repeated(heads) >= 0:
        return None
    onward = dict(zip(tails.tolist(), zip(darts.tolist(), heads.tolist(), strict=True), strict=True))
    starts = np.setdiff1d(tails, heads)
    if not len(starts):
        starts = np.append(first[np.isin(first, tails)], tails[0])
    out, at = [], int(starts[0])
    while at in onward:
        dart, at = onward.pop(at)
        out.append(dart)
    return None if onward else np.array(out)
