"""Initial values of beams and flanges, from points and their normals of either sign."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import tangents
from simplexmesh.data.primitives import Beam, Flange, FlangePair, Primitive
from simplexmesh.numerics.round_fits import across_normals, from_axis, met_axis

SHARES = (0.05, 0.15)
"""Of a beam's size, that its flanges and its web are thick at first."""

OUTERMOST = 0.02
"""Share of the points that are beyond where a size begins: some of them are strays."""

RIM = 0.9
"""Share of the radius from which on points are of a flange's disc."""


def beams(points: Array, normals: Array) -> Iterator[Beam]:
    """Yield beams along what is across all normals, whose sides most normals are along (4.4.1), in the points' box."""
    axis = across_normals(normals)[2]
    frame = np.stack(tangents(axis))
    x, y = frame @ normals.T
    turn = np.angle(np.sum((x + 1j * y) ** 4)) / 4  # sides differ by quarter turns
    one = np.cos(turn) * frame[0] + np.sin(turn) * frame[1]
    for across in (one, np.cross(axis, one)):
        at = points @ np.stack([across, np.cross(axis, across)]).T
        low, high = np.quantile(at, (OUTERMOST, 1 - OUTERMOST), axis=0)
        width, depth = high - low
        if not min(width, depth) > 0:
            continue
        middle = (low + high) / 2 @ np.stack([across, np.cross(axis, across)])
        for share in SHARES:
            yield Beam(middle, axis, depth, width, share * depth, share * width, across=across)


def flanges(kind: type[Flange], points: Array, normals: Array) -> Iterator[Flange]:
    """Yield flanges about the line that all normals meet, with the neck on either side."""
    met = met_axis(points, normals)
    if met is None:
        return
    on, axis = met
    rho, z = from_axis(points, on, axis)
    radius = float(np.quantile(rho, 1 - OUTERMOST))
    low, high = np.quantile(z[rho > RIM * radius], (OUTERMOST, 1 - OUTERMOST))
    for sign, side, behind in ((1, low, rho[z < low]), (-1, high, rho[z > high])):
        if len(behind) and 0 < (neck := float(np.median(behind))) < RIM * radius and high > low:
            yield kind(on + side * axis, sign * axis, radius, float(high - low), neck)


STARTS: dict[str, Callable[[Array, Array], Iterator[Primitive]]] = {
    "beam": beams,
    "flange": lambda points, normals: flanges(Flange, points, normals),
    "flange pair": lambda points, normals: flanges(FlangePair, points, normals),
}
"""By kind; they take points about the origin and of unit size."""
