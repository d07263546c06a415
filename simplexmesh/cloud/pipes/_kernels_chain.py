"""Feet of points on the axis of a chain, and normal equations of their distances. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import FAST, LEAN, njit
from simplexmesh._base.arrays import Array
from simplexmesh.numerics._kernels_vectors import cross_product, difference, dot, minus, norm, plus, row

jit = njit(cache=True, error_model="numpy", fastmath=FAST)
lean = njit(**LEAN, fastmath=FAST)

WIDTH = 14
"""Parameters that a distance depends on, at most, without offsets: three corners, a bend radius, two radii, the ends of
a change."""


LEAST_ANGLE = 1e-4
"""Of a corner with a bend, in radians: below it the direction of the bend's plane is lost to rounding."""


class Axis(NamedTuple):
    """A chain as kernels read it: the attributes of `Chain`, lengths to divide by, and cosines and sines of angles."""

    corners: Array
    directions: Array
    lengths: Array
    spans: Array
    limits: Array
    stations: Array
    centers: Array
    outward: Array
    angles: Array
    turns: Array
    reaches: Array
    bend_radii: Array
    radii: Array
    changes: Array
    offsets: Array


@jit
def axis_of(corners, bend_radii, radii, changes, offsets):
    """Return the axis of a chain."""
    n = len(corners) - 1
    directions, lengths, limits, stations = np.zeros((n, 3)), np.zeros(n), np.zeros((n, 2)), np.zeros(2 * n)
    centers, outward, turns = np.zeros((n - 1, 3)), np.zeros((n - 1, 3)), np.zeros((n - 1, 2))
    angles, reaches = np.zeros(n - 1), np.zeros(n - 1)
    for j in range(n):
        along = difference(corners, j + 1, j)
        for k in range(len(changes)):
            if changes[k, 0] == j:
                along = minus(along, row(offsets, k))
        lengths[j] = limits[j, 1] = norm(along)
        if lengths[j] > 0:
            for a in range(3):
                directions[j, a] = along[a] / lengths[j]
    for i in range(n - 1):
        before, after, radius = row(directions, i), row(directions, i + 1), bend_radii[i]
        cosine = dot(before, after)
        angles[i] = math.atan2(norm(cross_product(before, after)), cosine)
        turns[i, 0], turns[i, 1] = math.cos(angles[i]), math.sin(angles[i])
        reaches[i] = radius * math.tan(angles[i] / 2) if angles[i] > LEAST_ANGLE else 0.0
        limits[i, 1] -= reaches[i]
        limits[i + 1, 0] = reaches[i]
        out = plus((cosine * before[0], cosine * before[1], cosine * before[2]), after, -1.0)
        far = max(norm(out), 1e-300)
        for a in range(3):
            outward[i, a] = out[a] / far
            centers[i, a] = corners[i + 1, a] + radius / max(turns[i, 1], LEAST_ANGLE) * (after[a] - before[a])
    for j in range(n):
        stations[2 * j + 1] = stations[2 * j] + limits[j, 1] - limits[j, 0]
        if j < n - 1:
            stations[2 * j + 2] = stations[2 * j + 1] + bend_radii[j] * angles[j]
    spans = np.maximum(lengths, 1e-9 * radii.min())
    inner = centers, outward, angles, turns, reaches
    return Axis(corners, directions, lengths, spans, limits, stations, *inner, bend_radii, radii, changes, offsets)


@lean
def beside(axis, place, j, height):
    """Return a place less the offset of the axis of straight j from its first corner to a height."""
    for k in range(len(axis.changes)):
        if axis.changes[k, 0] == j:
            share = (height - axis.changes[k, 1]) / (axis.changes[k, 2] - axis.changes[k, 1])
            place = plus(place, row(axis.offsets, k), -min(max(share, 0.0), 1.0))
    return place


@lean
def on_straight(axis, place, j, height):
    """Return the height of a place's foot on straight j: between its ends, or on up to the planes of its miters."""
    for i, way in ((j, 1.0), (j - 1, -1.0)):
        if 0 <= i < len(axis.bend_radii) and axis.bend_radii[i] == 0:
            away = minus(place, row(axis.corners, i + 1))
            past = dot(away, row(axis.directions, i)) + dot(away, row(axis.directions, i + 1))
            if way * past <= 0 and way * height > way * axis.limits[j, 1 if way > 0 else 0]:
                return height
    return min(max(height, axis.limits[j, 0]), axis.limits[j, 1])


