"""The adaptive estimator's fit: a jet per row, at a given radius and degree, regularized by given priors."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import get_num_threads, prange

from simplexmesh._kernels_both import PARALLEL_FROM, Both
from simplexmesh.surface.curvature._kernels_adaptive_balls import (
    CAPACITY,
    collected,
    gathered,
    jit,
    leaning,
    mean_direction,
    seen,
    shortened,
    whole,
)
from simplexmesh.surface.curvature._kernels_adaptive_blend import blend, jet_curvatures, normalize
from simplexmesh.surface.curvature._kernels_adaptive_jets import (
    HIGHEST,
    TERMS,
    complete,
    factored,
    flattened,
    framed,
    influence,
    normal_equations,
    solved,
)
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

MAX_FITS = 5
"""Fits tried per row: at shorter radii where one does not follow the points, at wider ones where there is none."""

WIDENING = 1.5
"""Factor by which a ball of too few points, or of points on a conic, is widened, twice at most."""

SHORTER = math.sqrt(0.5)
"""Ratio of each radius to the one before."""

RESIDUAL_BIAS = np.array([0.0, 0.0, 1.6, 12.0, 4.0, 4.0, 4.0])
"""Residuals of size r beyond noise in a ball of radius R cause an error of H of this times r / R^2, by degree.

At degree 2 most of the residual is of odd degree, which hardly biases H; at degree 3 it is of degree 4, which does."""

MIN_FREEDOM, UNKNOWN_BIAS = 3, 0.1
"""With fewer degrees of freedom residuals mean nothing: the error is taken to be this share of the curvedness."""

NOISE_TOLERANCE = 1.6
"""Residuals up to this times the variance of the noise count as noise, whose size varies from place to place."""

LEANING = 0.2
"""Neighborhoods whose mean is farther from the center than this, in radii, are one-sided: they lie at a border."""

BORDER_WIDENING, QUADRIC_WIDENING = 0.6, 1.4
"""Enlargement of one-sided balls, which hold half the points, per lean; the second where the degree is 2."""

BORDER_PRIOR = 0.65
"""Factor of the priors' deviations in one-sided balls, where the errors of odd terms do not cancel."""

BORDER_BIAS = 10.0
"""Increase of that error with the lean, at borders."""

AMPLIFIED_BIAS = 0.5
"""That error at degrees 2 and 3, as a share of what residuals of the worst signs would cause, if more.

Few points in a narrow tip of a border, or two rows of them, hardly determine the curvature across: fits that follow
them closely were off by 16 with an expected error of 0.01."""

ROUNDING = 3e-8
"""Least noise assumed, as a share of the heights. Without any, points in a few rows, as of long thin triangles, would
determine the terms across them by rounding and by the error of chords: H of a cylinder was off by sixty times H."""

MAX_AMPLIFICATION = np.array([0.0, 0.0, 0.0, 2e5, 3e6, 3e7, 2e8])
"""Largest variance of H, times the number of points, per variance of heights in radii, by degree.

It is that of points scattered over a half-disc, or ten times as large where there are few of them, times five. As many
rows of a grid as the degree, or fewer, exceed it, and would determine the last terms by the curvature of the rows."""

TOLERATED_ERROR = 0.02
"""Tolerated error, as a share of the curvedness."""


def chunks(rows):
    """Return the number of chunks, each with a workspace, that rows are divided into."""
    return 1 if rows < PARALLEL_FROM else 4 * get_num_threads()


@jit
def workspace(most):
    """Return the work arrays of a fit: found, around, places, u v z, columns, sums, matrix, y x w, frame."""
    width = whole(most)
    around, places, heights = np.empty((6, width)), np.empty((3, width)), np.empty((3, width))
    columns, sums = np.empty((TERMS, width)), np.empty(2 * TERMS * 2)
    matrix, vectors = np.zeros((TERMS, TERMS)), np.zeros((3, TERMS))
    return np.empty(most + 1, np.uint64), around, places, heights, columns, sums, matrix, vectors, np.zeros((3, 3))


