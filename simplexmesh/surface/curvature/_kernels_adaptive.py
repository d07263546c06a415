"""The adaptive estimator: what probes say of noise and detail, and the fit with the scale and the priors found."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import get_num_threads, prange

from simplexmesh._kernels_both import PARALLEL_FROM, Both
from simplexmesh.surface.curvature._kernels_adaptive_answers import finished, judged, mixed
from simplexmesh.surface.curvature._kernels_adaptive_jets import (
    HIGHEST,
    MOST,
    TERMS,
    factored,
    flattened,
    framed,
    gathered,
    influence,
    jit,
    leaning,
    mean_direction,
    normal_equations,
    seen,
    shortened,
    solved,
)
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

BLOCKS = HIGHEST - 2
"""The degrees 3 to 6, whose coefficients have priors."""

STEPS = 5
"""How many fits are tried: shorter ones where one does not follow the points, wider ones where there is none."""

WIDER = 1.5
"""A ball of too few points, or of points on a conic, is made wider by this, twice at most."""

SHORTER = math.sqrt(0.5)
"""From one scale to the next."""

HARM = 4.0
"""Residuals of size r that are not noise, in a ball of radius R, put H wrong by HARM r / R^2 (measured on tori)."""

SPARE, UNTOLD = 3, 0.1
"""With fewer points to spare residuals tell nothing: curvature is taken to be wrong by this share."""

ROUGH = 1.6
"""Residuals are noise up to this times its variance: it is not the same everywhere."""

LEANING = 0.2
"""Neighborhoods whose mean is farther from the center, in radii, are one-sided: they lie at a border."""

REACH, FARTHER = 0.6, 1.4
"""Such neighborhoods are made larger by this times their lean, for half a ball holds half the points; and by so much
where noise leaves no more than degree 2."""

WARY = 0.65
"""There priors are narrower by this: what is odd in a polynomial cancels in a whole ball, but puts half a one wrong."""

GENTLE = 0.4
"""Where the degree is at most 3 they do this much of that: most of them is of odd degree."""

RIMS = 10.0
"""At borders they do more harm, by this times the lean."""

TOLERATED = 0.02
"""An error of this share of the curvedness is put up with."""


def chunks(rows):
    """Return into how many parts, each with a workspace, to divide so many rows."""
    return 1 if rows < PARALLEL_FROM else 4 * get_num_threads()


@jit
def workspace(most):
    """Return the arrays every fit writes to: found, places, u v z, columns, sums, matrix, y, x, w, frame."""
    places, heights = np.empty((3, most)), np.empty((3, most))
    columns, sums = np.empty((2, 2 * HIGHEST + 1, most)), np.empty(2 * TERMS * 2)
    matrix, vectors = np.zeros((TERMS, TERMS)), np.zeros((3, TERMS))
    return np.empty(most + 1, np.uint64), places, heights, columns, sums, matrix, vectors, np.zeros((3, 3))


@jit
def affordable(count, most):
    """Return the highest degree, at most `most`, that so many points determine with some to spare."""
    degree = most
    while degree > 2 and 0.65 * (degree + 1) * (degree + 2) + 4.0 > count:
        degree -= 1
    return degree


@Both
def probes(
    centers,
    offsets,
    members,
    points,
    directions,
    oriented,
    radii,
    chunks,
    levels,
    energies,
    weights,
    misfits,
    degrees,
    steps,
):
    """Fit polynomials of all degrees at all radii, and write what tells noise from detail.

    Radii of balls with more than enough points are shortened.

    Per row, radius k and degree d, in units of the radius: `levels[row, k, 0, d - 2]` the squared length of what degree
    d adds to the shape operator, `[row, k, 1, d - 2]` its variance at unit noise, `[.., 2 and 3, ..]` both for H alone;
    `energies[row, k, d - 3]` the energy |y_d|^2 of a block of degree d, `weights[row, k, d - 3, e - 3]` how much
    coefficients of degree e put into it; `misfits[row, k]` the residual sum of squares and its degrees of freedom;
    `steps[row, k, d - 2]` what degree d adds to -H, in the unit of the points.
    """
    for chunk in prange(chunks):
        stamps = np.full(points.shape[0], -1, np.int32)
        found, places, heights, columns, sums, matrix, vectors, frame = workspace(MOST)
        u, v, z, y, x, w = heights[0], heights[1], heights[2], vectors[0], vectors[1], vectors[2]
        for row in range(chunk * centers.shape[0] // chunks, (chunk + 1) * centers.shape[0] // chunks):
            center = centers[row]
            largest = radii[row, radii.shape[1] - 1]
            count = gathered(offsets, members, points, center, largest, stamps, row, found)
            largest = shortened(largest, count)
            for k in range(radii.shape[1]):
                radius = radii[row, k] = min(radii[row, k], largest)
                nx, ny, nz = mean_direction(found, 1, directions, center, oriented)
                kept = seen(found, count, points, directions, center, nx, ny, nz, oriented, radius, places)
                if kept < 7:
                    continue
                framed(nx, ny, nz, frame)
                if not flattened(places, kept, frame, u, v, z, columns, sums, matrix, y, x):
                    continue
                degree = affordable(kept, HIGHEST)
                terms = (degree + 1) * (degree + 2) // 2
                squares = normal_equations(degree, u, v, z, kept, columns, sums, matrix, y)
                if factored(matrix, y, terms) < terms:
                    continue
                degrees[row, k] = degree
                for part in range(3):
                    first = 4 if part == 2 else 3
                    second = 4 if part == 2 else 5
                    influence(matrix, terms, first, second, 0.0 if part == 2 else 1.0 - 2.0 * part, w)
                    for d in range(2, degree + 1):
                        change = variance = 0.0
                        for t in range(d * (d + 1) // 2 if d > 2 else 0, (d + 1) * (d + 2) // 2):
                            change += w[t] * y[t]
                            variance += w[t] * w[t]
                        levels[row, k, 0, d - 2] += change * change
                        levels[row, k, 1, d - 2] += variance
                        if part == 0:
                            levels[row, k, 2, d - 2] = change * change
                            levels[row, k, 3, d - 2] = variance
                            steps[row, k, d - 2] = change / radius
                for d in range(3, degree + 1):
                    for t in range(d * (d + 1) // 2, (d + 1) * (d + 2) // 2):
                        energies[row, k, d - 3] += y[t] * y[t]
                    for e in range(d, degree + 1):
                        share = 1.0
                        for i in range(e + 1):
                            r = e * (e + 1) // 2 + i
                            for t in range(d * (d + 1) // 2, min(r + 1, (d + 1) * (d + 2) // 2)):
                                weights[row, k, d - 3, e - 3] += share * matrix[r, t] * matrix[r, t]
                            share *= (e - i) / (i + 1.0)
                for t in range(terms):
                    squares -= y[t] * y[t]
                misfits[row, k, 0] = max(squares, 0.0)
                misfits[row, k, 1] = kept - terms


@Both
def adaptive_jets(
    centers,
    offsets,
    members,
    points,
    directions,
    oriented,
    radii,
    smallest,
    degrees,
    priors,
    beyond,
    sigma,
    chunks,
    shape,
    d1,
    normals,
    error,
    used,
    reasons,
):
    """Fit a jet per row at its radius, coefficients of degree d held back by the prior priors[row, d - 3].

    Where residuals are too large to be noise, a fit of a shorter radius, down to `smallest`, has its share in the
    answer, all of it where they are far too large. `shape` gets k1, k2; `used` the mean radius; `beyond` is the error
    expected of higher degrees where the probes were, believed as far as a row's own fits show any.
    """
    links, outs = (offsets, members, points, directions, oriented), (shape, d1, normals, error, used, reasons)
    for chunk in prange(chunks):
        stamps, work, here = np.full(points.shape[0], -1, np.int32), workspace(MOST), np.zeros(9)
        for row in range(chunk * centers.shape[0] // chunks, (chunk + 1) * centers.shape[0] // chunks):
            reasons[row] = FEW
            if radii[row] > 0.0:
                ball = surroundings(4 * row, centers[row], radii[row], degrees[row], links, stamps, work[0])
                fit = smallest[row], priors[row], beyond[row], sigma
                answered(row, centers[row], ball, fit, links, stamps, work, here, outs)


@jit
def surroundings(stamp, center, radius, degree, links, stamps, found):
    """Gather the points of a ball, of a larger one where they lie to one side.

    Returns how many there are, the radius, the degree to fit, and how far their mean is aside.
    """
    offsets, members, points, directions, oriented = links
    count = gathered(offsets, members, points, center, radius, stamps, stamp, found)
    radius = shortened(radius, count)
    nx, ny, nz = mean_direction(found, count, directions, center, oriented)
    lean = leaning(found, count, points, center, radius, nx, ny, nz)
    if lean > LEANING:
        radius *= 1.0 + (REACH if degree > 2 else FARTHER) * min(lean, 0.5)
        degree = HIGHEST
        count = gathered(offsets, members, points, center, radius, stamps, stamp + 1, found)
        radius = shortened(radius, count)
    return count, radius, degree, lean


@jit
def answered(row, center, ball, fit, links, stamps, work, here, outs):
    """Fit a jet in a ball, in wider ones where there is none, in shorter ones where it does not follow the points."""
    count, radius, degree, lean = ball
    smallest, priors, beyond, sigma = fit
    offsets, members, points, directions, oriented = links
    shape, d1, normals, error, used, reasons = outs
    slack = WARY if lean > LEANING else 1.0
    rest, before, shown, wider = 1.0, 0.0, 0.0, 1
    for _step in range(STEPS):
        told = (radius, degree, sigma, slack, lean, beyond)
        outcome, total, ratio = fitted(count, center, points, directions, oriented, told, priors, work, here)
        if outcome != FOUND:
            if reasons[row] == FOUND or (outcome == FEW and wider == 3):
                break
            reasons[row] = outcome
            if outcome == DEGENERATE and degree > 2:
                degree = 2
            elif wider < 3:
                wider += 1
                radius *= WIDER
                count = gathered(offsets, members, points, center, radius, stamps, 4 * row + wider, work[0])
            continue
        # the part of this fit goes over to the next shorter one as its excess grows, and only if that is better
        share = rest
        if reasons[row] == FOUND:
            share *= 1.0 / (1.0 + (total / before) ** 4) if before > 0.0 else 0.0
        shown = (1.0 - share) * shown + share * here[8] / (radius * radius)
        mixed(row, share, here, radius, total, shape, d1, normals, error, used, reasons)
        reasons[row] = FOUND
        rest = share * min(max(ratio - 1.0, 0.0), 1.0)
        before = total
        if rest <= 0.0 or radius * SHORTER < smallest:
            break
        radius *= SHORTER
        slack *= 2.0
    if reasons[row] == FOUND:
        finished(row, shape, d1, normals, error, min(beyond * beyond, shown))


@jit
def fitted(count, center, points, directions, oriented, told, priors, work, here):
    """Fit one jet to the points found, write k1, k2, d1, the normal and what may be hidden to `here`.

    Returns whether there is one or why not, the expected error of H, and how much larger residuals are than allowed.
    """
    radius, degree, sigma, slack, lean, beyond = told
    found, places, heights, columns, sums, matrix, vectors, frame = work
    u, v, z, y, x, w = heights[0], heights[1], heights[2], vectors[0], vectors[1], vectors[2]
    nx, ny, nz = mean_direction(found, count, directions, center, oriented)
    kept = seen(found, count, points, directions, center, nx, ny, nz, oriented, radius, places)
    if kept < 6:
        return FEW, 0.0, 0.0
    framed(nx, ny, nz, frame)
    if not flattened(places, kept, frame, u, v, z, columns, sums, matrix, y, x):
        return DEGENERATE, 0.0, 0.0
    degree = affordable(kept, degree)
    terms = (degree + 1) * (degree + 2) // 2
    squares = normal_equations(degree, u, v, z, kept, columns, sums, matrix, y)
    level = (sigma / radius) ** 2
    held_back(matrix, degree, level, slack, radius, priors)
    if factored(matrix, y, terms) < terms:
        return DEGENERATE, 0.0, 0.0
    solved(matrix, y, terms, x)
    influence(matrix, terms, 3, 5, 1.0, w)
    variance = 0.0
    for t in range(terms):
        squares -= y[t] * y[t]
        variance += w[t] * w[t]
    judged(x, frame, here)
    curved = math.sqrt(0.5 * (here[0] * here[0] + here[1] * here[1]))
    free = max(kept - 6, 1)  # what the priors hold back counts among the residuals
    excess = squares / free - level * (ROUGH + 3.0 / math.sqrt(free))
    excess = math.sqrt(max(excess, 0.0)) * (HARM if degree > 3 else GENTLE * HARM) * (1.0 + RIMS * lean)
    if kept < SPARE + 6:
        excess = max(excess, UNTOLD * curved)
    doubt = math.sqrt(level * variance)
    here[8] = hidden(degree, w, y, squares / free)
    allowed = max(3.0 * doubt, TOLERATED * curved, 0.5 * beyond * radius, 1e-300)
    return FOUND, math.sqrt(doubt * doubt + excess * excess) / radius, excess / allowed


@jit
def hidden(degree, w, y, square):
    """Return how wrong H may be by what no degree says, squared, in radii, as far as one fit shows.

    By as much as the last even degree changed it, and by residuals, even if all of them were detail.
    """
    last, harm = 0.0, GENTLE * HARM
    if degree > 3:
        harm = HARM
        d = degree // 2 * 2
        for t in range(d * (d + 1) // 2, (d + 1) * (d + 2) // 2):
            last += w[t] * y[t]
    return last * last + harm * harm * max(square, 0.0)


@jit
def held_back(matrix, degree, level, slack, radius, priors):
    """Add to the diagonal what priors of that deviation weigh against noise of that level: ridge regression."""
    for d in range(3, degree + 1):
        deviation = slack * priors[d - 3] * radius ** (d - 1)
        ridge = level / max(deviation * deviation, 1e-30)
        share = 1.0
        for i in range(d + 1):
            t = d * (d + 1) // 2 + i
            matrix[t, t] += min(ridge / share, 1e6 * matrix[t, t] + 1e-300)
            share *= (d - i) / (i + 1.0)
