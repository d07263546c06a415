"""Lattices tile their rectangles and polyhedra without gaps; numbers of cells are the best of all."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simplexmesh.mesh import lattices, resolution, shapes


def signed_areas(uv, triangles, period=None):
    """Of triangles in the plane, whose corners may be a period away from each other."""
    off = uv[triangles[:, 1:]] - uv[triangles[:, :1]]
    if period is not None:
        off -= np.array(period) * np.rint(off / np.where(period, period, 1.0))
    return (off[:, 0, 0] * off[:, 1, 1] - off[:, 0, 1] * off[:, 1, 0]) / 2


def edges_of(triangles):
    """How often each undirected edge occurs, having seen that none is traversed twice in one direction."""
    directed = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    assert len(np.unique(directed, axis=0)) == len(directed)
    return np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)


@pytest.mark.parametrize("name", lattices.BASES)
def test_polyhedra_are_regular_and_look_out(name):
    corners, faces = lattices.polyhedron(name)
    edges, times = edges_of(faces)
    assert (times == 2).all()
    assert_allclose(np.linalg.norm(corners, axis=1), 1)
    lengths = np.linalg.norm(corners[edges[:, 0]] - corners[edges[:, 1]], axis=1)
    assert_allclose(lengths, lengths[0])
    assert len(corners) - len(edges) + len(faces) == 2
    assert (np.linalg.det(corners[faces]) > 0).all()


@pytest.mark.parametrize("f", [1, 2, 3, 7])
def test_a_triangle_is_divided_into_equal_ones(f):
    corners = np.array([[0.0, 0, 0], [2, 0, 0], [0.5, 1, 0]])
    points, triangles = lattices.subdivided(corners, np.array([[0, 1, 2]]), f)
    assert len(points) == (f + 1) * (f + 2) // 2
    assert_allclose(signed_areas(points[:, :2], triangles), 1 / f**2)
    edges, times = edges_of(triangles)
    assert (times == 1).sum() == 3 * f
    assert len(points) - len(edges) + len(triangles) == 1


@pytest.mark.parametrize(("around", "along"), [(3, 1), (5, 2), (6, 5)])
def test_a_strip_goes_around_without_gaps(around, along):
    uv, triangles = lattices.strip(around, along)
    assert len(uv) == around * (along + 1)
    assert len(np.unique(uv, axis=0)) == len(uv)
    assert_allclose(signed_areas(uv, triangles, (1.0, 0.0)), 0.5 / (around * along))
    edges, times = edges_of(triangles)
    rim = np.unique(edges[times == 1])
    assert sorted(set(uv[rim, 1])) == [0, 1]
    assert (times == 1).sum() == len(rim) == 2 * around
    assert len(uv) - len(edges) + len(triangles) == 0
    valence = np.bincount(edges.ravel())
    assert (valence[np.setdiff1d(np.arange(len(uv)), rim)] == 6).all()
    here = uv[edges]
    assert_allclose(np.abs(here[:, 0, 1] - here[:, 1, 1])[times == 1], 0)
    apart = np.abs(here[:, 0, 0] - here[:, 1, 0])
    across = here[:, 0, 1] != here[:, 1, 1]
    assert_allclose(np.minimum(apart, 1 - apart)[across], 0.5 / around)  # each row is shifted by half a cell


@pytest.mark.parametrize(("across", "along"), [(2, 2), (3, 4), (5, 3)])
def test_a_sheet_fills_the_square(across, along):
    uv, triangles = lattices.sheet(across, along)
    areas = signed_areas(uv, triangles)
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(1)
    assert set(areas.round(9)) == {round(0.5 / (across * along), 9), round(0.25 / (across * along), 9)}
    edges, times = edges_of(triangles)
    rim = np.unique(edges[times == 1])
    on_border = ((uv == 0) | (uv == 1)).any(axis=1)
    assert np.flatnonzero(on_border).tolist() == rim.tolist()
    assert len(uv) - len(edges) + len(triangles) == 1
    for corner in product((0, 1), repeat=2):
        assert (uv == corner).all(axis=1).sum() == 1


@pytest.mark.parametrize(("around", "across"), [(3, 4), (5, 6)])
def test_six_triangles_meet_at_every_point_of_a_tube(around, across):
    uv, triangles = lattices.tube(around, across)
    assert len(uv) == around * across
    assert_allclose(signed_areas(uv, triangles, (1.0, 1.0)), 0.5 / len(uv))
    assert (edges_of(triangles)[1] == 2).all()
    assert (np.bincount(triangles.ravel()) == 6).all()


@pytest.mark.parametrize("wanted", [4, 7, 29, 30, 50, 233, 1280, 5000])
def test_the_frequency_and_the_base_are_the_nearest(wanted):
    nearest = {n: min(range(1, 60), key=lambda f: abs(n * f * f - wanted)) for n in (20, 8, 4)}
    for n, f in nearest.items():
        assert abs(n * resolution.frequency(None, wanted, n) ** 2 - wanted) == abs(n * f * f - wanted)
    off = {n: abs(n * f * f - wanted) for n, f in nearest.items()}
    base = 20 if off[20] <= 0.1 * wanted else min(off, key=off.__getitem__)
    names = {20: "icosahedron", 8: "octahedron", 4: "tetrahedron"}
    assert resolution.base_for(wanted, shapes.TRIANGLES) == names[base]


def test_the_usual_number_of_vertices():
    assert resolution.frequency(None, None, 20) ** 2 * 20 == resolution.DEFAULT_VERTICES
    assert resolution.frequency(7, None, 20) == 7
    with pytest.raises(ValueError, match="frequency must be at most 2236, not 2237"):
        resolution.frequency(2237, None, 20)


@pytest.mark.parametrize("grid", [shapes.CYLINDER, shapes.PLANE, shapes.TORUS], ids=lambda grid: grid.first)
@pytest.mark.parametrize("wanted", [30, 200, 777])
@pytest.mark.parametrize("aspect", [0.4, 1.0, 3.0])
def test_cells_are_the_best_of_all(grid, wanted, aspect):
    """By the number of vertices, of which 3 % count as much as edges off by a factor of e."""

    def cost(n, m):
        off = (grid.count(n, m) / wanted - 1) / 0.03
        return off**2 + abs(math.log(n / m / (aspect * math.sqrt(3) / 2)))

    pairs = product(range(grid.minimum[0], 80), range(grid.minimum[1], 80, grid.step))
    best = min(cost(*pair) for pair in pairs if grid.count(*pair) < 3 * wanted + 99)
    found = resolution.cells(grid, None, None, wanted, aspect)
    assert cost(*found) == pytest.approx(best, rel=1e-9)
    assert resolution.cells(grid, *found, None, aspect) == found
