"""The fit of a row: a jet at a given radius and degree, regularized by priors, blended with those of shorter radii."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import FAST
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh.numerics._kernels_matrices import factored, influence, solved
from simplexmesh.surface.curvature.adaptive._kernels_balls import (
    CAPACITY,
    collected,
    gathered,
    inlined,
    jit,
    leaning,
    mean_direction,
    reaches_border,
    seen,
    shortened,
)
from simplexmesh.surface.curvature.adaptive._kernels_blend import Jet, blend, jet_of, normalize
from simplexmesh.surface.curvature.adaptive._kernels_polynomials import (
    FIRST,
    HIGHEST,
    SECOND,
    SINGULAR,
    affordable,
    complete,
    flattened,
    framed,
    normal_equations,
    workspace,
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
"""Neighborhoods whose mean is farther from the center than this, in radii, are one-sided, as at a border."""

BORDER_WIDENING, QUADRIC_WIDENING = 0.6, 1.4
"""Enlargement of one-sided balls, which hold half the points, per lean; the second where the degree is 2."""

BORDER_PRIOR = 0.65
"""Factor of the priors' deviations in one-sided balls, where the errors of odd terms do not cancel."""

BORDER_BIAS = 10.0
"""Increase of that error with the lean."""

BORDER_ERROR = 1.6
"""Factor of the expected error at borders: without it actual errors there were 1.2 to 1.8 of it on cut tori, at 0.3 and
1 % of noise, and 3 on a graph whose border is the crest of a wave; with it they are at most 1.9. One-sided balls
inside, where density jumps or a crease hides a side, need none: actual errors are 0.2 to 0.5 of the expected there."""

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


class Aim(NamedTuple):
    """How to fit: radius and degree; noise; factor of the priors; lean of the ball; expected truncation error of H."""

    radius: float
    degree: int
    noise: float
    slack: float
    lean: float
    truncation: float


class FittedJet(NamedTuple):
    """A jet, `FOUND` or why there is none; its expected error; excess residual over the allowed; squared truncation."""

    reason: int
    jet: Jet
    expected: float
    ratio: float
    truncation: float


@by_rows(fastmath=FAST)
def jets(begin, end, centers, surface, scales, out):
    """Fit a jet around each center at its scale, which blends into shorter ones as residuals exceed noise."""
    stamps, work = np.full(surface.points.shape[0], -1, np.int32), workspace(CAPACITY)
    for row in range(begin, end):
        out.reasons[row] = FEW
        if scales.radii[centers[row]] > 0.0:
            _fit_row(row, centers[row], surface, scales, stamps, work, out)


@inlined
def _fit_row(row, center, surface, scales, stamps, work, out):
    """Fit a jet in a ball; in wider ones while that fails, in shorter ones while it does not follow the points."""
    count, radius, degree, lean = _ball(4 * row, center, surface, scales, stamps, work)
    priors, truncation = scales.priors[center], scales.truncation[center]
    slack = BORDER_PRIOR if lean > LEANING else 1.0
    remaining, before, shown, widenings = 1.0, 0.0, 0.0, 1
    for _fit in range(MAX_FITS):
        fit = fit_jet(count, surface.oriented, Aim(radius, degree, scales.noise, slack, lean, truncation), priors, work)
        if fit.reason != FOUND:
            if out.reasons[row] == FOUND or (fit.reason == FEW and widenings == 3):
                break
            out.reasons[row] = fit.reason
            if fit.reason == DEGENERATE and degree > 2:
                degree = 2
            elif widenings < 3:
                widenings += 1
                radius *= WIDENING
                count = gathered(surface, center, radius, stamps, 4 * row + widenings, work.found)
                collected(work.found, count, surface, work.around)
            continue
        # as its excess residual grows, a fit yields its share to the next shorter one, if that expects less error
        share = remaining
        if out.reasons[row] == FOUND:
            share *= 1.0 / (1.0 + (fit.expected / before) ** 4) if before > 0.0 else 0.0
        shown = (1.0 - share) * shown + share * fit.truncation / (radius * radius)
        blend(row, share, fit.jet, radius, fit.expected, out)
        remaining = share * min(max(fit.ratio - 1.0, 0.0), 1.0)
        before = fit.expected
        if remaining <= 0.0 or radius * SHORTER < scales.smallest[center]:
            break
        radius *= SHORTER
        slack *= 2.0
    if out.reasons[row] == FOUND:
        normalize(row, out)
        out.error[row] = math.sqrt(out.error[row] ** 2 + min(truncation * truncation, shown))
        if lean > LEANING and reaches_border(work.found, count, surface.closed):
            out.error[row] *= BORDER_ERROR


