"""Where along a pipe its diameter changes, by the stop tests of the thesis (3.2.6) on pieces of it."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.cloud.pipes.chain import chain_of
from tests.cloud.pipes.lines import sampled

PIECES, CHANGED = 28, 13
"""One radius long each, and the one in which the pipe becomes wider by a fifth."""


@pytest.fixture(scope="module", params=[(0.01, 200.0), (0.01, 360.0), (0.04, 200.0), (0.04, 360.0)], ids=str)
def pieces(request):
    """Distances from the cylinder of each piece, and the cylinder."""
    (noise, arc), rng = request.param, np.random.default_rng(0)
    view, middle = np.array([0, 0.3, 0.954]), CHANGED + 0.5
    parts = [([0.0, middle], 1.0), ([middle, PIECES], 1.2)]
    chains = [(chain_of(np.outer(ends, [1, 0, 0]), [], radius), radius) for ends, radius in parts]
    points = np.concatenate([sampled(each, rng, 30.0 / r**2, noise / r, view, arc)[0] for each, r in chains])
    found = []
    for k in range(PIECES):
        of_piece = points[(points[:, 0] >= k) & (points[:, 0] < k + 1)]
        cylinder = sm.fit_primitive(of_piece, "cylinder", axis=(1, 0, 0))
        found.append((cylinder.distance(of_piece), cylinder))
    return found


def test_smoothed_residuals_peak_where_the_diameter_changes(pieces):
    """Protocol P8: the thesis sees a clear peak (figure 3.33); it is three to fifteen times as high as all else."""
    rho = np.array([cylinder.fit.validation.smoothness.statistic for _, cylinder in pieces])
    assert rho[CHANGED] > 2.5 * np.delete(rho, CHANGED).max()
    assert not pieces[CHANGED][1].fit.validation.valid


def test_mean_squares_leave_their_interval_where_the_diameter_changes(pieces):
    """Protocol P8: between mean and mean square of the pieces before, 5 % of others are outside by chance."""
    squares = [distance**2 for distance, _ in pieces]
    before = np.concatenate(squares[:CHANGED])
    z = np.array([(each.mean() - before.mean()) * np.sqrt(len(each)) / before.std() for each in squares])
    assert z[CHANGED] > 20
    assert (np.abs(np.delete(z, CHANGED)) < 4).all()
    assert (np.abs(np.delete(z, CHANGED)) > 1.96).mean() < 0.2
