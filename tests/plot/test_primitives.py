"""Plots of primitives: each kind in its color, where it is, over the points."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

import simplexmesh as sm
from simplexmesh.plot.primitives import COLORS


@pytest.fixture(scope="module")
def ball():
    return sm.fit_primitive(sm.sphere(8).vertices, "sphere")


def test_draws_a_surface_for_each_primitive_and_the_points(ball):
    plotter = sm.plot.primitives(sm.sphere(8).vertices, ball, title="ball")
    surface, points = list(plotter.actors.values())[:2]
    assert surface.prop.color == pv.Color(COLORS["sphere"])
    assert points.mapper.dataset.n_points == sm.sphere(8).n_vertices
    at = np.linalg.norm(surface.mapper.dataset.points - ball.center, axis=1)
    np.testing.assert_allclose(at, ball.radius, atol=1e-5)
    plotter.close()


def test_takes_several_and_says_which_have_no_ends(ball):
    sm.plot.primitives(sm.sphere(2).vertices, [ball, ball]).close()
    with pytest.raises(ValueError, match="has no ends"):
        sm.plot.primitives(sm.sphere(2).vertices, sm.primitives.Cylinder([0, 0, 0], [0, 0, 1], 1))
