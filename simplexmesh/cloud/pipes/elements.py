"""The elements of a chain, each with its primitive, and how sure their measures are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import cross, norm, normalized
from simplexmesh.cloud.pipes.chain import SHORTEST, Chain
from simplexmesh.cloud.pipes.line import Deviations, PipeElement
from simplexmesh.cloud.pipes.tracing.prolonging import BEYOND
from simplexmesh.data.primitives import Cone, Cylinder, Fit, Primitive, Torus
from simplexmesh.data.primitives.oblique_cone import ObliqueCone

STEP = 1e-5
"""Of difference quotients, in radii."""

LENGTH = 8
"""The length among an element's measures."""


class Part(NamedTuple):
    """Which part of a chain an element is: its ends among all marks, its segment or corner, and its radius."""

    kind: str
    first: int
    last: int
    number: int
    size: int


class Measures(NamedTuple):
    """What is told of an element, and the pose and the shape of its primitive."""

    start: Array
    end: Array
    sizes: Array  # radius, end radius, length, and of a bend its radius and angle, of a reducer its offset
    origin: Array
    axis: Array
    shape: Array
    lean: Array = np.zeros(3)

    def primitive(self, kind: str) -> Primitive:
        """Return the primitive of a kind of element."""
        if self.lean.any():
            return ObliqueCone(self.origin, self.axis, float(self.shape[0]), lean=self.lean)
        made = {"straight": Cylinder, "bend": Torus, "reducer": Cone}[kind]
        out: Primitive = made(self.origin, self.axis, *self.shape.tolist())
        return out


def elements_of(
    chain: Chain, points: Array, covariance: Array, origin: Array
) -> tuple[tuple[PipeElement, ...], Indices]:
    """Return the elements of a chain in their order, and of each of its points (n, 3) the element.

    `covariance` (p, p) is that of the chain's parameters, and `origin` (3,) where elements are moved to.
    """
    feet, parts = chain.feet(points), parts_of(chain)
    starts = _marks(chain)[[part.first for part in parts]]
    labels = np.clip(np.searchsorted(starts, feet.station, side="right") - 1, 0, len(parts) - 1)
    here = measures_of(chain, parts)
    by_parameters = _by_parameters(chain, parts)
    out = []
    for k, part in enumerate(parts):
        spread = by_parameters[k] @ covariance @ by_parameters[k].T
        start, end, sizes, center, *rest = here[k]
        placed = Measures(start + origin, end + origin, sizes, center + origin, *rest)
        own = feet.distance[labels == k]
        if not chain.closed:
            ends = (part.first == 0) + (part.last == len(chain.stations) - 1)
            spread[LENGTH, LENGTH] += ends * ((BEYOND + 1) * sizes[2] / max(len(own), 1)) ** 2
        out.append(_element(part.kind, placed, spread, own))
    return tuple(out), labels


