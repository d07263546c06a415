"""Small matrices against NumPy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simplexmesh.numerics import _kernels_matrices as kernels

SIX = np.random.default_rng(0).normal(size=(9, 6))


@pytest.mark.parametrize("n", range(1, 7))
def test_a_system_is_factored_and_solved_with_those_of_its_leading_terms(n):
    normal, right = SIX[:, :n].T @ SIX[:, :n], np.arange(1.0, n + 1)
    factor, y = normal.copy(), right.copy()
    assert kernels.factored(factor, y, n, kernels.SINGULAR) == n
    L = np.linalg.cholesky(normal)
    assert_allclose(np.tril(factor, -1), np.tril(L, -1), atol=1e-12)
    assert_allclose(1 / factor.diagonal(), L.diagonal())
    assert_allclose(y, np.linalg.solve(L, right))
    for terms in range(1, n + 1):
        x = np.full(n, np.nan)
        kernels.solved(factor, y, terms, x)
        assert_allclose(x[:terms], np.linalg.solve(normal[:terms, :terms], right[:terms]))
        assert np.isnan(x[terms:]).all()
    x = right.copy()
    assert kernels.solve(normal.copy(), x, n)
    assert_allclose(x, np.linalg.solve(normal, right))


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize(("lean", "rank"), [(0.0, 2), (0.05, 2), (0.2, 4)])
def test_a_pivot_is_singular_below_a_share_of_its_diagonal_entry(unit, lean, rank):
    A = unit * np.eye(4)
    A[:2, 2], A[2, 2] = unit, lean * unit  # depends on the first two columns, but for the sine of an angle
    share = np.full(4, 0.1**2)
    assert kernels.factored(A.T @ A, np.ones(4), 4, share) == rank
    assert kernels.solve(A.T @ A, np.ones(4), 4) == (lean > 0)


@pytest.mark.parametrize(("first", "second", "sign"), [(3, 5, 1.0), (3, 5, -1.0), (4, 4, 0.0)])
def test_influence_is_the_functional_in_terms_of_the_factored_right_side(first, second, sign):
    factor, out = SIX.T @ SIX, np.full(6, np.nan)
    L = np.linalg.cholesky(factor)
    kernels.factored(factor, np.zeros(6), 6, kernels.SINGULAR)
    kernels.influence(factor, 6, first, second, sign, out)
    functional = np.zeros(6)
    functional[first] += 1
    functional[second] += sign
    assert_allclose(out, np.linalg.solve(L, functional), atol=1e-14)


def test_rows_rotated_in_one_by_one_leave_the_triangle_of_all():
    n, right, rest = 4, SIX[:, 5], 0.0
    A = SIX[:, :n] * [1, 1, 0, 1]  # what is zero needs no rotation
    factor = np.zeros((n + 1, n + 1))
    for row, value in zip(A, right, strict=True):
        factor[n] = *row, value
        kernels.add_row(factor, n)
        rest += factor[n, n] ** 2
    R, best = np.triu(factor[:n, :n]), np.linalg.lstsq(A, right)[0]
    assert_allclose(R.T @ R, A.T @ A, atol=1e-12)
    assert_allclose(R.T @ factor[:n, n], A.T @ right, atol=1e-12)
    assert_allclose(rest, ((A @ best - right) ** 2).sum())
    for j in (0, 1, 3):
        left = A[:, j] - A[:, :j] @ np.linalg.lstsq(A[:, :j], A[:, j])[0]
        assert_allclose(kernels.independence(factor, j), np.linalg.norm(left) / np.linalg.norm(A[:, j]))
    assert kernels.independence(factor, 2) == 0
    kernels.substituted(factor, n, 2)
    assert_allclose(factor[n, :2], np.linalg.solve(R[:2, :2], factor[:2, n]))


@pytest.mark.parametrize("form", [(1.0, 0.3, 2.0), (2.0, -0.4, 1.0), (1.0, 0.5, 1.0), (3.0, 0.0, 1.0)])
def test_a_quadratic_form_is_greatest_in_its_principal_direction(form):
    a, b, c = form
    mean, amplitude, x, y = kernels.principal(a, b, c)
    assert_allclose([mean - amplitude, mean + amplitude], np.linalg.eigvalsh([[a, b], [b, c]]))
    assert_allclose([a * x * x + 2 * b * x * y + c * y * y, x * x + y * y], [mean + amplitude, 1])


@pytest.mark.parametrize("scales", [(1, 1), (1, 2, 1e-4), (1, 0, 3), (4, 3, 2, 1)])
def test_axes_make_a_matrix_diagonal(scales):
    n = len(scales)
    matrix = SIX[:n, :n] * scales
    matrix = matrix.T @ matrix
    found, axes = matrix.copy(), np.full((n, n), np.nan)
    kernels.diagonalize(found, axes, n)
    assert_allclose(axes.T @ axes, np.eye(n), atol=1e-14)
    assert_allclose(axes.T @ matrix @ axes, np.diag(found.diagonal()), atol=1e-13)
    assert_allclose(np.sort(found.diagonal()), np.linalg.eigvalsh(matrix), atol=1e-13)
