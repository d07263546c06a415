"""Refinement of a chain as one primitive: least squares over its corners, radii and bend radii together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import null_space

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import cross, dot, norm, tangents
from simplexmesh.cloud.fitting.refine import WITHIN
from simplexmesh.cloud.fitting.solver import solve
from simplexmesh.cloud.pipes.chain import MOST_ANGLE, Chain
from simplexmesh.cloud.pipes.tolerances import BAND, FACING, LOOSE, SHORT, SLIGHT
from simplexmesh.cloud.pipes.tracing._kernels_tracing import STEP
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings
from simplexmesh.numerics.robust import NORMAL_MAD
from simplexmesh.numerics.round_fits import between_axes

MOST_NOISE = 0.06
"""Deviation of points from a pipe, in radii: of even points within the first band it is twice that."""

TOLERANCE = 1e-5
"""Share of the cost that a last step promises to take off: a thousandth of the deviations of parameters."""

SUPERFLUOUS = 8.0
"""Parameters of a corner, twice: the price of one is that of Schwarz' criterion with correlated noise."""

Near = tuple[Array, Chain]
"""Points near a chain, and the chain fitted to them."""


def near_surface(around: Surroundings, chain: Chain, band: float) -> Indices:
    """Return which points are within a distance of the chain's surface, between its ends, and face as it does."""
    feet, past = chain.feet(around.points), STEP * around.radius
    within = (feet.station > -past) & (feet.station < chain.stations[-1] + past)
    at = np.flatnonzero(within & (np.abs(feet.distance) < band))
    found: Indices = at[np.abs(dot(around.normals(at), feet.normal[at])) > FACING]
    return found


def refined(around: Surroundings, chain: Chain) -> tuple[Chain, float]:
    """Return the chain of least distance from its points, and the deviation of their noise."""
    r = around.radius
    deviation = LOOSE * r / WITHIN
    for k in range(3):
        at = near_surface(around, chain, max(BAND * r / (1 + k), 3 * deviation))
        if len(at) < chain.n_parameters:
            raise ValueError(f"pick must be on a pipe, but no more than {len(at)} points are on that which is there")
        points = around.points[at]
        chain = fitted(around, chain, points, WITHIN * deviation)
        deviation = float(np.clip(NORMAL_MAD * np.median(np.abs(chain.distance(points))), 1e-9 * r, MOST_NOISE * r))
    if deviation > around.most_deviation:
        raise ValueError(f"pick must be on a pipe, but points deviate by {deviation:.3g} from that which is there")
    return chain, deviation


def off_axis(around: Surroundings, chain: Chain, deviation: float) -> Chain:
    """Return a chain with all those reducers eccentric that points ask for, by what a step promises to take off.

    These are drawn out, as reducers on one axis become steps in fits to those that are not.
    """
    points = around.points[near_surface(around, chain, WITHIN * deviation)]
    for k in np.flatnonzero(~chain.eccentric):
        offsets = chain.offsets.copy()
        offsets[k] = 1e-9 * around.radius * tangents(chain.directions[int(chain.changes[k, 0])])[0]
        tried = replace(chain, offsets=offsets)
        matrix, downhill, _ = tried.normal_equations(points, loss_scale=WITHIN * deviation)
        gain = downhill @ np.linalg.pinv(matrix, hermitian=True) @ downhill / deviation**2
        chain = _drawn_out(tried, int(k)) if gain > SUPERFLUOUS * np.log(len(points)) else chain
    return chain


def _drawn_out(chain: Chain, k: int) -> Chain:
    """Return a chain whose change k is as long as the pipe is wide, if there is room."""
    j, middle = int(chain.changes[k, 0]), chain.changes[k, 1:].mean()
    others = np.delete(chain.changes, k, axis=0)
    beside = [*chain.limits[j], *others[others[:, 0] == j, 1:].ravel()]
    half = min(max(np.ptp(chain.changes[k, 1:]) / 2, chain.radii[k]), np.abs(beside - middle).min())
    changes = chain.changes.copy()
    changes[k, 1:] = middle - half, middle + half
    return replace(chain, changes=changes)


def held(around: Surroundings, chain: Chain) -> Mask:
    """Return which parameters (p,) are not fitted: the radius, if that is given."""
    fixed = np.zeros(chain.n_parameters, bool)
    fixed[chain.sizes] = around.radius_is_given
    return fixed


def fitted(around: Surroundings, chain: Chain, points: Array, loss_scale: float) -> Chain:
    """Return the chain of least distance from points; as it is where it would fold up."""
    found = solve(chain, points, fixed=held(around, chain), loss_scale=loss_scale, tolerance=TOLERANCE)
    short = found.are_short.any() and not chain.are_short.any()
    folds = short or (dot(found.directions, chain.directions) < 0.5).any()
    return chain if folds or (found.angles > np.maximum(MOST_ANGLE, chain.angles)).any() else found


