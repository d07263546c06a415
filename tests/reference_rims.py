"""Naive twins of the fits at borders, one point at a time."""

from __future__ import annotations

import numpy as np

from tests import reference_adaptive as reference

Array = np.ndarray


def depths(rings: list[list[int]], closed: Array, most: int) -> Array:
    """Edges to the nearest vertex that is not closed, most + 1 where there are more."""
    out = np.where(closed, most + 1, 0)
    for step in range(most):
        for i, ring in enumerate(rings):
            if out[i] > step and any(out[j] == step for j in ring):
                out[i] = step + 1
    return out


def plain(rings, points, directions, center, radius, full):
    """H of polynomials of degrees 2, 3 and 4, how far points lie to one side, and their mean place, both in radii."""
    found = reference.reached(rings, points, center, radius)
    radius *= min(1.0, np.sqrt(full / len(found)))
    normal = reference.mean_direction(found, directions, center)
    places = reference.on_its_side(found, points, directions, normal, radius)
    flat, z, _ = reference.flattened(places, normal)
    highest = max([d for d in (3, 4) if 0.65 * (d + 1) * (d + 2) + 4 <= len(z)], default=2)
    means = []
    for degree in (2, 3, 4):
        powers = reference.exponents(min(degree, highest))
        design = np.stack([flat[:, 0] ** a * flat[:, 1] ** b for a, b in powers], axis=1)
        first, second = reference.fundamental(np.linalg.lstsq(design, z, rcond=None)[0])
        means.append(-np.trace(np.linalg.solve(first, second)) / 2 / radius)
    offset = places.mean(axis=0)
    return means, np.linalg.norm(offset - (offset @ normal) * normal), offset


def high_degree(rings, points, directions, center, radius, known, degree, nearest):
    """H of a degree less and of the degree, squared residuals, variance of H per variance of heights, and k1, k2."""
    (k1, k2), d1, normal = known
    found = reference.reached(rings, points, center, radius)
    places = reference.on_its_side(found, points, directions, normal, radius) * radius
    places = places[np.linalg.norm(places, axis=1).argsort()][:nearest]
    u, v, z = places @ d1, places @ np.cross(normal, d1), places @ normal
    u, v = u / np.sqrt(np.maximum(1 + k1 * z / 2, 0.5)), v / np.sqrt(np.maximum(1 + k2 * z / 2, 0.5))
    scale = np.hypot(u, v).max()

    def fit(degree):
        powers = reference.exponents(degree)
        design = np.stack([(u / scale) ** a * (v / scale) ** b for a, b in powers], axis=1)
        inverse = np.linalg.pinv(design, rcond=1e-15)
        units = np.array([scale ** (a + b) for a, b in powers])
        coefficients = inverse @ z
        second = sum(inverse[powers.index(at)] for at in ((2, 0), (0, 2))) / scale**2
        return coefficients / units, z - design @ coefficients, second @ second

    lower, (coefficients, residuals, amplification) = fit(degree - 1)[0], fit(degree)

    def shape(x):
        """The shape operator of (s sqrt(1 + k1 z / 2), t sqrt(1 + k2 z / 2), z), z(s, t) being a polynomial."""
        p, q = x[1:3]
        first, second = reference.fundamental(x)
        across, along = (
            np.array([[k1 * p / 2, k1 * q / 4], [k1 * q / 4, 0]]),
            np.array([[0, k2 * p / 4], [k2 * p / 4, k2 * q / 2]]),
        )
        return -np.linalg.solve(first, second - (p * across + q * along) / np.sqrt(1 + p * p + q * q))

    shapes = [shape(one) for one in (lower, coefficients)]
    means = [np.trace(one) / 2 for one in shapes]
    bends = np.sort(np.linalg.eigvals(shapes[1]).real)[::-1]
    return [*means, residuals @ residuals, amplification], bends
