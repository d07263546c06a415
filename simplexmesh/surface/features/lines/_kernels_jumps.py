"""Jumps of the normal across edges: the normals on both sides, extrapolated to the edge. Arrays in, arrays filled."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array, Mask
from simplexmesh.mesh.triangles._kernels_half_edges import following
from simplexmesh.numerics._kernels_vectors import cross_product, difference, dot, minus, plus, row, unit

REACH = 3.0
"""Radius of the window on one side of an edge, over the distance of the nearest triangles' centers."""

MARGIN = 0.7
"""Of a mesh's edge, by which windows are wider for the sake of those triangles."""

WIDE = 13.0
"""Least radius over the root of noise times edge, where a jump is known as well whatever the noise."""

FARTHEST = 2.3
"""Distance of a crease from its edge, over the root of the area of the smaller triangle; 1.5 edges if equilateral."""

MOST = 4000
"""Triangles of a window: of crumpled surfaces, all would be in each."""

FLAT = 0.05
"""In radians: filtered normals that differ by less do not tell one side from the other."""


class Sides(NamedTuple):
    """What the windows beside edges need to know of each triangle, and how far they go."""

    normals: Array
    """(t, 3), filtered."""

    weights: Array
    """(t,), lower where it touches a candidate: such triangles may straddle the crease."""

    exact: Mask
    """(t,): whether its normal is that of its surface."""

    stops: Mask
    """(3t,): half-edges that no window crosses."""


@njit(cache=True, error_model="numpy")
def _beside(place, start, along):
    """Return the distance of a place from the segment that begins at `start`, and what share of it is before that."""
    apart = minus(place, start)
    share = dot(apart, along) / max(dot(along, along), 1e-300)
    apart = plus(apart, along, -min(1.0, max(0.0, share)))
    return math.sqrt(dot(apart, apart)), share


