"""Two signatures on a torus, a tube or a disc compared under all shifts, which Fourier transforms do at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh._vec import normalized
from simplexmesh.recognition.flat_domains import FlatDomain, domain
from simplexmesh.recognition.matches import Match
from simplexmesh.recognition.occlusion import smoothed
from simplexmesh.recognition.sai import SAI

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

AROUND, ACROSS = 10, 4
"""Columns and rows of the grid compared, times the frequency: twice the mesh."""

APART = 15.0
"""Hypotheses whose shifts differ by less, in degrees, are one."""

CANDIDATES = 4
"""So many times more shifts are measured between the grid's places than are asked for."""

STEPS = (0.5, 0.15, 0.05, 0.02)
"""Of the grid, in which each hypothesis is followed to its minimum."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Places of a patch in rows and columns, the columns along the direction that is closed.

    Attributes
    ----------
    coordinates : (rows, columns, 2) array of float
        As in `FlatDomain`; for the disc the columns are angles and the rows radii.
    corners : (rows, columns, 3) array of int
    weights : (rows, columns, 3) array of float
        What interpolates there.
    areas : (rows, 1) array of float
        The part of the patch each place stands for.
    """

    coordinates: Array
    corners: Indices
    weights: Array
    areas: Array


@lru_cache(maxsize=16)
def grid(topology: str, frequency: int) -> Grid:
    """Return the grid on which signatures are compared."""
    columns, rows = AROUND * frequency, ACROSS * frequency
    turns = np.arange(columns) / columns
    steps = np.arange(rows) / rows if topology == "torus" else (np.arange(rows) + 0.5) / rows
    x, y = np.meshgrid(turns, steps)
    at = np.stack([x, y], axis=-1)
    if topology == "plane":
        at = y[..., None] * np.stack([np.cos(2 * np.pi * x), np.sin(2 * np.pi * x)], axis=-1)
    patch = domain(topology, frequency)
    assert isinstance(patch, FlatDomain)
    corners, weights = patch.locate(at.reshape(-1, 2))
    areas = steps[:, None] if topology == "plane" else np.ones((rows, 1))
    return Grid(at, corners.reshape(rows, columns, 3), weights.reshape(rows, columns, 3), areas / areas.sum() / columns)


def slid(sai_a: SAI, sai_b: SAI, best: int, minimum_overlap: float, smoothing: int, limit: float) -> list[Match]:
    """Return the best hypotheses of how two signatures of one patch lie on each other; see `match`."""
    a, b = (compared_values(one, smoothing, limit) for one in (sai_a, sai_b))
    if not (a[1].any() and b[1].any()):
        return []
    found = [
        (*_measured(sai_a, a, b, shift, flipped=flipped), shift, flipped)
        for flipped in ((False, True) if sai_a.topology != "plane" else (False,))
        for shift in _candidates(sai_a, a, b, CANDIDATES * best, minimum_overlap, flipped=flipped)
    ]
    found = [one for one in found if one[1] >= minimum_overlap]
    found.sort(key=lambda one: one[0])
    kept: list[tuple[float, float, Array, bool]] = []
    for one in found:
        if len(kept) < best and all(one[3] != k[3] or _apart(one[2], k[2]) >= APART for k in kept):
            kept.append(one)
    followed = [(*_followed(sai_a, a, b, one[2], flipped=one[3]), one[3]) for one in kept]
    followed.sort(key=lambda one: one[0])
    return [_told(sai_a, sai_b, *one[:3], flipped=one[3]) for one in followed]


def compared_values(one: SAI, smoothing: int, limit: float) -> tuple[Array, Mask]:
    """Return the angles that are compared, and where they count."""
    seen = ~(one.hidden | one.hidden[one.mesh.neighbors].any(axis=1))
    return np.clip(smoothed(one.angles, seen, one.mesh.neighbors, smoothing), -limit, limit), seen


