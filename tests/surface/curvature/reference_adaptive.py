"""The adaptive estimator written down as it is explained: no moments, no factors kept, one point at a time."""

from __future__ import annotations

import numpy as np

from simplexmesh.surface.curvature.adaptive import _kernels_balls as balls
from simplexmesh.surface.curvature.adaptive import _kernels_jets as kernels
from simplexmesh.surface.curvature.adaptive import _kernels_polynomials as limits

Array = np.ndarray


def exponents(degree: int) -> list[tuple[int, int]]:
    """Of u and v, in the order of the coefficients."""
    return [(d - i, i) for d in range(degree + 1) for i in range(d + 1)]


def reached(rings: list[list[int]], points: Array, center: int, radius: float) -> list[int]:
    """Points that edges inside the ball lead to, ring by ring."""
    found, seen, k = [center], {center}, 0
    while k < len(found):
        for j in rings[found[k]]:
            if j not in seen:
                seen.add(j)
                if np.linalg.norm(points[j] - points[center]) <= radius and len(found) < balls.CAPACITY:
                    found.append(j)
        k += 1
    return found


def shortened(found: list[int], radius: float) -> float:
    """The radius within which there are about enough points."""
    return radius * min(1.0, float(np.sqrt(balls.ENOUGH / len(found))))


def mean_direction(found: list[int], directions: Array, center: int) -> Array:
    """Of the points whose direction looks to the center's side."""
    some = directions[found]
    total = some[some @ directions[center] >= 0].sum(axis=0)
    return total / np.linalg.norm(total)


def on_its_side(found: list[int], points: Array, directions: Array, normal: Array, radius: float) -> Array:
    """Places in radii of the points that lie on the center's side and are seen as heights."""
    places = (points[found] - points[found[0]]) / radius
    square, height = (places**2).sum(axis=1), places @ normal
    kept = (square <= 1) & ((height**2 <= balls.STEEP * square) | (np.arange(len(found)) == 0))
    return places[kept & (directions[found] @ normal >= 0)]


def fundamental(x: Array) -> tuple[Array, Array]:
    """First and second fundamental forms of the graph z = x[0] + x[1] u + x[2] v + x[3] u^2 + ... at the origin."""
    p, q = x[1:3]
    first = np.array([[1 + p * p, p * q], [p * q, 1 + q * q]])
    second = np.array([[2 * x[3], x[4]], [x[4], 2 * x[5]]]) / np.sqrt(1 + p * p + q * q)
    return first, second


def frame_of(normal: Array) -> Array:
    """Any right-handed frame above a normal."""
    u = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    u /= np.linalg.norm(u)
    return np.array([u, np.cross(normal, u), normal])


def flattened(places: Array, normal: Array) -> tuple[Array, Array, Array]:
    """Chords in the tangent plane of a quadric, heights above it, and the frame; the quadric is fitted twice."""
    frame = frame_of(normal)
    flat, z = places @ frame[:2].T, places @ frame[2]
    for _ in range(limits.QUADRIC_PASSES):
        design = np.stack([flat[:, 0] ** a * flat[:, 1] ** b for a, b in exponents(2)], axis=1)
        x = np.linalg.lstsq(design, z, rcond=None)[0]
        _, second = fundamental(x)
        tangents = frame[:2] + np.outer(x[1:3], frame[2])  # along u and along v, on the graph
        normal = np.cross(*tangents)
        turned = frame_of(normal / np.linalg.norm(normal))
        parts = np.linalg.solve(tangents @ tangents.T, tangents @ turned[:2].T)  # new axes from the graph's tangents
        bend, axes = np.linalg.eigh(parts.T @ second @ parts)
        frame = turned
        z = places @ frame[2]
        along = places @ frame[:2].T @ axes
        along /= np.sqrt(np.maximum(1 - 0.5 * bend * z[:, None], limits.MIN_SHARE))
        flat = along @ axes.T
    return flat, z, frame


def without(design, ridge, z, least):
    """x[3] + x[5] of the fit with terms below a degree only."""
    count = least * (least + 1) // 2
    some = design[:, :count]
    x = np.linalg.solve(some.T @ some + np.diag(ridge[:count]), some.T @ z)
    return x[3] + x[5]


