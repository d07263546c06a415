"""Jets from polynomials, by the fundamental forms, and the means of several."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simplexmesh.surface.curvature.adaptive import _kernels_blend as kernels
from simplexmesh.surface.curvature.adaptive.adaptive import Jets
from simplexmesh.surface.reasons import FEW, FOUND
from tests.surface.curvature import reference_adaptive as reference

FRAME = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]


def shape(x):
    """Normal, and the shape operator in space, whose eigenvectors are the principal directions."""
    first, second = reference.fundamental(x)
    u, v = FRAME[0] + x[1] * FRAME[2], FRAME[1] + x[2] * FRAME[2]
    normal = FRAME[2] - x[1] * FRAME[0] - x[2] * FRAME[1]
    dual = np.linalg.solve(first, [u, v])
    return normal / np.linalg.norm(normal), -dual.T @ second @ dual


POLYNOMIALS = {
    "valley": [0, 0, 0, 2.0, 0, 0],
    "valley across": [0, 0, 0, 0, 0, 2.0],
    "ridge": [0, 0, 0, -2.0, 0, 0],
    "ridge across": [0, 0, 0, 0, 0, -2.0],
    "saddle": [0, 0, 0, 1.0, 0, -1.0],
    "oblique saddle": [0, 0, 0, 0, 1.0, 0],
    "other saddle": [0, 0, 0, 0, -1.0, 0],
    "tilted": [0.3, 0.5, -0.4, 1.0, 0.7, -0.2],
} | {str(seed): np.random.default_rng(seed).normal(size=6) for seed in range(12)}


@pytest.mark.parametrize("name", POLYNOMIALS)
def test_a_jet_has_the_principal_curvatures_and_the_direction_of_the_first(name):
    x = np.array(POLYNOMIALS[name], float)
    jet = kernels.jet_of(x, FRAME)
    normal, operator = shape(x)
    values = np.linalg.eigvalsh(operator)
    rest = values[np.argsort(np.abs(values))[1:]]  # that along the normal is 0
    assert_allclose([jet.k2, jet.k1], np.sort(rest), atol=1e-12)
    assert_allclose(jet.normal, normal, atol=1e-12)
    assert_allclose(operator @ jet.d1, jet.k1 * np.array(jet.d1), atol=1e-11)
    assert_allclose([np.dot(jet.d1, jet.d1), np.dot(jet.d1, normal)], [1, 0], atol=1e-12)


@pytest.mark.parametrize("bend", [0.0, 0.7, -0.7])
def test_of_an_umbilic_any_direction_is_the_first(bend):
    jet = kernels.jet_of(np.array([0, 0, 0, bend, 0, bend]), FRAME)
    assert_allclose([jet.k1, jet.k2], -2 * bend, atol=1e-7)
    assert_allclose([np.dot(jet.d1, jet.d1), np.dot(jet.d1, FRAME[2])], [1, 0], atol=1e-12)


def test_blended_jets_are_means_by_their_shares():
    out = Jets(np.ones((2, 2)), np.ones((2, 3)), np.ones((2, 3)), np.ones(2), np.ones(2), np.full(2, FEW, np.uint8))
    x, n = np.array([0.6, 0.8, 0]), np.array([0, 0, 1.0])
    y, m = np.array([-1.0, 0, 0]), np.array([0, 0.6, 0.8])  # turned over: directions have no sense
    kernels.blend(1, 0.25, kernels.Jet(4.0, 2.0, tuple(x), tuple(n)), 2.0, 0.3, out)  # the first whatever its share
    assert out.reasons.tolist() == [FEW, FOUND]
    assert_allclose(out.shape[1], [2, 1])
    assert_allclose([*out.d1[1], *out.normals[1]], [*x, *n])
    assert_allclose([out.error[1], out.scale[1]], [0.3, 2])
    kernels.blend(1, 0.25, kernels.Jet(3.0, -1.0, tuple(y), tuple(m)), 0.5, 0.1, out)
    assert_allclose(out.shape[1], [0.75 * 2 + 0.25 * 6, 0.75 * 1 - 0.25 * 2])
    assert_allclose(out.d1[1], 0.75 * x - 0.25 * y)
    assert_allclose(out.normals[1], 0.75 * n + 0.25 * m)
    assert_allclose(out.error[1], np.sqrt(0.75 * 0.09 + 0.25 * 0.01))
    assert_allclose(out.scale[1], 0.75 * 2 + 0.25 * 0.5)
    mean, way = out.normals[1].copy(), out.d1[1].copy()
    kernels.normalize(1, out)
    mean /= np.linalg.norm(mean)
    way -= (way @ mean) * mean
    assert_allclose(out.normals[1], mean)
    assert_allclose(out.d1[1], way / np.linalg.norm(way))
    assert (out.shape[0] == 1).all()