def covariance_of(chain: Chain, points: Array, loss_scale: float, fixed: Mask) -> Array:
    """Return the covariance (p, p) of a chain's parameters, fitted with a loss, whatever the noise is (Huber 1967)."""
    distance = chain.distance(points)
    less = 1 / (1 + (distance / loss_scale) ** 2)
    slope = less**2 - 4 * (distance / loss_scale) ** 2 * less**3
    bread, filling = (chain.normal_equations(points, weights)[0] for weights in (slope, (distance * less**2) ** 2))
    free = _free_motions(chain, fixed | (np.diagonal(filling) == 0))
    inverse: Array = free @ np.linalg.pinv(free.T @ bread @ free, hermitian=True) @ free.T
    return inverse @ filling @ inverse


def _free_motions(chain: Chain, fixed: Mask) -> Array:
    """Return an orthonormal basis (p, f) of motions but for fixed parameters, and the angles of bends that just end."""
    units = 1e-5 * chain.radii.min() * np.eye(len(fixed))
    rows = [*units[fixed]]
    for end, just in zip((0, -1), chain.ends_in_bends, strict=True):
        if just:
            rows.append(np.array([chain.moved(e).angles[end] - chain.moved(-e).angles[end] for e in units]))
    return null_space(np.array(rows)) if rows else np.eye(len(fixed))


def simplified(around: Surroundings, chain: Chain) -> Chain:
    """Return the chain without corners that its points do not ask for: slight ones, and where two bends are one."""
    k, own = 0, None
    while k < len(chain.bend_radii):
        fewer = next(filter(None, (merge(chain, k) for merge in (_without_corner, _with_one_bend))), None)
        if fewer is None or fewer.closed != chain.closed:
            k += 1
            continue
        own = own or _fitted_to_near(around, chain)
        better = cheaper(around, chain, fewer, SUPERFLUOUS, own)
        chain, k, own = (chain, k + 1, own) if better is chain else (better, max(k - 2, 0), None)
    return chain


def cheaper(around: Surroundings, chain: Chain, other: Chain, price: float, own: Near | None = None) -> Chain:
    """Return a second chain, fitted again, if it costs less than the first and a price by Schwarz' criterion."""
    points, first = own or _fitted_to_near(around, chain)
    scale = LOOSE * around.radius / WITHIN
    moved = first, fitted(around, other, points, scale)
    one, two = (each.distance(points) ** 2 for each in moved)
    costs = [float((square / (1 + square / scale**2)).sum()) for square in (one, two)]
    apart = np.abs(one - two)
    count = max(apart.sum() ** 2 / (apart**2).sum(), np.e) if apart.any() else np.e  # a parameter costs some point
    return moved[1] if len(points) * np.log(costs[1] / costs[0]) < price * np.log(count) else chain


def _fitted_to_near(around: Surroundings, chain: Chain) -> Near:
    """Return the points near a chain, and the chain fitted to them."""
    points = around.points[near_surface(around, chain, BAND * around.radius)]
    return points, fitted(around, chain, points, LOOSE * around.radius / WITHIN)


def _without_corner(chain: Chain, i: int) -> Chain | None:
    """Return a chain without corner i, if that turns slightly."""
    if chain.angles[i] > SLIGHT:
        return None
    corners, bends = np.delete(chain.corners, i + 1, axis=0), np.delete(chain.bend_radii, i)
    return replace(chain, corners=corners, bend_radii=bends).fitting()


def _with_one_bend(chain: Chain, i: int) -> Chain | None:
    """Return a chain with one bend instead of corners i and i + 1, if they are near and the axes beside them meet."""
    if i + 1 >= len(chain.bend_radii) or np.diff(chain.limits[i + 1])[0] > 2 * SHORT * chain.radii.max():
        return None
    u, v = chain.directions[i], chain.directions[i + 2]
    if norm(cross(u, v)) < SLIGHT:
        return None
    ahead, behind, apart, across = between_axes(chain.corners[i + 1], u, chain.corners[i + 2], v)
    if abs(apart) > LOOSE * chain.radii.max() or min(ahead, behind) < 0:
        return None
    corners = np.delete(chain.corners, i + 2, axis=0)
    corners[i + 1] = chain.corners[i + 1] + ahead * u + apart / 2 * across
    bends = np.delete(chain.bend_radii, i + 1)
    bends[i] = chain.bend_radii[i : i + 2].max()
    return replace(chain, corners=corners, bend_radii=bends).fitting()
