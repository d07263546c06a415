"""Kernels that compare signatures against their plain twins, and what a rotation is followed to."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from simplexmesh.recognition.sai import _kernels_rotations as kernels
from simplexmesh.recognition.sai.sphere_domain import sphere_domain
from tests.recognition import reference as reference

F = 5
SEEDS = st.integers(0, 2**31)


def fields(seed, share=0.8):
    """Two smooth fields on the sphere, what is seen of them, and a rotation."""
    rng = np.random.default_rng(seed)
    at, directions = sphere_domain(F).vertices, rng.normal(size=(2, 5, 3))
    values = [np.sin(2 * at @ each.T).sum(axis=1) for each in directions]
    seen = [at @ reference.random_rotation(rng)[0] < 2 * rng.uniform(share, 1) - 1 for _ in range(2)]
    return values, seen, reference.random_rotation(rng)


def pair_of(values, seen):
    return kernels.SignaturePair(values[0], sphere_domain(F).face_means(values[0]), seen[0], values[1], seen[1])


def at_rotation(R, values, seen):
    here = sphere_domain(F)
    near = np.argmax(here.vertices @ R.T @ here.vertices.T, axis=1)
    A, b = np.full((3, 3), np.nan), np.full(3, np.nan)
    found = kernels.residuals(R, near, pair_of(values, seen), here.arrays, A, b)
    return *found, A, b, near


class TestResiduals:
    @settings(max_examples=10)
    @given(SEEDS)
    def test_are_the_plain_sums_and_normal_equations(self, seed):
        values, seen, R = fields(seed)
        total, count, A, b, _ = at_rotation(R, values, seen)
        plain = reference.residuals(F, R, values[0], seen[0], values[1], seen[1])
        assert count == plain[1]
        assert np.allclose(total, plain[0], rtol=1e-9, atol=1e-12)
        assert np.allclose(A, plain[2], rtol=1e-7, atol=1e-9)
        assert np.allclose(b, plain[3], rtol=1e-7, atol=1e-9)

    @settings(max_examples=10)
    @given(SEEDS)
    def test_the_equations_are_the_slope_of_the_sum(self, seed):
        values, _, R = fields(seed)
        seen = [np.ones(500, bool)] * 2
        *_, b, _ = at_rotation(R, values, seen)
        step = 1e-6
        slope = [
            (at_rotation(reference.turned(step * w, R), values, seen)[0]
             - at_rotation(reference.turned(-step * w, R), values, seen)[0]) / (2 * step)
            for w in np.eye(3)
        ]  # fmt: skip
        assert np.allclose(slope, 2 * b, rtol=1e-3, atol=2e-2 * np.abs(b).max())  # kinks

    @settings(max_examples=10)
    @given(SEEDS)
    def test_where_vertices_went_is_left_for_the_next_time(self, seed):
        values, _, R = fields(seed)
        here = sphere_domain(F)
        *_, near = at_rotation(R, values, [np.ones(500, bool)] * 2)
        vertex, _, inverse = reference.triangles_of(F)
        for p in range(0, 500, 29):
            weights = (inverse @ (R @ here.vertices[p])).min(axis=1)
            assert weights[vertex == near[p]].max() > -1e-9


class TestTurn:
    @given(SEEDS, st.sampled_from([0.0, 1e-15, 1e-9, 1e-3, 1.0, 3.0]))
    def test_is_rodrigues_formula(self, seed, angle):
        rng = np.random.default_rng(seed)
        R, axis = reference.random_rotation(rng), rng.normal(size=3)
        w, out = angle * axis / np.linalg.norm(axis), np.zeros((3, 3))
        kernels.rotate(*w, R, out)
        assert np.allclose(out, reference.turned(w, R), atol=1e-12)


class TestFollow:
    @settings(max_examples=4)
    @given(SEEDS, st.sampled_from([0, 1, 3, 6]))
    def test_is_the_plain_method_step_by_step(self, seed, steps):
        values, seen, R = fields(seed)
        here, rng = sphere_domain(F), np.random.default_rng(seed)
        starts = np.stack([R, reference.random_rotation(rng)])
        plain = [
            reference.followed(F, start, values[0], seen[0], values[1], seen[1], least=50, steps=steps, longest=0.1)
            for start in starts
        ]
        turns, mean, common = starts.copy(), np.zeros(2), np.zeros(2)
        near = np.argmax(np.einsum("kab,nb->kna", turns, here.vertices) @ here.vertices.T, axis=2)
        kernels.refine(turns, near, pair_of(values, seen), here.arrays, 50, steps, mean, common)
        assert np.allclose(turns, [each[0] for each in plain], atol=1e-7)
        assert np.allclose(mean, [each[1] for each in plain], rtol=1e-7)
        assert np.allclose(common, [each[2] for each in plain])

    def test_too_little_in_common_stays_where_it_is(self):
        values, _, R = fields(3)
        here = sphere_domain(F)
        seen = [here.vertices[:, 2] > 0.95] * 2
        turns, mean, common = R[None].copy(), np.zeros(1), np.zeros(1)
        near = np.argmax(here.vertices @ R.T @ here.vertices.T, axis=1)[None]
        kernels.refine(turns, near, pair_of(values, seen), here.arrays, 300, 9, mean, common)
        assert np.array_equal(turns[0], R)
        assert np.isinf(mean[0])

    @settings(max_examples=10)
    @given(SEEDS)
    def test_comes_back_from_a_few_degrees_away(self, seed):
        """A field without symmetry and the same rotated: the minimum is the rotation, but for interpolation."""
        rng = np.random.default_rng(seed)
        at, axes, R = sphere_domain(F).vertices, reference.random_rotation(rng), reference.random_rotation(rng)
        first, second = (
            (points @ axes.T) ** 2 @ [1.0, 2, 4] + (points @ axes.T) ** 3 @ np.ones(3) for points in (at, at @ R.T)
        )  # second(p) = first(R p)
        axis = rng.normal(size=3)
        turns = reference.turned(np.radians(4) * axis / np.linalg.norm(axis), R)[None]
        here, seen, mean, common = sphere_domain(F), np.ones(500, bool), np.zeros(1), np.zeros(1)
        near = np.argmax(here.vertices @ turns[0].T @ here.vertices.T, axis=1)[None]
        kernels.refine(turns, near, pair_of((first, second), (seen, seen)), here.arrays, 1, 25, mean, common)
        assert reference.angle(turns[0], R) < 1.0
        assert common[0] == 500
