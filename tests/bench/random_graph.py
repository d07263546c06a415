"""Random smooth surfaces, without the symmetries that flatter estimators on known ones."""

from __future__ import annotations

import numpy as np

from simplexmesh.bench.truth.graphs import Graph, cosines

WAVES = 600
"""Cosines of which a surface is the sum: heights of fewer are not normally distributed."""


def random_graph(length, bending, seed):
    """Heights with the covariance a^2 exp(-r^2 / (2 length^2)), as a sum of cosines (Rahimi and Recht 2007).

    Their wave vectors are random, f_xx and f_yy have the standard deviation `bending`, 1 / length, and slopes
    length / sqrt(3) times that.
    """
    rng = np.random.default_rng(seed)
    u, v = rng.normal(size=(2, WAVES)) / length
    size = bending * length**2 / np.sqrt(3) * np.sqrt(2 / WAVES)
    jet = cosines(size, u, v, rng.uniform(0.0, 2 * np.pi, WAVES))
    return Graph("random", f"{WAVES} cosines, correlated over {length:g}", jet)
