"""Refinement of a chain as one primitive: least squares over its corners, radii and bend radii together."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.vectors import cross, dot, norm
from simplexmesh.cloud.fitting.solver import solve
from simplexmesh.cloud.pipes.chain import Chain, Feet
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

BAND = 0.3
"""Distance from the surface, in radii, within which points may be of the pipe before it is refined."""

FACING = 0.7
"""Cosine of the angle between the normals of the pipe and of its points: those of walls differ more."""

FITTED = 12_000
"""Points that are fitted to, at most: some hundreds on each of dozens of elements."""

LOOSE = 0.1
"""Scale of the first loss, in radii: bends are traced as well."""

TIGHT = 3.0
"""Scale of the last loss, in deviations of the noise."""

MOST_NOISE = 0.06
"""Deviation of points from a pipe, in radii: of even points within the first band it is twice that."""

TOLERANCE = 1e-5
"""Share of the cost that a last step promises to take off: a thousandth of the deviations of parameters."""

SLIGHT = np.radians(8)
"""Turn of a corner that may be one too much."""

SUPERFLUOUS = 8.0
"""Parameters of a corner, twice: the price of one is that of Schwarz' criterion with correlated noise."""

PAST = 0.5
"""Length beyond the traced ends, in radii, where points may still be of the pipe: a step."""


@dataclass(frozen=True, eq=False)
class Moving:
    """A chain that moves a little at a time, with the feet of the points that it is fitted to."""

    chain: Chain
    points: Array
    piece: Indices

    def distance(self, points: Array) -> Array:
        """Return the signed distances (n,) of the points."""
        return self.chain.distance(points, self._moved)

    def derivatives(self, points: Array) -> Array:
        """Return the derivatives (n, p) of the distances by the chain's parameters."""
        return self.chain.derivatives(points, self._moved)

    def stepped(self, step: Array) -> Moving:
        """Return the moved chain; feet are then sought from where they were."""
        return Moving(self.chain.stepped(step), self.points, self._moved.piece)

    @cached_property
    def _moved(self) -> Feet:
        return self.chain.feet(self.points, self.piece)


def near_surface(around: Surroundings, chain: Chain, band: float) -> Indices:
    """Return which points are within a distance of the chain's surface, between its ends, and face as it does."""
    step = 0.5 * around.radius
    places = chain.at(np.arange(-step, chain.stations[-1] + 2 * step, step))[0]
    reach = float(chain.radii.max()) + 2 * step
    lists = around.tree.query_ball_point(places, reach)
    at = np.unique(np.concatenate([np.asarray(found, np.int64) for found in lists]))
    if not len(at):
        return at
    points = around.points[at]
    feet = chain.feet(points)
    station = chain.station(feet)
    within = (station > -PAST * around.radius) & (station < chain.stations[-1] + PAST * around.radius)
    at = at[within & (np.abs(chain.distance(points)) < band)]
    facing = np.abs(dot(around.normals(at), chain.gradient(around.points[at]))) > FACING
    return at[facing]


def refined(around: Surroundings, chain: Chain, *, fixed_radius: bool = False) -> tuple[Chain, Array, float]:
    """Return the chain of least distance from its points, its normal matrix, and the deviation of their noise."""
    deviation, matrix = LOOSE * around.radius / TIGHT, np.zeros((0, 0))
    for k in range(3):
        at = near_surface(around, chain, max(BAND * around.radius / (1 + k), 3 * deviation))
        most = FITTED if k == 2 else FITTED // 4  # the last round alone needs them all
        at = at[:: -(-len(at) // most)] if len(at) else at
        if len(at) < 10:
            break
        points = around.points[at]
        fixed = np.zeros(chain.derivatives(points[:1]).shape[1], bool)
        fixed[len(fixed) - len(chain.radii) :] = fixed_radius
        hold = fixed if fixed_radius else None
        moving, matrix = solve(
            Moving(chain, points, chain.feet(points).piece),
            points,
            fixed=hold,
            loss_scale=TIGHT * deviation,
            tolerance=TOLERANCE,
        )
        chain = moving.chain
        off = np.abs(chain.distance(points))
        deviation = float(np.clip(1.4826 * np.median(off), 1e-9 * around.radius, MOST_NOISE * around.radius))
    return chain, matrix, deviation


def simplified(around: Surroundings, chain: Chain, *, fixed_radius: bool = False) -> Chain:
    """Return the chain without corners that its points do not ask for: slight ones, and where two bends are one."""
    k = 0
    while k < len(chain.bend_radii):
        fewer = next(filter(None, (merge(chain, k) for merge in (_without_corner, _with_one_bend))), None)
        if fewer is None:
            k += 1
            continue
        better = cheaper(around, chain, fewer, SUPERFLUOUS, fixed_radius=fixed_radius)
        chain, k = (chain, k + 1) if better is chain else (better, 0)
    return chain


def cheaper(around: Surroundings, chain: Chain, other: Chain, price: float, *, fixed_radius: bool = False) -> Chain:
    """Return the second of two chains, fitted again, if it costs less than the first and a price."""
    at = near_surface(around, chain, BAND * around.radius)
    if not len(at):
        return chain
    points, scale = around.points[at[:: -(-len(at) // FITTED)]], LOOSE * around.radius / TIGHT
    costs = []
    for each in (chain, other):
        held = np.zeros(each.derivatives(points[:1]).shape[1], bool)
        held[len(held) - len(each.radii) :] = fixed_radius
        moving = Moving(each, points, each.feet(points).piece)
        moved = solve(moving, points, fixed=held, loss_scale=scale, tolerance=TOLERANCE)[0].chain
        square = moved.distance(points) ** 2
        costs.append((float((square / (1 + square / scale**2)).sum()), moved))
    better = costs[1][0] < costs[0][0] * (1 + price * np.log(len(points)) / len(points))
    return costs[1][1] if better else chain


def _without_corner(chain: Chain, i: int) -> Chain | None:
    """Return a chain without corner i, if that turns slightly."""
    if chain.angles[i] > SLIGHT:
        return None
    return replace(chain, corners=np.delete(chain.corners, i + 1, axis=0), bend_radii=np.delete(chain.bend_radii, i))


def _with_one_bend(chain: Chain, i: int) -> Chain | None:
    """Return a chain with one bend instead of corners i and i + 1, if they are near and the axes beside them meet."""
    if i + 1 >= len(chain.bend_radii) or np.diff(chain.limits[i + 1])[0] > chain.radii.max():
        return None
    u, v = chain.directions[i], chain.directions[i + 2]
    across = cross(u, v)
    sine = float(norm(across))
    if sine < SLIGHT:
        return None
    between = chain.corners[i + 2] - chain.corners[i + 1]
    ahead, behind, apart = np.linalg.solve(np.stack([u, v, across / sine], axis=1), between)
    if abs(apart) > LOOSE * chain.radii.max() or min(ahead, behind) < 0:
        return None
    corners = np.delete(chain.corners, i + 2, axis=0)
    corners[i + 1] = chain.corners[i + 1] + ahead * u + apart / 2 * across / sine
    bends = np.delete(chain.bend_radii, i + 1)
    bends[i] = chain.bend_radii[i : i + 2].max()
    return replace(chain, corners=corners, bend_radii=bends).fitting()