@lean
def nearest(axis, place):
    """Return the piece on whose axis a place has its foot, and the height or the angle there; straight on at the ends.

    Bends count where they are met at right angles: their ends are those of straights, which go on up to miters.
    """
    piece, along, least, last = 0, 0.0, math.inf, len(axis.directions) - 1
    for j in range(last + 1):
        away = minus(place, row(axis.corners, j))
        height = dot(away, row(axis.directions, j))
        away = beside(axis, away, j, height)
        on = on_straight(axis, place, j, height)
        square = dot(away, away) - height * height + (height - on) ** 2
        if square < least:
            outside = (j == 0 and height < on) or (j == last and height > on)
            piece, along, least = 2 * j, height if outside else on, square
    for i in range(last):
        arm = minus(place, row(axis.centers, i))
        a, b = dot(arm, row(axis.outward, i)), dot(arm, row(axis.directions, i))
        if axis.bend_radii[i] > 0 and b > 0 and a * axis.turns[i, 1] > b * axis.turns[i, 0]:
            far = math.sqrt(a * a + b * b)
            square = dot(arm, arm) - far * far + (far - axis.bend_radii[i]) ** 2
            if square < least:
                piece, along, least = 2 * i + 1, math.atan2(b, a), square
    return piece, along


@lean
def foot_of(axis, piece, along):
    """Return the place on the axis at a height on a straight, or at an angle in a bend."""
    j = piece // 2
    if piece % 2 == 0:
        return plus(row(axis.corners, j), row(axis.directions, j), along)
    out = plus(row(axis.centers, j), row(axis.outward, j), axis.bend_radii[j] * math.cos(along))
    return plus(out, row(axis.directions, j), axis.bend_radii[j] * math.sin(along))


@lean
def blend(axis, piece, along):
    """Return the change of radius behind which, or in which, a foot is, and how far it is through that, 0 to 1."""
    change, share = -1, 1.0
    for k in range(len(axis.changes)):
        j, low, high = axis.changes[k, 0], axis.changes[k, 1], axis.changes[k, 2]
        if j < piece // 2 or (j == piece // 2 and (piece % 2 == 1 or along >= high)):
            change = k
        elif j == piece // 2 and along > low:
            return k, (along - low) / (high - low)
    return change, share