def _candidates(sai_a: SAI, a: tuple[Array, Mask], b: tuple[Array, Mask], most: int, least: float, *,
                flipped: bool) -> list[Array]:  # fmt: skip
    """Return shifts (2,), in turns, at minima of the mean squared difference, the least first."""
    total, common = compared(sai_a.topology, sai_a.frequency, a, b, flipped=flipped)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(common >= least * common.max(), np.maximum(total, 0.0) / common, np.inf)
    lowest = np.isfinite(mean)
    for axis in (0, 1):
        for step in (-1, 1):
            lowest &= mean <= np.roll(mean, step, axis=axis)
    rows, columns = np.nonzero(lowest)
    order = np.argsort(mean[rows, columns], kind="stable")[:most]
    return [np.array([_vertex(mean, r, c, 1), _vertex(mean, r, c, 0)]) for r, c in
            zip(rows[order].tolist(), columns[order].tolist(), strict=True)]  # fmt: skip


def compared(topology: str, frequency: int, a: tuple[Array, Mask], b: tuple[Array, Mask], *,
             flipped: bool) -> tuple[Array, Array]:  # fmt: skip
    """Return, for every shift of the grid, the sum of squared differences over what both show, and its area.

    Parameters
    ----------
    topology : {"torus", "cylinder", "plane"}
    frequency : int
    a, b : pairs of (n,) arrays of float and bool
        Values, and where they count.
    flipped : bool
        Whether b is turned by half a turn first.

    Returns
    -------
    total, common : (rows, columns) arrays of float
        By shifts along the tube and around; one row where only turns around are possible.
    """
    places = grid(topology, frequency)
    (one, there), (other, here) = (_on_grid(places, *each) for each in (a, b))
    if flipped:
        other, here = (_flipped(each, topology) for each in (other, here))
    here = here * places.areas
    turns = topology == "torus"

    def sums(first: Array, second: Array) -> Array:
        if turns:
            return np.fft.irfft2(np.fft.rfft2(first) * np.conj(np.fft.rfft2(second)), s=first.shape)
        product = np.fft.rfft(first, axis=1) * np.conj(np.fft.rfft(second, axis=1))
        return np.fft.irfft(product.sum(axis=0), n=first.shape[1])[None]

    total = sums(there * one**2, here) - 2 * sums(there * one, here * other) + sums(there, here * other**2)
    return total, sums(there, here)


def _on_grid(places: Grid, values: Array, seen: Mask) -> tuple[Array, Array]:
    there = seen[places.corners].all(axis=2)
    return np.where(there, (values[places.corners] * places.weights).sum(axis=2), 0.0), there.astype(float)


def _flipped(values: Array, topology: str) -> Array:
    """Return values (rows, columns) with both directions reversed."""
    values = np.roll(values[:, ::-1], 1, axis=1)
    return np.roll(values[::-1], 1, axis=0) if topology == "torus" else values[::-1]


def _vertex(mean: Array, row: int, column: int, axis: int) -> float:
    """Return, in turns, where the parabola through a minimum and its neighbors along an axis is least."""
    size, at = mean.shape[axis], (row, column)[axis]
    line = mean[row] if axis else mean[:, column]
    before, here, after = (float(line[(at + step) % size]) for step in (-1, 0, 1))
    bend = before - 2 * here + after
    off = 0.5 * (before - after) / bend if np.isfinite(bend) and bend > 0 else 0.0
    return float(((at + np.clip(off, -0.5, 0.5)) / size) % 1.0)


def moved(topology: str, coordinates: Array, shift: Array, *, flipped: bool) -> Array:
    """Return where places of a patch (k, 2) come under a half turn, if wanted, and a shift (2,) in turns.

    Examples
    --------
    >>> moved("cylinder", np.array([[0.25, 0.2]]), np.array([0.5, 0.0]), flipped=True)
    array([[0.25, 0.8 ]])
    """
    if topology == "plane":
        c, s = np.cos(2 * np.pi * shift[0]), np.sin(2 * np.pi * shift[0])
        return coordinates @ np.array([[c, s], [-s, c]])
    if topology == "torus":
        return ((-coordinates if flipped else coordinates) + shift) % 1.0
    x, y = coordinates.T
    return np.stack([((-x if flipped else x) + shift[0]) % 1.0, 1.0 - y if flipped else y], axis=1)