@njit(cache=True, error_model="numpy")
def _radius(facets, sides, half, start, along):
    """Return the radius of the window on the side of a half-edge."""
    t, scale = half // 3, facets.scales[half // 3]
    radius = _beside(row(facets.centers, t), start, along)[0]
    for h in range(3 * t, 3 * t + 3):
        if h != half and facets.mates[h] >= 0 and not sides.stops[h]:
            radius = max(radius, _beside(row(facets.centers, facets.mates[h] // 3), start, along)[0])
    radius = max(REACH * radius, WIDE * math.sqrt(facets.noise[t] * scale))
    return radius if sides.exact[t] else radius + MARGIN * scale


@njit(cache=True, error_model="numpy")
def _rise(aside, up):
    """Return by how much more a surface rises, for the way along the crease, to the triangle's cross-section there.

    The surface is round along the crease; `aside` and `up` are components of the triangle's normal.
    """
    level = math.sqrt(max(1 - aside * aside, 0.0))
    return aside * level / ((1 + level) * max(up, 0.3))


@njit(cache=True, error_model="numpy")
def _side(facets, sides, half, frame, stamp, queue):
    """Return the sine of the normal's angle at the edge, the surface's height and steepness, its distance, and bending.

    The `frame` is the edge's middle, the directions along and across the crease, and the mean normal. Over the window,
    triangles connected to that of the half-edge with normals nearer to its own than to the one across, the sine is a
    straight line, as it is exactly on cylinders. Where normals are exact, only triangles right beside the edge count.
    """
    middle, course, across, mean = frame
    start = row(facets.vertices, facets.faces[half // 3, half % 3])
    along = minus(row(facets.vertices, facets.faces[half // 3, following(half) % 3]), start)
    first, opposite = half // 3, facets.mates[half] // 3
    bend = difference(sides.normals, first, opposite)
    if dot(bend, bend) < FLAT * FLAT:
        bend = 0.0, 0.0, 0.0
    inner = dot(minus(row(facets.centers, first), middle), across)
    radius = _radius(facets, sides, half, start, along)
    head, tail = 0, 1
    total = my = myy = ms = mys = mz = lengths = 0.0
    queue[0], stamp[first] = first, half
    while head < min(tail, MOST):
        t = queue[head]
        place = row(facets.centers, t)
        far, share = _beside(place, start, along)
        aside = sides.exact[first] and abs(share - 0.5) > 1
        head += 1
        if t != first and (far > radius or aside or dot(row(sides.normals, t), bend) < 0):
            continue
        turned = minus(row(facets.normals, t), row(sides.normals, t))
        doubt = dot(turned, turned) / (0.1 + 2.5 * math.sqrt(facets.variances[t])) ** 2
        weight = facets.areas[t] * sides.weights[t] * max(1 - (far / radius) ** 2, 0.05) / (1 + doubt)
        smooth, apart = row(sides.normals, t), minus(place, middle)
        y, z = dot(apart, across) / radius, dot(apart, mean) / radius
        z += dot(apart, course) / radius * _rise(dot(smooth, course), dot(smooth, mean))
        if bend[0] == bend[1] == bend[2] == 0.0 and y * inner < 0:
            continue
        sine = dot(row(facets.normals, t), across)
        lengths += weight * dot(row(facets.normals, t), smooth)
        total, my, myy, mz = total + weight, my + weight * y, myy + weight * y * y, mz + weight * z
        ms, mys = ms + weight * sine, mys + weight * y * sine
        for h in range(3 * t, 3 * t + 3):
            other = facets.mates[h] // 3
            if h != half and facets.mates[h] >= 0 and not sides.stops[h] and stamp[other] != half:
                stamp[other], queue[tail] = half, other
                tail += 1
    total = max(total, 1e-300)
    shorter = max(lengths, 0.5 * total)  # the mean of normals with noise is no unit vector
    my, myy, ms, mys, mz = my / total, myy / total, ms / shorter, mys / shorter, mz / total
    spread = max(myy - my * my, 0.0) + 1e-6
    slope = (mys - my * ms) / spread
    sine = min(0.999, max(-0.999, ms - my * slope))
    level = min(0.999, max(-0.999, ms))
    steep = -level / math.sqrt(1 - level * level)
    return sine, (radius * (mz - steep * my), steep), radius * my, slope / radius


@njit(cache=True, error_model="numpy")
def _meeting(one, two, farthest):
    """Return where along the direction across two lines meet, and their height there; the middle if that is far off."""
    steep = one[1] - two[1]
    y = (two[0] - one[0]) / steep if abs(steep) > 0.05 else 0.0
    if abs(y) > farthest:
        y = 0.0
    return y, 0.5 * (one[0] + two[0] + (one[1] + two[1]) * y)


@njit(cache=True, error_model="numpy")
def fill_jumps(facets, sides, edges, jumps, places, directions, bendings):
    """Fill the angles (e,) by which the normal jumps at half-edges, and where the sides meet.

    A jump is negative where the sides, extrapolated, bend against what the filtered normals show. `places` (e, 3) are
    points of the crease, next to the middle of the edge unless its triangles are exact, `directions` (e, 3) its course,
    with the triangle of the half-edge on the left. `bendings` (e,) are how much both sides bend across, per length,
    positive in the sense of the jump.
    """
    stamp = np.full(len(facets.faces), -1, np.int64)
    queue = np.empty(len(facets.faces) + 1, np.int64)
    for i in range(len(edges)):
        half, mate = edges[i], facets.mates[edges[i]]
        start = row(facets.vertices, facets.faces[half // 3, half % 3])
        along = minus(row(facets.vertices, facets.faces[half // 3, following(half) % 3]), start)
        one, two = row(sides.normals, half // 3), row(sides.normals, mate // 3)
        course = cross_product(one, two)
        exact = sides.exact[half // 3] and sides.exact[mate // 3]
        if exact or dot(course, course) < 0.0025:
            sense = 1.0 if dot(course, along) >= 0 else -1.0
            course = sense * along[0], sense * along[1], sense * along[2]
        course, mean = unit(course), unit(plus(one, two, 1.0))
        across = unit(cross_product(course, mean))
        frame = plus(start, along, 0.5), course, across, mean
        near, low, left, one_bending = _side(facets, sides, half, frame, stamp, queue)
        far, high, right, other_bending = _side(facets, sides, mate, frame, stamp, queue)
        bendings[i] = one_bending + other_bending
        if left > right:
            course, bendings[i] = (-course[0], -course[1], -course[2]), -bendings[i]
        jumps[i] = math.asin(far) - math.asin(near)
        farthest = FARTHEST * math.sqrt(min(facets.areas[half // 3], facets.areas[mate // 3]))
        y, z = (0.0, 0.0) if exact else _meeting(low, high, farthest)
        place = plus(plus(frame[0], across, y), mean, z)
        for axis in range(3):
            places[i, axis], directions[i, axis] = place[axis], course[axis]
