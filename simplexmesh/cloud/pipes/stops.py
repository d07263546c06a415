"""Why lines end: their points do, or something else begins there, such as a flange, a vessel or a wall."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import norm
from simplexmesh.cloud.pipes.line import PipeLine
from simplexmesh.cloud.pipes.tolerances import BAND

WIDE = 2.0
"""Distance from the axis of what is looked at, in radii."""

AT_END, BEFORE = (-0.25, 1.0), (-3.0, -1.75)
"""Where something may begin, and where it must not be yet: a floor is beside the whole pipe."""

FEW = 0.2
"""Points that begin, as a share of those on a radius of the line: outliers are fewer."""


def with_stops(line: PipeLine, points: Array) -> PipeLine:
    """Return a line that says where more begins among the points (n, 3) of the cloud than its own that end."""
    ways = zip(line.stops, line.chain.corners[[0, -1]], line.chain.directions[[0, -1]] * [[-1], [1]], strict=True)
    start, end = ("obstacle" if stop == "end" and _begins(line, points, *way) else stop for stop, *way in ways)
    return replace(line, stops=(start, end))


def _begins(line: PipeLine, points: Array, end: Array, along: Array) -> bool:
    """Whether there is more around an end that is not of the line than as far before it."""
    r = float(line.chain.radii.max())
    others = points[(line.labels < 0) & (np.abs(points - end) < 4 * r).all(axis=1)] - end
    height = others @ along
    away = norm(others - height[:, None] * along)
    near = (away < WIDE * r) & (np.abs(away - r) > BAND * r)
    begun, before = (int((near & (height > low * r) & (height < high * r)).sum()) for low, high in (AT_END, BEFORE))
    return begun - before > FEW * (line.labels >= 0).sum() * r / line.length