@jit
def _ball(stamp, center, surface, scales, stamps, work):
    """Gather the points of a ball, larger if one-sided; return their number, radius, degree and lean."""
    radius, degree = scales.radii[center], scales.degrees[center]
    count = gathered(surface, center, radius, stamps, stamp, work.found)
    collected(work.found, count, surface, work.around)
    radius = shortened(radius, count)
    lean = leaning(work.around, count, radius, mean_direction(work.around, count, surface.oriented))
    if lean > LEANING:
        radius *= 1.0 + (BORDER_WIDENING if degree > 2 else QUADRIC_WIDENING) * min(lean, 0.5)
        degree = HIGHEST
        count = gathered(surface, center, radius, stamps, stamp + 1, work.found)
        collected(work.found, count, surface, work.around)
        radius = shortened(radius, count)
    return count, radius, degree, lean


@inlined
def _failed(reason):
    """Return a fit without a jet."""
    none = (0.0, 0.0, 0.0)
    return FittedJet(reason, Jet(0.0, 0.0, none, none), 0.0, 0.0, 0.0)


@inlined
def fit_jet(count, oriented, aim, priors, work):
    """Fit one jet to the points collected."""
    radius, matrix, y, x, w = aim.radius, work.matrix, work.y, work.x, work.w
    normal = mean_direction(work.around, count, oriented)
    kept = seen(work.around, count, normal, oriented, radius, work.places)
    if kept < 6:
        return _failed(FEW)
    framed(normal[0], normal[1], normal[2], work.frame)
    if not flattened(kept, work):
        return _failed(DEGENERATE)
    degree = affordable(kept, aim.degree)
    squares = normal_equations(degree, kept, work)
    level = max((aim.noise / radius) ** 2, ROUNDING * ROUNDING * squares / kept)
    add_ridge(matrix, degree, level, aim.slack, radius, priors)
    degree = complete(factored(matrix, y, (degree + 1) * (degree + 2) // 2, SINGULAR))
    if degree < 2:
        return _failed(DEGENERATE)
    influence(matrix, (degree + 1) * (degree + 2) // 2, FIRST, SECOND, 1.0, w)
    degree, variance = supported(degree, kept, w)
    terms = (degree + 1) * (degree + 2) // 2
    solved(matrix, y, terms, x)
    for t in range(terms):
        squares -= y[t] * y[t]
    jet = jet_of(x, work.frame)
    curved = math.sqrt(0.5 * (jet.k1 * jet.k1 + jet.k2 * jet.k2))
    free = max(kept - 6, 1)  # the residuals include what the priors suppress
    excess = squares / free - level * (NOISE_TOLERANCE + 3.0 / math.sqrt(free))
    bias = RESIDUAL_BIAS[degree] * (1.0 + BORDER_BIAS * aim.lean)
    excess = math.sqrt(max(excess, 0.0)) * bias
    if kept < MIN_FREEDOM + 6:
        excess = max(excess, UNKNOWN_BIAS * curved)
    deviation = math.sqrt(level * variance)
    ratio = excess / max(3.0 * deviation, TOLERATED_ERROR * curved, 0.5 * aim.truncation * radius, 1e-300)
    if degree <= 3:
        excess *= max(1.0, AMPLIFIED_BIAS * math.sqrt(variance * kept) / bias)
    expected = math.sqrt(deviation * deviation + excess * excess) / radius
    return FittedJet(FOUND, jet, expected, ratio, truncation_square(degree, w, y, squares / free))


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
    """Return the squared truncation error of H, in radii, that a fit shows: its last even degree and its residuals."""
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
