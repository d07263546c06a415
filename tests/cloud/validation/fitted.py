"""Residuals for the tests: a cylinder fitted to points by scipy, and the linear part of such a fit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.special import fdtrc
from scipy.stats import binomtest, kstest

from simplexmesh.cloud.validation.outcome import Outcome
from simplexmesh.cloud.validation.regression import nested_model_statistic, orthonormal, polynomial_terms

LENGTH, RADIUS = 400.0, 100.0


class Fitted(NamedTuple):
    points: np.ndarray  # (n, 3) as measured
    feet: np.ndarray  # (n, 3)
    residuals: np.ndarray  # (n,)
    coordinates: np.ndarray  # (n, 2)
    derivatives: np.ndarray  # (n, 5)


def cone_points(rng, noise, half_angle=0.0, count=1332, arc=160.0):
    """The generator of the protocols: a cone about z of a mean radius, with noise along its normals."""
    z, angle, slope = rng.uniform(0, LENGTH, count), np.radians(rng.uniform(-arc / 2, arc / 2, count)), half_angle
    off = rng.normal(0, noise, count)
    radius = RADIUS + (z - LENGTH / 2) * np.tan(slope) + off * np.cos(slope)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z - off * np.sin(slope)], axis=1)


def cylinder_fit(points):
    """Least squares from the axis z: axis (a, b, 1), through (x, y, 0), radius."""

    def directed(q):
        axis = np.array([q[0], q[1], 1.0])
        return axis / np.linalg.norm(axis), points - [q[2], q[3], 0.0]

    def distances(q):
        axis, at = directed(q)
        return np.linalg.norm(at - np.outer(at @ axis, axis), axis=1) - q[4]

    done = least_squares(distances, [0, 0, 0, 0, RADIUS], x_scale=[0.01, 0.01, 1, 1, 1])
    axis, at = directed(done.x)
    across = at - np.outer(at @ axis, axis)
    one = np.cross([0, 1.0, 0], axis)
    angle = np.arctan2(across @ np.cross(axis, one), across @ one)
    away = across / np.linalg.norm(across, axis=1)[:, None]
    coordinates = np.stack([angle, at @ axis], axis=1)
    return Fitted(points, points - done.fun[:, None] * away, done.fun, coordinates, done.jac)


def linear_fit(angle, z, off):
    """What a cylinder fitted to points at small distances `off` from one leaves of them."""
    h = z / LENGTH - 0.5
    J = np.stack([h * np.cos(angle), h * np.sin(angle), np.cos(angle), np.sin(angle), np.ones_like(z)], axis=1)
    Q = orthonormal(J)
    feet = np.stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle), z], axis=1)
    return Fitted(feet, feet, off - Q @ (Q.T @ off), np.stack([angle, z], axis=1), J)


def places(rng, count, arc=160.0):
    """Angles and heights at random."""
    return np.radians(rng.uniform(-arc / 2, arc / 2, count)), rng.uniform(0, LENGTH, count)


def nested_model_test(residuals, full, null):
    """The test by the law F(p - q, n - p) that the statistic has for residuals which are independent."""
    inner, outer = orthonormal(null), orthonormal(np.column_stack([null, full]))
    more, free = outer.shape[1] - inner.shape[1], len(residuals) - outer.shape[1]
    statistic = float(nested_model_statistic(residuals, outer, inner))
    return Outcome(statistic, float(fdtrc(more, free, statistic)))


def regression_test(residuals, unfolded):
    """The test against a polynomial beside a constant, as of the thesis's equation 5.6."""
    return nested_model_test(residuals, polynomial_terms(unfolded), np.ones((len(residuals), 1)))


def is_rate(found, trials, rate):
    """Whether a count of events is that of a rate, at one in ten thousand."""
    return binomtest(found, trials, rate).pvalue > 1e-4


def are_uniform(p_values):
    """Whether p-values are uniform, at one in ten thousand."""
    return kstest(p_values, "uniform").pvalue > 1e-4


def told(line):
    """Print a line of a table: `pytest -s` shows it."""
    print(line)  # noqa: T201