@jit
def affordable(count, most):
    """Return the highest degree, at most `most`, that `count` points overdetermine."""
    degree = most
    while degree > 2 and 0.65 * (degree + 1) * (degree + 2) + 4.0 > count:
        degree -= 1
    return degree


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
    truncation,
    sigma,
    chunks,
    shape,
    d1,
    normals,
    error,
    used,
    reasons,
):
    """Fit a jet per row at its radius, with Gaussian priors of deviation priors[row, d - 3] on terms of degree d.

    As residuals exceed noise, the result blends into that of a shorter radius, down to `smallest`. `shape` gets k1, k2;
    `used` the mean radius; `truncation` is the error of H by higher degrees expected from the probes, used as far as
    the row's own fits show one.
    """
    links, out = (offsets, members, points, directions, oriented), (shape, d1, normals, error, used, reasons)
    for chunk in prange(chunks):
        stamps, work, jet = np.full(points.shape[0], -1, np.int32), workspace(CAPACITY), np.zeros(9)
        for row in range(chunk * centers.shape[0] // chunks, (chunk + 1) * centers.shape[0] // chunks):
            reasons[row] = FEW
            if radii[row] > 0.0:
                ball = gathered_ball(4 * row, centers[row], radii[row], degrees[row], links, stamps, work)
                fit = smallest[row], priors[row], truncation[row], sigma
                fit_row(row, centers[row], ball, fit, links, stamps, work, jet, out)


@jit
def gathered_ball(stamp, center, radius, degree, links, stamps, work):
    """Gather the points of a ball, of a larger one if they are one-sided.

    Returns their number, the radius, the degree to fit, and the lean: the distance of their mean from the center.
    """
    offsets, members, points, directions, oriented = links
    found, around = work[0], work[1]
    count = gathered(offsets, members, points, center, radius, stamps, stamp, found)
    collected(found, count, points, directions, around)
    radius = shortened(radius, count)
    nx, ny, nz = mean_direction(around, count, oriented)
    lean = leaning(around, count, radius, nx, ny, nz)
    if lean > LEANING:
        radius *= 1.0 + (BORDER_WIDENING if degree > 2 else QUADRIC_WIDENING) * min(lean, 0.5)
        degree = HIGHEST
        count = gathered(offsets, members, points, center, radius, stamps, stamp + 1, found)
        collected(found, count, points, directions, around)
        radius = shortened(radius, count)
    return count, radius, degree, lean


@jit
def fit_row(row, center, ball, fit, links, stamps, work, jet, out):
    """Fit a jet in a ball; in wider ones while that fails, in shorter ones while it does not follow the points."""
    count, radius, degree, lean = ball
    smallest, priors, truncation, sigma = fit
    offsets, members, points, directions, oriented = links
    shape, d1, normals, error, used, reasons = out
    prior_scale = BORDER_PRIOR if lean > LEANING else 1.0
    remaining, before, shown, widenings = 1.0, 0.0, 0.0, 1
    for _fit in range(MAX_FITS):
        settings = (radius, degree, sigma, prior_scale, lean, truncation)
        reason, expected, ratio = fit_jet(count, oriented, settings, priors, work, jet)
        if reason != FOUND:
            if reasons[row] == FOUND or (reason == FEW and widenings == 3):
                break
            reasons[row] = reason
            if reason == DEGENERATE and degree > 2:
                degree = 2
            elif widenings < 3:
                widenings += 1
                radius *= WIDENING
                count = gathered(offsets, members, points, center, radius, stamps, 4 * row + widenings, work[0])
                collected(work[0], count, points, directions, work[1])
            continue
        # as its excess residual grows, a fit yields its share to the next shorter one, if that expects less error
        share = remaining
        if reasons[row] == FOUND:
            share *= 1.0 / (1.0 + (expected / before) ** 4) if before > 0.0 else 0.0
        shown = (1.0 - share) * shown + share * jet[8] / (radius * radius)
        blend(row, share, jet, radius, expected, shape, d1, normals, error, used, reasons)
        reasons[row] = FOUND
        remaining = share * min(max(ratio - 1.0, 0.0), 1.0)
        before = expected
        if remaining <= 0.0 or radius * SHORTER < smallest:
            break
        radius *= SHORTER
        prior_scale *= 2.0
    if reasons[row] == FOUND:
        normalize(row, shape, d1, normals, error, min(truncation * truncation, shown))


@jit
def fit_jet(count, oriented, settings, priors, work, jet):
    """Fit one jet to the points collected; write k1, k2, d1, the normal and the squared truncation error to `jet`.

    Returns `FOUND` or why there is none, the expected error of H, and the excess residual relative to what is allowed.
    """
    radius, degree, sigma, prior_scale, lean, truncation = settings
    _, around, places, heights, columns, sums, matrix, vectors, frame = work
    u, v, z, y, x, w = heights[0], heights[1], heights[2], vectors[0], vectors[1], vectors[2]
    nx, ny, nz = mean_direction(around, count, oriented)
    kept = seen(around, count, nx, ny, nz, oriented, radius, places)
    if kept < 6:
        return FEW, 0.0, 0.0
    framed(nx, ny, nz, frame)
    if not flattened(places, kept, frame, u, v, z, matrix, y, x):
        return DEGENERATE, 0.0, 0.0
    degree = affordable(kept, degree)
    terms = (degree + 1) * (degree + 2) // 2
    squares = normal_equations(degree, u, v, z, kept, columns, sums, matrix, y)
    level = max((sigma / radius) ** 2, ROUNDING * ROUNDING * squares / kept)
    add_ridge(matrix, degree, level, prior_scale, radius, priors)
    degree = complete(factored(matrix, y, terms))
    if degree < 2:
        return DEGENERATE, 0.0, 0.0
    influence(matrix, (degree + 1) * (degree + 2) // 2, 3, 5, 1.0, w)
    degree, variance = supported(degree, kept, w)
    terms = (degree + 1) * (degree + 2) // 2
    solved(matrix, y, terms, x)
    for t in range(terms):
        squares -= y[t] * y[t]
    jet_curvatures(x, frame, jet)
    curved = math.sqrt(0.5 * (jet[0] * jet[0] + jet[1] * jet[1]))
    free = max(kept - 6, 1)  # the residuals include what the priors suppress
    excess = squares / free - level * (NOISE_TOLERANCE + 3.0 / math.sqrt(free))
    bias = RESIDUAL_BIAS[degree] * (1.0 + BORDER_BIAS * lean)
    excess = math.sqrt(max(excess, 0.0)) * bias
    if kept < MIN_FREEDOM + 6:
        excess = max(excess, UNKNOWN_BIAS * curved)
    deviation = math.sqrt(level * variance)
    jet[8] = truncation_square(degree, w, y, squares / free)
    allowed = max(3.0 * deviation, TOLERATED_ERROR * curved, 0.5 * truncation * radius, 1e-300)
    ratio = excess / allowed
    if degree <= 3:
        excess *= max(1.0, AMPLIFIED_BIAS * math.sqrt(variance * kept) / bias)
    return FOUND, math.sqrt(deviation * deviation + excess * excess) / radius, ratio


@jit
def supported(degree, count, w):
    """Return the highest degree that does not amplify errors too much, up to the given one, and the variance of H."""
    while True:
        variance = 0.0
        for t in range((degree + 1) * (degree + 2) // 2):
            variance += w[t] * w[t]
        if degree == 2 or variance * count <= MAX_AMPLIFICATION[degree]:
            return degree, variance
        degree -= 1


@jit
def truncation_square(degree, w, y, square):
    """Return the squared truncation error of H, in radii, that one fit shows.

    The change by the last even degree, plus the error if all residuals were detail.
    """
    last, bias = 0.0, RESIDUAL_BIAS[degree]
    if degree > 3:
        d = degree // 2 * 2
        for t in range(d * (d + 1) // 2, (d + 1) * (d + 2) // 2):
            last += w[t] * y[t]
    return last * last + bias * bias * max(square, 0.0)


@jit
def add_ridge(matrix, degree, level, prior_scale, radius, priors):
    """Add the ridge terms, noise variance over prior variance, to the diagonal of the normal equations."""
    for d in range(3, degree + 1):
        deviation = prior_scale * priors[d - 3] * radius ** (d - 1)
        ridge = level / max(deviation * deviation, 1e-30)
        share = 1.0
        for i in range(d + 1):
            t = d * (d + 1) // 2 + i
            matrix[t, t] += min(ridge / share, 1e6 * matrix[t, t] + 1e-300)
            share *= (d - i) / (i + 1.0)
