"""The elements of a chain, each with its primitive."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh._base.vectors import cross, dot, normalized
from simplexmesh.cloud.pipes.chain import Chain
from simplexmesh.cloud.pipes.line import PipeElement
from simplexmesh.cloud.primitives import Cone, Cylinder, Fit, Primitive, Torus

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SHORTEST = 1e-6
"""Length of a straight between two bends, in radii, that is none."""


def elements_of(chain: Chain, points: Array, deviations: Array) -> tuple[tuple[PipeElement, ...], Indices]:
    """Return the elements of a chain in their order, and of each of its points (n, 3) the element.

    `deviations` (p,) are of the chain's parameters, which end with its bend radii and its radii.
    """
    feet = chain.feet(points)
    residual = chain.distance(points, feet)
    stations = chain.station(feet)
    parts = _parts(chain)
    starts = np.array([station for station, _, _ in parts])
    labels = np.clip(np.searchsorted(starts, stations, side="right") - 1, 0, len(parts) - 1)
    sizes = deviations[len(deviations) - len(chain.radii) :]
    bends = deviations[len(deviations) - len(chain.radii) - len(chain.bend_radii) : len(deviations) - len(chain.radii)]
    ends = np.append(starts[1:], chain.stations[-1])
    out = []
    for k, (start, kind, number) in enumerate(parts):
        fit = _fit(residual[labels == k])
        if kind == "bend":
            out.append(_bend(chain, number, fit, float(bends[number]), sizes))
        else:
            out.append(_straight(chain, kind, (float(start), float(ends[k])), fit, sizes))
    return tuple(out), labels


def _parts(chain: Chain) -> list[tuple[float, str, int]]:
    """Return the station at which each element starts, its kind, and the number of its corner."""
    out = []
    least = SHORTEST * float(chain.radii.min())
    for piece in range(len(chain.stations) - 1):
        start, end = chain.stations[piece], chain.stations[piece + 1]
        if end - start <= least:
            continue
        out.append((float(start), "bend" if piece % 2 else "straight", piece // 2))
        for j, low, high in chain.changes if piece % 2 == 0 else ():
            if j == piece // 2:
                offset = start - chain.limits[int(j), 0]
                out += [(float(offset + low), "reducer", piece // 2), (float(offset + high), "straight", piece // 2)]
    return out


def _fit(residual: Array) -> Fit:
    """Return how points at distances from an element were fitted, with an extent to be set."""
    count = len(residual)
    rms = float(np.sqrt((residual**2).mean())) if count else float("nan")
    return Fit(rms, rms, np.zeros((0, 0)), np.zeros((2, 2)), count)


def _with_extent(primitive: Primitive, fit: Fit, extent: list[list[float]]) -> Primitive:
    """Return a primitive with the extent of an element."""
    p = primitive.n_parameters
    return primitive.with_fit(Fit(fit.rms, fit.noise, np.full((p, p), np.nan), checks.frozen(extent), fit.count))


def _straight(chain: Chain, kind: str, stations: tuple[float, float], fit: Fit, sizes: Array) -> PipeElement:
    """Return the straight, or the reducer, between two stations."""
    (start, end), along = chain.at(stations)
    middle = chain.feet(chain.at([(stations[0] + stations[1]) / 2])[0])
    radii, _ = chain.radius_at(chain.feet(np.stack([start, end])))
    length, turn = stations[1] - stations[0], [-np.pi, np.pi]
    lower = int(chain._blend(middle)[0][0])
    primitive: Primitive
    if kind == "straight":
        radii[:] = chain.radii[lower]
        primitive = _with_extent(Cylinder(start, along[0], radii[0]), fit, [turn, [0.0, length]])
    else:
        slope = (radii[1] - radii[0]) / length
        apex = start - radii[0] / slope * along[0]
        cone = Cone(apex, np.sign(slope) * along[0], float(np.arctan(abs(slope))))
        primitive = _with_extent(cone, fit, [turn, sorted([radii[0] / abs(slope), radii[1] / abs(slope)])])
    deviations = {"radius": float(sizes[lower])}
    ends = checks.frozen(start), checks.frozen(end), float(radii[0]), float(radii[1])
    return PipeElement(kind, *ends, None, None, length, primitive, deviations)


def _bend(chain: Chain, i: int, fit: Fit, deviation: float, sizes: Array) -> PipeElement:
    """Return the bend in a corner."""
    start, end = chain.at(chain.stations[2 * i + 1 : 2 * i + 3])[0]
    k = int(np.searchsorted(chain.changes[:, 0], i + 0.5))
    radius, bend, angle = float(chain.radii[k]), float(chain.bend_radii[i]), float(chain.angles[i])
    axis = normalized(cross(chain.directions[i], chain.directions[i + 1]))
    torus = Torus(chain.centers[i], axis, bend, min(radius, bend))
    first = float(torus.coordinates(start[None])[0, 0])
    primitive = _with_extent(torus, fit, [[first, first + angle], [-np.pi, np.pi]])
    deviations = {"radius": float(sizes[k]), "bend_radius": deviation}
    ends = checks.frozen(start), checks.frozen(end), radius, radius
    return PipeElement("bend", *ends, bend, angle, bend * angle, primitive, deviations)


def meeting(one: PipeElement, other: PipeElement) -> tuple[float, float]:
    """Return how far the end of an element is from the start of the next one, and the sine between their axes there."""
    away = other.start - one.end
    return float(np.sqrt(dot(away, away))), float(
        np.linalg.norm(cross(_leaving(one, end=True), _leaving(other, end=False)))
    )


def _leaving(element: PipeElement, *, end: bool) -> Array:
    """Return the direction of the axis of an element at its start or its end."""
    if isinstance(torus := element.primitive, Torus):
        place = element.end if end else element.start
        return normalized(cross(torus.axis, place - torus.center))
    return normalized(element.end - element.start)