def regularized(flat, z, radius, degree, priors, noise, slack):
    """The design matrix, the ridge, the inverse of the normal matrix with it, and the squared noise in radii."""
    powers = exponents(degree)
    design = np.stack([flat[:, 0] ** a * flat[:, 1] ** b for a, b in powers], axis=1)
    level = max((noise / radius) ** 2, kernels.ROUNDING**2 * (z @ z) / len(z))
    ridge = np.zeros(len(powers))
    normal_matrix = design.T @ design
    for t, (a, b) in enumerate(powers):
        d = a + b
        if d > 2:
            count = float(np.prod(np.arange(a + 1, d + 1)) / np.prod(np.arange(1, b + 1)))  # d over b
            deviation = slack * priors[d - 3] * radius ** (d - 1)
            ridge[t] = min(level / max(deviation**2, 1e-30) / count, 1e6 * normal_matrix[t, t])
    return design, ridge, np.linalg.inv(normal_matrix + np.diag(ridge)), level


def fitted(found, points, directions, radius, degree, priors, noise, slack, lean, beyond):
    """One fit: k1 and k2, normal, d1, expected error, residuals over what is allowed; None with too few points."""
    normal = mean_direction(found, directions, found[0])
    places = on_its_side(found, points, directions, normal, radius)
    if len(places) < 6:
        return None
    flat, z, frame = flattened(places, normal)
    while degree > 2 and 0.65 * (degree + 1) * (degree + 2) + 4 > len(z):
        degree -= 1
    while True:
        design, ridge, inverse, level = regularized(flat, z, radius, degree, priors, noise, slack)
        of_mean = np.zeros(len(ridge))
        of_mean[[3, 5]] = 1
        variance = of_mean @ inverse @ of_mean
        if degree == 2 or variance * len(z) <= kernels.MAX_AMPLIFICATION[degree]:
            break
        degree -= 1
    x = inverse @ design.T @ z
    first, second = fundamental(x)
    bends, ways = np.linalg.eig(np.linalg.solve(first, -second))
    order = np.argsort(-bends)
    k1, k2 = bends[order]
    p, q = x[1:3]
    up = (frame[2] - p * frame[0] - q * frame[1]) / np.sqrt(1 + p * p + q * q)
    way = ways[:, order[0]]
    d1 = way @ (frame[:2] + np.outer([p, q], frame[2]))
    doubt = np.sqrt(level * variance)
    squares = ((z - design @ x) ** 2).sum() + (ridge * x**2).sum()
    free = max(len(z) - 6, 1)
    bias = kernels.RESIDUAL_BIAS[degree] * (1 + kernels.BORDER_BIAS * lean)
    excess = np.sqrt(max(squares / free - level * (kernels.NOISE_TOLERANCE + 3 / np.sqrt(free)), 0)) * bias
    curved = np.sqrt((k1**2 + k2**2) / 2)
    if len(z) < 6 + kernels.MIN_FREEDOM:
        excess = max(excess, kernels.UNKNOWN_BIAS * curved)
    hidden = squares / free * kernels.RESIDUAL_BIAS[degree] ** 2
    if degree > 3:  # what H loses when the last even degree and all above are left out, and those above as well
        hidden += (without(design, ridge, z, degree // 2 * 2) - without(design, ridge, z, degree // 2 * 2 + 1)) ** 2
    allowed = max(3 * doubt, kernels.TOLERATED_ERROR * curved, 0.5 * beyond * radius, 1e-300)
    amplified = max(1, kernels.AMPLIFIED_BIAS * np.sqrt(variance * len(z)) / bias) if degree < 4 else 1
    error = np.hypot(doubt, amplified * excess) / radius
    return np.array([k1, k2]) / radius, up, d1 / np.linalg.norm(d1), error, excess / allowed, hidden / radius**2


def estimated(rings, closed, points, directions, center, radius, smallest, degree, priors, beyond, noise):
    """The whole row: wider at borders, blended with shorter radii where residuals are not noise."""
    found = reached(rings, points, center, radius)
    radius = shortened(found, radius)
    normal = mean_direction(found, directions, center)
    offset = (points[found] - points[center]).mean(axis=0) / radius
    lean = float(np.linalg.norm(offset - (offset @ normal) * normal))
    if lean > kernels.LEANING:
        radius *= 1 + (kernels.BORDER_WIDENING if degree > 2 else kernels.QUADRIC_WIDENING) * min(lean, 0.5)
        degree = limits.HIGHEST
        found = reached(rings, points, center, radius)
        radius = shortened(found, radius)
    bends = up = None
    rest, slack, before = 1.0, kernels.BORDER_PRIOR if lean > kernels.LEANING else 1.0, 0.0
    for _ in range(kernels.MAX_FITS):
        one = fitted(found, points, directions, radius, degree, priors, noise, slack, lean, beyond)
        if one is None:
            break
        k, n, _d1, error, ratio, hidden = one
        share = rest
        if bends is None:
            bends, up, square, used, shown = k, n, error**2, radius, hidden
        else:
            share *= (before / error) ** 4 / (1 + (before / error) ** 4)
            bends, up = (1 - share) * bends + share * k, (1 - share) * up + share * n
            shown = (1 - share) * shown + share * hidden
            square, used = (1 - share) * square + share * error**2, (1 - share) * used + share * radius
        rest, before = share * min(max(ratio - 1, 0), 1), error
        if rest <= 0 or radius * kernels.SHORTER < smallest:
            break
        radius, slack = radius * kernels.SHORTER, slack * 2
    border = kernels.BORDER_ERROR if lean > kernels.LEANING and not closed[found].all() else 1.0
    return bends, up / np.linalg.norm(up), border * np.sqrt(square + min(beyond**2, shown)), used


def probed(rings, points, directions, center, radius, reach):
    """What a probe says at one radius, as the kernel writes it, without the radius itself.

    None with too few points. `reach` is the largest radius of the probe, which says who is found.
    """
    found = reached(rings, points, center, reach)
    radius = min(radius, shortened(found, reach))
    normal = directions[center] / np.linalg.norm(directions[center])
    places = on_its_side(found, points, directions, normal, radius)
    if len(places) < 7:
        return None
    flat, z, _ = flattened(places, normal)
    degree = limits.HIGHEST
    while degree > 2 and 0.65 * (degree + 1) * (degree + 2) + 4 > len(z):
        degree -= 1
    powers = exponents(degree)
    design = np.stack([flat[:, 0] ** a * flat[:, 1] ** b for a, b in powers], axis=1)
    Q, R = np.linalg.qr(design)
    y, inverse = Q.T @ z, np.linalg.inv(R)
    functionals = np.zeros((3, len(powers)))
    functionals[0, [3, 5]], functionals[1, [3, 5]], functionals[2, 4] = (1, 1), (1, -1), 1
    influence = functionals @ inverse
    blocks = np.array([a + b for a, b in powers])
    changes, variances, steps = np.zeros((2, 5)), np.zeros((2, 5)), np.zeros(5)
    energies, weights = np.zeros(4), np.zeros((4, 4))
    for d in range(2, degree + 1):
        here = blocks <= 2 if d == 2 else blocks == d
        change = (influence * y)[:, here].sum(axis=1)
        variance = (influence[:, here] ** 2).sum(axis=1)
        changes[:, d - 2] = (change**2).sum(), change[0] ** 2
        variances[:, d - 2] = variance.sum(), variance[0]
        steps[d - 2] = change[0] / radius
    for d in range(3, degree + 1):
        energies[d - 3] = (y[blocks == d] ** 2).sum()
        for t, (a, b) in enumerate(powers):
            if a + b >= d:
                count = np.prod(np.arange(a + 1, a + b + 1)) / np.prod(np.arange(1, b + 1))
                weights[d - 3, a + b - 3] += count * (R[blocks == d, t] ** 2).sum()
    return changes, variances, energies, weights, z @ z - y @ y, len(z) - len(powers), degree, steps
