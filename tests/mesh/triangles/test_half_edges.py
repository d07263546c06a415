"""Half-edge kernels against their definitions in NumPy."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from simplexmesh.mesh.triangles import _kernels_half_edges as kernels

SEEDS = st.integers(0, 10_000)


def angle_cosine(a, b):
    return a @ b / (np.linalg.norm(a) * np.linalg.norm(b))


def shape(p, q, r):
    """1 of an equilateral triangle, 0 of one without area."""
    sides = sum(((a - b) ** 2).sum() for a, b in ((p, q), (q, r), (r, p)))
    return 2 * np.sqrt(3) * np.linalg.norm(np.cross(q - p, r - p)) / sides


def folds_or_flattens(a, b, c, d):
    """What is wrong with c d in place of the edge a b of the triangles a b c and b a d."""
    old, new = [(a, b, c), (b, a, d)], [(a, d, c), (d, b, c)]
    normals = [np.cross(q - p, r - p) for p, q, r in old]
    turned = [angle_cosine(np.cross(q - p, r - p), sum(normals)) for p, q, r in new]
    steep = min(angle_cosine(*normals), *turned) < kernels.MIN_COSINE
    return steep or min(shape(*t) for t in new) <= 0.25 * min(shape(*t) for t in old)


@given(seed=SEEDS)
def test_normals_and_cosines(seed):
    p, q, r = np.random.default_rng(seed).normal(size=(3, 3))
    assert_allclose(kernels.area_normal(p, q, r), np.cross(q - p, r - p), atol=1e-12)
    assert_allclose(kernels.cosine(tuple(p), tuple(q)), angle_cosine(p, q), atol=1e-12)
    assert kernels.cosine(tuple(p), (0.0, 0.0, 0.0)) == -1


@given(seed=SEEDS)
def test_flips_neither_fold_nor_flatten(seed):
    rng = np.random.default_rng(seed)
    flat = np.array([[-1, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0]])
    for _ in range(20):
        vertices = flat + 0.5 * rng.normal(size=(4, 3))
        assert kernels.flip_is_valid(vertices, 0, 1, 2, 3) == (not folds_or_flattens(*vertices))