def _measured(
    sai_a: SAI, a: tuple[Array, Mask], b: tuple[Array, Mask], shift: Array, *, flipped: bool
) -> tuple[float, float]:
    """Return the root mean square difference over what both show, and the share that is."""
    patch = domain(sai_a.topology, sai_a.frequency)
    assert isinstance(patch, FlatDomain)
    corners, weights = patch.locate(moved(patch.topology, patch.coordinates, shift, flipped=flipped))
    both = b[1] & a[1][corners].all(axis=1)
    if not both.any():
        return np.inf, 0.0
    lack = (a[0][corners] * weights).sum(axis=1) - b[0]
    areas = patch.cell_areas
    least = min(float(areas[each[1]].sum()) for each in (a, b))
    return float(np.sqrt(np.average(lack[both] ** 2, weights=areas[both]))), float(areas[both].sum() / least)


def _followed(
    sai_a: SAI, a: tuple[Array, Mask], b: tuple[Array, Mask], shift: Array, *, flipped: bool
) -> tuple[float, float, Array]:
    """Return the least distance around a shift, the share in common, and the shift: parabolas of smaller steps."""
    f = sai_a.frequency
    best, overlap = _measured(sai_a, a, b, shift, flipped=flipped)
    for step in STEPS:
        for axis, size in ((0, AROUND * f), (1, ACROSS * f))[: 2 if sai_a.topology == "torus" else 1]:
            aside = np.eye(2)[axis] * step / size
            before, after = (_measured(sai_a, a, b, shift + s * aside, flipped=flipped)[0] ** 2 for s in (-1, 1))
            bend = before - 2 * best**2 + after
            off = 0.5 * (before - after) / bend if np.isfinite(bend) and bend > 0 else 0.0
            other = (shift + np.clip(off, -2.0, 2.0) * aside) % 1.0
            distance, share = _measured(sai_a, a, b, other, flipped=flipped)
            if distance < best:
                best, overlap, shift = distance, share, other
    return best, overlap, shift


def _apart(one: Array, other: Array) -> float:
    """Return how far two shifts in turns differ, in degrees."""
    off = one - other
    return float(360 * np.hypot(*(off - np.rint(off))))


def _told(sai_a: SAI, sai_b: SAI, distance: float, overlap: float, shift: Array, *, flipped: bool) -> Match:
    """Return a hypothesis with the correspondences it makes."""
    patch = domain(sai_a.topology, sai_a.frequency)
    assert isinstance(patch, FlatDomain)
    corners, weights = patch.locate(moved(patch.topology, patch.coordinates, shift, flipped=flipped))
    both = ~sai_b.hidden & ~sai_a.hidden[corners].any(axis=1)
    corners, weights = corners[both], weights[both]
    c, s = np.cos(2 * np.pi * shift[0]), np.sin(2 * np.pi * shift[0])
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    radians = 2 * np.pi * (shift - np.rint(shift))
    return Match(
        rotation=_check.frozen(turn @ np.diag([1.0, -1.0, -1.0]) if flipped else turn),
        distance=distance,
        overlap=overlap,
        scale=1.0,
        scaled="",
        vertices_a=_check.frozen(corners[np.arange(len(corners)), weights.argmax(axis=1)]),
        vertices_b=_check.frozen(np.flatnonzero(both)),
        points_a=_check.frozen(np.einsum("kj,kjx->kx", weights, sai_a.mesh.vertices[corners])),
        points_b=_check.frozen(sai_b.mesh.vertices[both]),
        normals_a=_check.frozen(normalized(np.einsum("kj,kjx->kx", weights, sai_a.mesh.normals[corners]))),
        shift=_check.frozen(radians),
        flipped=flipped,
    )