def parts_of(chain: Chain) -> list[Part]:
    """Return the elements of a chain as parts of it."""
    out: list[Part] = []
    marks, least, ends = _marks(chain), SHORTEST * float(chain.radii.min()), len(chain.stations)
    size = 0
    for piece in range(ends - 1):
        if chain.stations[piece + 1] - chain.stations[piece] <= least:
            continue
        if piece % 2:
            out.append(Part("bend", piece, piece + 1, piece // 2, size))
            continue
        cuts = [piece]
        for k in np.flatnonzero(chain.changes[:, 0] == piece // 2):
            cuts += [ends + 2 * int(k), ends + 2 * int(k) + 1]
        for number, (first, last) in enumerate(zip(cuts, [*cuts[1:], piece + 1], strict=True)):
            kind = "reducer" if number % 2 else "straight"
            out += [Part(kind, first, last, piece // 2, size)] if marks[last] - marks[first] > least else []
            size += number % 2
    return out


def measures_of(chain: Chain, parts: list[Part]) -> list[Measures]:
    """Return the measures of parts of a chain."""
    marks = _marks(chain)
    points, along = chain.at(marks)
    out = []
    for kind, first, last, number, size in parts:
        start, end, length, radius = points[first], points[last], marks[last] - marks[first], chain.radii[size]
        if kind == "bend":
            axis = cross(chain.directions[number], chain.directions[number + 1])
            shape = np.array([chain.bend_radii[number], radius])
            sizes = np.array([radius, radius, length, shape[0], chain.angles[number]])
            out.append(Measures(start, end, sizes, chain.centers[number], normalized(axis), shape))
        elif kind == "reducer":
            after = chain.radii[size + 1]
            slope, sizes = (after - radius) / length, np.array([radius, after, length])
            lean, sign = chain.offsets[size] / length, np.sign(slope)
            apex = start - radius / slope * (along[first] + lean)
            sizes = np.append(sizes, norm(chain.offsets[size])) if chain.eccentric[size] else sizes
            out.append(Measures(start, end, sizes, apex, sign * along[first], np.arctan(np.abs([slope])), sign * lean))
        else:
            sizes = np.array([radius, radius, length])
            out.append(Measures(start, end, sizes, start, along[first], np.array([radius])))
    return out


def _marks(chain: Chain) -> Array:
    """Return the stations where pieces start and end, then those where changes of the radius do."""
    segments = chain.changes[:, 0].astype(int)
    offsets = chain.stations[2 * segments] - chain.limits[segments, 0]
    return np.concatenate([chain.stations, (offsets[:, None] + chain.changes[:, 1:]).ravel()])


def _by_parameters(chain: Chain, parts: list[Part]) -> list[Array]:
    """Return the derivatives of all measures of parts by the chain's parameters, as difference quotients."""
    step = STEP * float(chain.radii.min())
    columns = []
    for unit in step * np.eye(chain.n_parameters):
        ways = [[np.concatenate(each) for each in measures_of(chain.moved(sign * unit), parts)] for sign in (1, -1)]
        columns.append([(there - back) / (2 * step) for there, back in zip(*ways, strict=True)])
    return [np.stack(column, axis=1) for column in zip(*columns, strict=True)]


def _element(kind: str, measures: Measures, spread: Array, residual: Array) -> PipeElement:
    """Return an element, from the covariance of its measures, and the distances of its points."""
    primitive, sizes = measures.primitive(kind), measures.sizes
    cuts = np.cumsum([len(each) for each in measures])
    chart = _chart(primitive, cuts)
    rms = float(np.sqrt((residual**2).mean())) if len(residual) else float("nan")
    turn, length = [-np.pi, np.pi], float(sizes[2])
    extent = [turn, [0.0, length]]
    if kind == "bend":
        first = float(primitive.coordinates(measures.start[None])[0, 0])
        extent = [[first, first + float(sizes[4])], turn]
    elif kind == "reducer":
        extent = [turn, sorted(float((end - measures.origin) @ measures.axis) for end in measures[:2])]
    fit = Fit(rms, rms, checks.frozen(chart @ spread @ chart.T), checks.frozen(extent), len(residual))
    variance = np.maximum(np.diagonal(spread), 0.0)
    ends = (float(np.sqrt(variance[part].sum())) for part in (slice(0, 3), slice(3, 6)))
    sure = dict(zip(_names(kind), np.sqrt(variance[6 : cuts[2]]).tolist(), strict=False))
    told = {"bend_radius": None, "bend_angle": None} | dict(zip(_names(kind), sizes.tolist(), strict=False))
    places = checks.frozen(measures.start), checks.frozen(measures.end)
    return PipeElement(kind, *places, primitive=primitive.with_fit(fit), deviations=Deviations(*ends, **sure), **told)


def _names(kind: str) -> tuple[str, ...]:
    """Return the names of the sizes of a kind of element; the offset is of eccentric reducers only."""
    return ("radius", "end_radius", "length", *(("bend_radius", "bend_angle") if kind == "bend" else ("offset",)))


def _chart(primitive: Primitive, cuts: Array) -> Array:
    """Return the derivatives of a primitive's parameters by the measures of its element."""
    out = np.zeros((5 + len(primitive._shape), cuts[-1]))
    out[:2, cuts[3] : cuts[4]] = primitive.frame[:2]
    out[2:5, cuts[2] : cuts[3]] = primitive.frame
    out[5:, cuts[4] : cuts[5]] = np.eye(len(primitive._shape))
    return out[[*primitive._moves, *range(5, len(out))]]
