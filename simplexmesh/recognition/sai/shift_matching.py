"""Compare two signatures on a torus, cylinder or disc under all shifts, by FFT cross-correlation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import normalized
from simplexmesh.recognition.sai.attribute_image import SAI
from simplexmesh.recognition.sai.flat_domains import flat_domain
from simplexmesh.recognition.sai.match_result import CANDIDATES, MINIMUM_ANGLE, Match
from simplexmesh.recognition.sai.partial_signatures import smoothed

COLUMNS, ROWS = 10, 4
"""Columns and rows of the sampling grid per unit of frequency: twice the resolution of the mesh."""

STEPS = (0.5, 0.15, 0.05, 0.02)
"""Step sizes of the refinement of hypotheses, in grid cells."""


@dataclass(frozen=True, eq=False)
class SampleGrid:
    """Sample points of a domain, columns along the periodic direction; of the disc these are angles, the rows radii."""

    corners: Indices  # (rows, columns, 3) the triangle that holds each point
    weights: Array  # (rows, columns, 3) its barycentric coordinates there
    areas: Array  # (rows, 1) of its cell, as a fraction of the domain


@lru_cache(maxsize=16)
def sample_grid(topology: str, frequency: int) -> SampleGrid:
    """Return the sampling grid of a domain; cached."""
    columns, rows = COLUMNS * frequency, ROWS * frequency
    turns = np.arange(columns) / columns
    steps = np.arange(rows) / rows if topology == "torus" else (np.arange(rows) + 0.5) / rows
    x, y = np.meshgrid(turns, steps)
    at = np.stack([x, y], axis=-1)
    if topology == "plane":
        at = y[..., None] * np.stack([np.cos(2 * np.pi * x), np.sin(2 * np.pi * x)], axis=-1)
    patch = flat_domain(topology, frequency)
    corners, weights = patch.locate(at.reshape(-1, 2))
    areas = steps[:, None] if topology == "plane" else np.ones((rows, 1))
    return SampleGrid(
        corners.reshape(rows, columns, 3), weights.reshape(rows, columns, 3), areas / areas.sum() / columns
    )


def match_shifts(
    sai_a: SAI, sai_b: SAI, best: int, minimum_overlap: float, smoothing: int, limit: float
) -> list[Match]:
    """Return the best hypotheses for two signatures of one flat domain; see `match`."""
    a, b = (compared_values(one, smoothing, limit) for one in (sai_a, sai_b))
    if not (a[1].any() and b[1].any()):
        return []
    found = [
        (*_distance(sai_a, a, b, shift, flipped=flipped), shift, flipped)
        for flipped in ((False, True) if sai_a.topology != "plane" else (False,))
        for shift in _candidates(sai_a, a, b, CANDIDATES * best, minimum_overlap, flipped=flipped)
    ]
    found = [one for one in found if one[1] >= minimum_overlap]
    found.sort(key=lambda one: one[0])
    kept: list[tuple[float, float, Array, bool]] = []
    for one in found:
        if len(kept) < best and all(one[3] != k[3] or _angle_between(one[2], k[2]) >= MINIMUM_ANGLE for k in kept):
            kept.append(one)
    refined = [(*_refined(sai_a, a, b, one[2], minimum_overlap, flipped=one[3]), one[3]) for one in kept]
    refined.sort(key=lambda one: one[0])
    return [_as_match(sai_a, sai_b, *one[:3], flipped=one[3]) for one in refined]


def compared_values(sai: SAI, smoothing: int, limit: float) -> tuple[Array, Mask]:
    """Return the angles for comparison, smoothed and clipped, and a mask of the vertices that count."""
    seen = ~(sai.hidden | sai.hidden[sai.mesh.neighbors].any(axis=1))
    return np.clip(smoothed(sai.angles, seen, sai.mesh.neighbors, smoothing), -limit, limit), seen


def _candidates(
    sai_a: SAI, a: tuple[Array, Mask], b: tuple[Array, Mask], count: int, minimum_overlap: float, *, flipped: bool
) -> list[Array]:
    """Return shifts (2,), in turns, at local minima of the mean squared difference, best first."""
    total, common = shift_differences(sai_a.topology, sai_a.frequency, a, b, flipped=flipped)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(common >= minimum_overlap * common.max(), np.maximum(total, 0.0) / common, np.inf)
    lowest = np.isfinite(mean)
    for axis in (0, 1):
        for step in (-1, 1):
            lowest &= mean <= np.roll(mean, step, axis=axis)
    rows, columns = np.nonzero(lowest)
    order = np.argsort(mean[rows, columns], kind="stable")[:count]
    minima = zip(rows[order].tolist(), columns[order].tolist(), strict=True)
    return [np.array([_parabola_minimum(mean, r, c, 1), _parabola_minimum(mean, r, c, 0)]) for r, c in minima]


def shift_differences(
    topology: str, frequency: int, a: tuple[Array, Mask], b: tuple[Array, Mask], *, flipped: bool
) -> tuple[Array, Array]:
    """Return squared differences over the common part, and its area, for shifts around the tube and around the axis."""
    grid_points = sample_grid(topology, frequency)
    (values_a, weight_a), (values_b, weight_b) = (_on_grid(grid_points, *each) for each in (a, b))
    if flipped:
        values_b, weight_b = (_half_turned(each, topology) for each in (values_b, weight_b))
    weight_b = weight_b * grid_points.areas
    turns = topology == "torus"

    def sums(first: Array, second: Array) -> Array:
        if turns:
            return np.fft.irfft2(np.fft.rfft2(first) * np.conj(np.fft.rfft2(second)), s=first.shape)
        product = np.fft.rfft(first, axis=1) * np.conj(np.fft.rfft(second, axis=1))
        return np.fft.irfft(product.sum(axis=0), n=first.shape[1])[None]

    total = (
        sums(weight_a * values_a**2, weight_b)
        - 2 * sums(weight_a * values_a, weight_b * values_b)
        + sums(weight_a, weight_b * values_b**2)
    )
    return total, sums(weight_a, weight_b)


def _on_grid(grid_points: SampleGrid, values: Array, seen: Mask) -> tuple[Array, Array]:
    """Return values at grid points, zero where a corner does not count, and weights of 0 or 1."""
    valid = seen[grid_points.corners].all(axis=2)
    return np.where(valid, (values[grid_points.corners] * grid_points.weights).sum(axis=2), 0.0), valid.astype(float)


def _half_turned(values: Array, topology: str) -> Array:
    """Return values (rows, columns) with both directions reversed."""
    values = np.roll(values[:, ::-1], 1, axis=1)
    return np.roll(values[::-1], 1, axis=0) if topology == "torus" else values[::-1]


def _parabola_minimum(mean: Array, row: int, column: int, axis: int) -> float:
    """Return the minimum, in turns, of the parabola through a grid minimum and its neighbors along an axis."""
    size, at = mean.shape[axis], (row, column)[axis]
    line = mean[row] if axis else mean[:, column]
    before, here, after = (float(line[(at + step) % size]) for step in (-1, 0, 1))
    curvature = before - 2 * here + after
    offset = 0.5 * (before - after) / curvature if np.isfinite(curvature) and curvature > 0 else 0.0
    return float(((at + np.clip(offset, -0.5, 0.5)) / size) % 1.0)


def shifted(topology: str, coordinates: Array, shift: Array, *, flipped: bool) -> Array:
    """Return coordinates (k, 2) after an optional half turn and a shift (2,) in turns."""
    if topology == "plane":
        c, s = np.cos(2 * np.pi * shift[0]), np.sin(2 * np.pi * shift[0])
        return coordinates @ np.array([[c, s], [-s, c]])
    if topology == "torus":
        return ((-coordinates if flipped else coordinates) + shift) % 1.0
    x, y = coordinates.T
    return np.stack([((-x if flipped else x) + shift[0]) % 1.0, 1.0 - y if flipped else y], axis=1)


def _distance(
    sai_a: SAI, a: tuple[Array, Mask], b: tuple[Array, Mask], shift: Array, *, flipped: bool
) -> tuple[float, float]:
    """Return the root mean square difference over the common part, and the overlap."""
    patch = flat_domain(sai_a.topology, sai_a.frequency)
    corners, weights = patch.locate(shifted(patch.topology, patch.coordinates, shift, flipped=flipped))
    both = b[1] & a[1][corners].all(axis=1)
    if not both.any():
        return np.inf, 0.0
    difference = (a[0][corners] * weights).sum(axis=1) - b[0]
    areas = patch.cell_areas
    smaller = min(float(areas[each[1]].sum()) for each in (a, b))
    distance = np.sqrt(np.average(difference[both] ** 2, weights=areas[both]))
    return float(distance), float(areas[both].sum() / smaller)


def _refined(
    sai_a: SAI, a: tuple[Array, Mask], b: tuple[Array, Mask], shift: Array, minimum_overlap: float, *, flipped: bool
) -> tuple[float, float, Array]:
    """Return the minimum distance near a shift, its overlap and its shift, by parabolic steps of decreasing size."""
    f = sai_a.frequency
    best, overlap = _distance(sai_a, a, b, shift, flipped=flipped)
    for step in STEPS:
        for axis, size in ((0, COLUMNS * f), (1, ROWS * f))[: 2 if sai_a.topology == "torus" else 1]:
            delta = np.eye(2)[axis] * step / size
            before, after = (_distance(sai_a, a, b, shift + s * delta, flipped=flipped)[0] ** 2 for s in (-1, 1))
            curvature = before - 2 * best**2 + after
            offset = 0.5 * (before - after) / curvature if np.isfinite(curvature) and curvature > 0 else 0.0
            other = (shift + np.clip(offset, -2.0, 2.0) * delta) % 1.0
            distance, fraction = _distance(sai_a, a, b, other, flipped=flipped)
            if distance < best and fraction >= minimum_overlap:
                best, overlap, shift = distance, fraction, other
    return best, overlap, shift


def _angle_between(one: Array, other: Array) -> float:
    """Return the difference of two shifts in turns, in radians."""
    offset = one - other
    return float(2 * np.pi * np.hypot(*(offset - np.rint(offset))))


def _as_match(sai_a: SAI, sai_b: SAI, distance: float, overlap: float, shift: Array, *, flipped: bool) -> Match:
    """Return the match of a hypothesis, with its correspondences."""
    patch = flat_domain(sai_a.topology, sai_a.frequency)
    corners, weights = patch.locate(shifted(patch.topology, patch.coordinates, shift, flipped=flipped))
    both = ~sai_b.hidden & ~sai_a.hidden[corners].any(axis=1)
    corners, weights = corners[both], weights[both]
    c, s = np.cos(2 * np.pi * shift[0]), np.sin(2 * np.pi * shift[0])
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    radians = 2 * np.pi * (shift - np.rint(shift))
    return Match(
        rotation=checks.frozen(turn @ np.diag([1.0, -1.0, -1.0]) if flipped else turn),
        distance=distance,
        overlap=overlap,
        scale=1.0,
        scaled="",
        vertices_target=checks.frozen(corners[np.arange(len(corners)), weights.argmax(axis=1)]),
        vertices_source=checks.frozen(np.flatnonzero(both)),
        points_target=checks.frozen(np.einsum("kj,kjx->kx", weights, sai_a.mesh.vertices[corners])),
        points_source=checks.frozen(sai_b.mesh.vertices[both]),
        normals_target=checks.frozen(normalized(np.einsum("kj,kjx->kx", weights, sai_a.mesh.normals[corners]))),
        shift=checks.frozen(radians),
        flipped=flipped,
    )