@lean
def surface_at(axis, place):
    """Return piece, height or angle, change and share, radius, slope, distance, and the outward direction of a place.

    The direction is that across the axis, and the slope that of the surface there, which differs around an axis with an
    offset: to first order in the distance from it.
    """
    piece, along = nearest(axis, place)
    change, share = blend(axis, piece, along)
    radius, slope = axis.radii[change + 1], 0.0
    away = minus(place, foot_of(axis, piece, along))
    if piece % 2 == 0:
        away = beside(axis, away, piece // 2, along)
    far = norm(away)
    some = max(far, 1e-300)
    out = away[0] / some, away[1] / some, away[2] / some
    if share < 1.0:
        step = axis.radii[change + 1] - axis.radii[change]
        radius = axis.radii[change] + share * step
        slope = (step + dot(out, row(axis.offsets, change))) / (axis.changes[change, 2] - axis.changes[change, 1])
    return piece, along, change, share, radius, slope, (far - radius) / math.sqrt(1.0 + slope * slope), out


@jit
def fill_feet(axis, points, pieces, alongs, stations, radii, distances, normals):
    """Fill what `Feet` holds."""
    for k in range(len(points)):
        piece, along, _, _, radius, slope, distance, out = surface_at(axis, row(points, k))
        pieces[k], alongs[k], radii[k], distances[k] = piece, along, radius, distance
        j, flat = piece // 2, 1.0 / math.sqrt(1.0 + slope * slope)
        after = along - axis.limits[j, 0] if piece % 2 == 0 else along * axis.bend_radii[j]
        stations[k] = axis.stations[piece] + after
        for a in range(3):
            normals[k, a] = flat * (out[a] - slope * axis.directions[j, a])


@lean
def fill_row(axis, place, columns, values):
    """Fill the parameters on which the distance of a place depends, and its derivatives; return count and distance.

    Columns are those of all coordinates of corners, then of bend radii, radii, low and high ends of changes, and of all
    coordinates of offsets.
    """
    piece, along, change, share, _, slope, distance, out = surface_at(axis, place)
    j, flat = piece // 2, 1.0 / math.sqrt(1.0 + slope * slope)
    bends = 3 * len(axis.corners)
    sizes = bends + len(axis.bend_radii)
    ends = sizes + len(axis.radii)
    if piece % 2 == 0:
        far = plus(minus(place, row(axis.corners, j)), row(axis.directions, j), -along)
        count = fill_straight(axis, j, along, slope, far, out, columns, values)
    else:
        count = fill_bend(axis, j, along, out, columns, values)
        columns[count] = bends + j
        count += 1
    if share < 1.0:
        length = axis.changes[change, 2] - axis.changes[change, 1]
        steeper = distance * flat * flat * slope / length
        columns[count], values[count] = sizes + change, steeper - (1 - share) * flat
        columns[count + 1], values[count + 1] = sizes + change + 1, -steeper - share * flat
        columns[count + 2], values[count + 2] = ends + 2 * change, slope * ((1 - share) * flat - steeper)
        columns[count + 3], values[count + 3] = ends + 2 * change + 1, slope * (share * flat + steeper)
        count += 4
    else:
        columns[count], values[count] = sizes + change + 1, -1.0
        count += 1
    out = flat * out[0], flat * out[1], flat * out[2]
    return fill_offsets(axis, piece, along, out, ends + 2 * len(axis.changes), count, columns, values), distance


@lean
def fill_straight(axis, j, along, slope, away, out, columns, values):
    """Fill the derivatives by the two corners of a straight; where the radius changes heights count too."""
    flat = 1.0 / math.sqrt(1.0 + slope * slope)
    for a in range(3):
        columns[a], columns[3 + a] = 3 * j + a, 3 * j + 3 + a
        turned = -flat * (along * out[a] + slope * away[a]) / axis.spans[j]
        values[a] = flat * (slope * axis.directions[j, a] - out[a]) - turned
        values[3 + a] = turned
    return 6


@lean
def fill_offsets(axis, piece, along, out, first, count, columns, values):
    """Add the derivatives by the offsets on the segments of a piece, which turn those and move what is behind them."""
    for k in range(len(axis.changes)):
        segment = axis.changes[k, 0]
        if segment < piece // 2 or segment > (piece + 1) // 2:
            continue
        share = (along - axis.changes[k, 1]) / (axis.changes[k, 2] - axis.changes[k, 1])
        share = min(max(share, 0.0), 1.0)
        for a in range(3):
            columns[count] = first + 3 * k + a
            if piece % 2 == 0:
                values[count] = -values[3 + a] - share * out[a]
            else:
                values[count] = values[a] if segment == piece // 2 else -values[6 + a]
            count += 1
    return count


@lean
def fill_bend(axis, i, turn, away, columns, values):
    """Fill the derivatives by the three corners of a bend, of whose segments a point has parts, and by its radius."""
    before, after = row(axis.directions, i), row(axis.directions, i + 1)
    radius, cos, sin = axis.bend_radii[i], axis.turns[i, 0], axis.turns[i, 1]
    rest = 1.0 - math.cos(turn)
    first, second = ((1.0 - rest) * cos - 1.0) / sin + math.sin(turn), rest / sin
    on_before, on_after = dot(away, before), dot(away, after)
    by_angle = radius * ((cos - 1.0 + rest) * on_before - rest * cos * on_after) / sin**3
    # parts along a segment do not turn it
    along_before, along_after = radius * first * on_before - by_angle * cos, radius * second * on_after - by_angle * cos
    for a in range(3):
        columns[a], columns[3 + a], columns[6 + a] = 3 * i + a, 3 * i + 3 + a, 3 * i + 6 + a
        one = (radius * first * away[a] - by_angle * after[a] - along_before * before[a]) / axis.spans[i]
        other = (radius * second * away[a] - by_angle * before[a] - along_after * after[a]) / axis.spans[i + 1]
        values[a], values[3 + a], values[6 + a] = one, other - one - away[a], -other
    values[9] = -(first * on_before + second * on_after)
    return 9


@jit
def normal_equations(axis, points, weights, loss_scale, matrix, downhill):
    """Add to the normal matrix (q, q), its lower half, and the downhill vector (q,) of all columns; return the cost."""
    width = WIDTH + axis.offsets.size
    columns, values = np.zeros(width, np.int64), np.zeros(width)
    cost = 0.0
    for k in range(len(points)):
        count, distance = fill_row(axis, row(points, k), columns, values)
        weight = weights[k] if len(weights) else 1.0
        square = distance * distance
        less = 1.0 / (1.0 + square / (loss_scale * loss_scale))
        cost += weight * square * less
        weight *= less * less
        for a in range(count):
            part = weight * values[a]
            downhill[columns[a]] -= part * distance
            for b in range(a + 1):
                matrix[columns[a], columns[b]] += part * values[b]
    return cost
