"""Following a pipe both ways from a picked point."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import norm
from simplexmesh.cloud.fitting import starts
from simplexmesh.cloud.fitting.refine import WITHIN, steady
from simplexmesh.cloud.fitting.selection import DECISIVE
from simplexmesh.cloud.given_cloud import given_cloud
from simplexmesh.cloud.pipes.chain import Chain
from simplexmesh.cloud.pipes.diameters import is_joint, joined, next_pipe
from simplexmesh.cloud.pipes.elements import elements_of
from simplexmesh.cloud.pipes.ends import (
    are_corners,
    mitered,
    reversed_chain,
    with_ends,
    with_stops,
    without_bends,
    without_last_bend,
)
from simplexmesh.cloud.pipes.line import PipeLine
from simplexmesh.cloud.pipes.refining import covariance_of, held, near_surface, off_axis, refined, simplified
from simplexmesh.cloud.pipes.tolerances import BAND, NEAR, SHORT
from simplexmesh.cloud.pipes.tracing.segmenting import segmented
from simplexmesh.cloud.pipes.tracing.start import Beginning, beginning
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings
from simplexmesh.cloud.pipes.tracing.tracking import JUMP, Track
from simplexmesh.cloud.validation.selection import bic
from simplexmesh.cloud.validation.validation import MOST_POINTS
from simplexmesh.numerics import scan_lines

MOST_CHANGES = 10
"""Of the radius towards one end of a line."""


def follow_pipe(
    cloud: Any, pick: ArrayLike, *, radius: float | tuple[float, float] | None = None, gap: float = JUMP
) -> PipeLine:
    """Follow a pipe both ways from a picked point, through its bends and over shadows.

    Of the cylinders through the pick and pairs of the 100 points around it, or 200 or 400, that which most of these are
    on, whatever else is beside it, is fitted again. With its radius, points moved inward along their normals lie on the
    axis, of straights and bends alike: the axis is traced through them, then cut into straights and the bends that join
    them, and all elements are fitted together as one surface, whose straights and bends are tangent by construction.

    Parameters
    ----------
    cloud : PointCloud, (n, 3) array, or path
        Points on the pipe and on what is around it.
    pick : (3,) array of float
        A point on a straight part of the pipe, or near one of its points.
    radius : float or (float, float), optional
        The radius of the pipe, if it is known, or its least and greatest.
    gap : float
        Longest shadow to jump over, in radii of the pipe; 0 for none. Pipes of other diameters, as behind reducers, are
        looked for within eight radii of an end, whatever it is.

    Returns
    -------
    PipeLine
        The elements in order, and the element of each point of the cloud.

    Raises
    ------
    ValueError
        No points near the pick, or no cylinder there, or a ball.

    References
    ----------
    T. Chaperon, thesis, Ecole des Mines de Paris, 2002, sections 3.2, 3.3 and 6.1.2.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> turn, height = np.random.default_rng(0).uniform([0, 0], [2 * np.pi, 12], (6000, 2)).T
    >>> line = sm.follow_pipe(np.stack([np.cos(turn), np.sin(turn), height], axis=1), pick=(1, 0, 6))
    >>> [element.kind for element in line.elements]
    ['straight']
    """
    data = given_cloud(cloud)
    place = checks.array("pick", pick, (3,))
    limits = radius_limits(radius)
    reach = checks.number("gap", gap, 0.0)
    origin = data.bounds.mean(axis=0)
    points = data.points - origin
    tree = cKDTree(points, balanced_tree=False, compact_nodes=False)
    start = beginning(scan_lines.even(tree).tree, place - origin, limits, reach)
    line = line_of(tree, origin, *followed(start))
    refuse_ball(line, data.points[line.labels >= 0])
    return replace(with_stops(line, tree, origin), unit=data.unit)


def radius_limits(radius: float | tuple[float, float] | None) -> tuple[float, float]:
    """Return the least and greatest radius that an argument allows."""
    if radius is None:
        return 0.0, np.inf
    if np.ndim(radius) == 0:
        known = checks.number("radius", radius, 0.0, open_low=True)
        return known, known
    low, high = checks.array("radius", radius, (2,))
    if not 0 <= low < high:
        raise ValueError(f"radius must be a number, or a least and a greater one, not {low:g} and {high:g}")
    return float(low), float(high)


def refuse_ball(line: PipeLine, points: Array) -> None:
    """Refuse a line whose points are as well on a sphere, which has fewer parameters."""
    points = points[:: max(len(points) // MOST_POINTS, 1)]
    ball = starts.start("sphere", points) if len(points) else None
    if ball is None:
        return
    ball, count = steady(ball, points, None), len(points)  # robust, as what it lies on is near it too
    one, other = (
        bic(each.normal_equations(points, loss_scale=line.rms)[2], count, each.n_parameters)
        for each in (ball, line.chain)
    )
    if one <= other + DECISIVE:
        raise ValueError(f"pick must be on a pipe, but the points there are on a ball of radius {ball._shape[0]:.4g}")


def followed(found: Beginning) -> tuple[Chain, Array, float, tuple[str, str]]:
    """Return the refined chain from a beginning, the covariance of its parameters, the noise, and why it ends."""
    around, gap = found.around, found.gap
    chain, stops = run(found)
    if not around.radius_is_given and not chain.closed:
        for _ in range(2):  # towards the end, then towards the start
            chain, stops = extended(around, chain, stops, gap)
            chain, stops = reversed_chain(chain), stops[::-1]
    near = beside(around, chain, gap)
    chain, deviation = refined(near, chain)
    eccentric = off_axis(near, chain, deviation)
    chain, deviation = (chain, deviation) if eccentric is chain else refined(near, eccentric)
    if chain.closed:
        ended = chain.begun(chain.reaches[-1] / norm(chain.corners[1] - chain.corners[-2]))
    else:
        ended = with_ends(near, chain, deviation, gap, bends=True)
    if len(ended.bend_radii) != len(chain.bend_radii):
        ended, deviation = refined(near, ended)
        ended = with_ends(near, ended, deviation, gap)
    if not ended.closed and ended.are_tight.any():
        ended = mitered(near, ended, deviation)
        corners = are_corners(near, ended, deviation)
        ended, deviation = refined(near, without_bends(ended, corners, found.point))
        ended = with_ends(near, ended, deviation, gap)
    points = near.points[near_surface(near, ended, max(BAND * around.radius / 3, 3 * deviation))]
    return ended, covariance_of(ended, points, WITHIN * deviation, held(near, ended)), deviation, stops


def run(found: Beginning) -> tuple[Chain, tuple[str, str]]:
    """Return the chain of one radius from a beginning, and why it ends."""
    track, gap = found.track, found.gap
    chain = segmented(track, found.around.radius)
    if track.closed:
        chain = closed(track, chain)
    around = beside(found.around, chain, gap)
    chain, deviation = refined(around, chain)
    chain = simplified(around, chain)
    stops, r = (track.stops[0], track.stops[1]), around.radius
    if chain.closed:
        return chain, stops
    length, chain = chain.stations[-1], with_ends(around, chain, deviation, gap)
    while chain.stations[-1] > length + SHORT * r:  # fitted again before it goes on
        length, around = chain.stations[-1], beside(found.around, chain, max(gap, chain.stations[-1] / r))
        chain, deviation = refined(around, chain)
        chain = with_ends(around, chain, deviation, gap)
    return chain, stops


def closed(track: Track, chain: Chain) -> Chain:
    """Return the closed chain of a closed track, begun in the middle of the longest straight of its open one."""
    straights = np.diff(chain.limits, axis=1)[:, 0]
    k = int(straights.argmax())
    middle = chain.corners[k] + chain.limits[k].mean() * chain.directions[k]
    chain = segmented(track.begun(int(norm(track.points - middle).argmin())), float(chain.radii[0]))
    return replace(chain, corners=np.append(chain.corners[:-1], chain.corners[:1], axis=0)).fitting()


def beside(around: Surroundings, chain: Chain, gap: float) -> Surroundings:
    """Return what is around a chain, and behind its ends as far as shadows are jumped over."""
    r = float(chain.radii.max())
    past = min((gap + NEAR) * r, around.size)
    return around.cropped(chain.at(np.arange(-past, chain.stations[-1] + past, r))[0], NEAR * r)


def extended(around: Surroundings, chain: Chain, stops: tuple[str, str], gap: float) -> tuple[Chain, tuple[str, str]]:
    """Return a chain and what goes on behind its end with other radii, on its axis or a parallel one."""
    for _ in range(MOST_CHANGES):
        radius = float(chain.radii[-1])
        there = around if abs(radius / around.radius - 1) < 0.1 else around.of(radius)
        longer = _longer(there, chain, gap)
        if longer is None:
            break
        chain, stops = longer[0], (stops[0], longer[1])
    return chain, stops


def _longer(around: Surroundings, chain: Chain, gap: float) -> tuple[Chain, str] | None:
    """Return a chain with the pipe behind a reducer at its end, if there is one, and why that ends."""
    for one in filter(None, (chain, without_last_bend(chain))):  # a bend may be what the reducer looks like
        along = one.directions[-1]
        found = next_pipe(around, one.corners[-1], along)
        if found is None:
            continue
        radius, start = found
        ahead = around.points[(around.points - start) @ along > 0]
        with suppress(ValueError):
            beyond = Surroundings(ahead, radius, noise=around.noise)
            more, ends = run(Beginning(beyond, start + radius * along, along, gap))
            longer = joined(one, more)
            if longer is None:
                continue
            k = len(one.changes)
            if not longer.eccentric[k]:
                return longer, ends[1]
            near, between = beside(around, longer, gap), longer.changes[k, 1:]
            longer, deviation = refined(near, longer)
            if is_joint(near, longer, deviation, k, between):
                return longer, ends[1]
    return None


def line_of(
    tree: cKDTree, origin: Array, chain: Chain, covariance: Array, deviation: float, stops: tuple[str, str]
) -> PipeLine:
    """Return the line of a chain with its points of the cloud, which is moved back to its place."""
    points = np.asarray(tree.data)
    at, distance = on_line(chain, tree, WITHIN * deviation)
    elements, owner = elements_of(chain, points[at], covariance, origin)
    if not elements:
        raise ValueError("pick must be on a pipe, but that which is there has no length")
    labels = np.full(len(points), -1)
    labels[at] = owner
    rms = float(np.sqrt((distance**2).mean())) if len(at) else float("nan")
    placed = replace(chain, corners=chain.corners + origin)
    return PipeLine(elements, checks.frozen(labels), rms, stops, placed)


def on_line(chain: Chain, tree: cKDTree, band: float) -> tuple[Indices, Array]:
    """Return which points of the cloud are within a distance of a chain, and between its ends, and their distances."""
    r = float(chain.radii.max())
    places = chain.at(np.arange(0, chain.stations[-1] + r, r))[0]
    near = np.zeros(tree.n, bool)
    for found in tree.query_ball_point(places, 1.2 * r + band):
        near[found] = True
    at = np.flatnonzero(near)
    feet = chain.feet(np.asarray(tree.data)[at])
    fine = (feet.station >= 0) & (feet.station <= chain.stations[-1]) & (np.abs(feet.distance) < band)
    return at[fine], feet.distance[fine]
