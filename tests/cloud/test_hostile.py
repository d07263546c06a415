"""What is no cloud, no kind and no place to write to: one sentence each, and results that nobody can change."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm


def test_three_points_do_not_tell_a_kind():
    with pytest.raises(ValueError, match=r"^points must be more than determine a plane, 3, to tell its kind, not 3$"):
        sm.fit_primitive(np.eye(3), "any")


def test_kinds_are_names():
    with pytest.raises(TypeError, match=r"^kinds must be a sequence of names, not int"):
        sm.extract_primitives(np.random.default_rng(0).normal(size=(100, 3)), kinds=3)


def test_how_it_was_fitted_cannot_be_changed():
    plane = sm.fit_primitive(np.random.default_rng(0).uniform(size=(50, 3)) * [1, 1, 1e-3], "plane")
    for array in (plane.covariance, plane.extent):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
