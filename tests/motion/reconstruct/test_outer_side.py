"""Normals of open data agree on one side, however dense and noisy its points."""

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.motion.reconstruct.outer_side import outward_cloud
from tests.nightly.marks import nightly


@pytest.mark.parametrize("count", [6000, *nightly(30_000)])
def test_normals_of_noisy_sheets_face_one_way(count):
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1, 1, (2, count))
    points = np.column_stack([x, y, 0.25 * np.sin(2 * x) * np.cos(2 * y)]) + rng.normal(0, 0.03, (count, 3))
    up = outward_cloud(sm.PointCloud(points), is_open=True).normals[:, 2]
    assert max((up > 0).mean(), (up < 0).mean()) > 0.98
