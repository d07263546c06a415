"""Parts of reconstruction: surface points of volumes, primitives around points, untangling."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.motion.model.untangle import Tangles, untangled
from simplexmesh.motion.reconstruct.conversion import otsu_threshold
from simplexmesh.motion.start.grid_crossings import outer_crossings
from simplexmesh.motion.start.primitives import primitive_around, principal_frame
from simplexmesh.motion.targets.triangles import inside_surface
from tests.nightly.marks import nightly


def test_crossings_are_the_outer_ones():
    axis = np.arange(-9, 10.0)
    r = np.sqrt(axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2)
    hollow = sm.Volume(np.minimum(7.2 - r, r - 3.1), origin=(-9, -9, -9))
    points = outer_crossings(hollow, 0.0)
    assert_allclose(np.linalg.norm(points, axis=1), 7.2, atol=0.05)
    cut = sm.Volume(hollow.values[9:], origin=(0, -9, -9))
    flat = outer_crossings(cut, 0.0)
    on_cut = flat[:, 0] == -0.5  # the object ends half a voxel beyond the border
    assert on_cut.sum() > 100
    radius = np.linalg.norm(flat[~on_cut & (flat[:, 0] > 0)], axis=1)
    assert np.minimum(np.abs(radius - 7.2), np.abs(radius - 3.1)).max() < 0.05  # the cut opens the cavity
    assert len(outer_crossings(hollow, 99.0)) == 0


@pytest.mark.parametrize("kind", [np.int8, np.uint8, np.int16, np.uint16])
def test_otsu_of_whole_numbers_is_that_of_the_same_floats(kind):
    limits = np.iinfo(kind)
    heaps = np.random.default_rng(0).integers(limits.min, limits.min + 9, (9, 8, 7)).astype(kind)
    heaps[:4] = limits.max
    assert otsu_threshold(heaps) == otsu_threshold(heaps.astype(float))


def test_otsu_splits_two_heaps():
    rng = np.random.default_rng(0)
    heaps = np.concatenate([rng.normal(10, 1, 4000), rng.normal(30, 2, 1000)])
    assert 13 < otsu_threshold(heaps) < 25


def test_principal_frames_are_right_handed_and_primitives_enclose():
    rng = np.random.default_rng(2)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = rng.uniform(-1, 1, (2000, 3)) * [5, 3, 1] @ turn + [1, 2, 3]
    center, axes = principal_frame(points)
    assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) > 0
    assert_allclose(np.ptp((points - center) @ axes.T, axis=0), [10, 6, 2], rtol=0.04)
    for kind in ("sphere", "ellipsoid"):
        surface = primitive_around(points, kind, 2000).triangulated()
        assert inside_surface(points, surface.vertices, surface.faces).all()
    assert np.ptp(primitive_around(points, "plane", 500).vertices @ axes.T, axis=0)[:2].max() < 10.5
    square = rng.uniform(-1, 1, (2000, 3)) * [1, 1, 0.01]
    assert primitive_around(square, "plane", 500).area < 4.5  # not 8, as for a square rotated by 45 degrees
    up = axes[2]
    for sign in (1, -1):
        sheet = primitive_around(points, "plane", 500, facing=sign * up)
        assert (sheet.normals @ (sign * up)).min() > 0.99


def test_a_fold_is_smoothed_away_and_the_rest_stays():
    ball = sm.sphere(8)
    vertices = np.array(ball.vertices)
    pushed = np.linalg.norm(vertices - [0, 0, 1], axis=1) < 0.15
    vertices[pushed] -= [0, 0, 2.3]  # through the opposite side
    torn = ball.moved(vertices)
    assert tangled_vertices(torn).sum() > 5

    class Sphere:
        def gap(self, vertices, normals, reach):
            gap = 1 - np.linalg.norm(vertices, axis=1)
            return np.where(np.abs(gap) < reach, gap, np.nan)

    tangles = untangled(Tangles(torn), Sphere(), reach=0.3)
    mended, left = tangles.mesh, tangles.count
    assert left == 0
    assert mended.check(self_intersections=True).ok
    far = np.linalg.norm(ball.vertices - [0, 0, 1], axis=1) > 1.2
    far &= np.linalg.norm(ball.vertices - [0, 0, -1], axis=1) > 1.2
    assert_array_equal(mended.vertices[far], ball.vertices[far])


def test_remaining_tangles_are_blended_with_the_start():
    """Data that pulls two sides of a ball through each other defeats relaxation; blending with the start helps."""
    ball = sm.sphere(8)
    vertices = np.array(ball.vertices)
    polar = np.abs(vertices[:, 2]) > 0.9
    vertices[polar, 2] *= -0.6

    class Crossed:
        def gap(self, vertices, normals, reach):
            return np.where(np.abs(vertices[:, 2]) < 0.7, -2.0 * np.ones(len(vertices)), np.nan)

    torn = ball.moved(vertices)
    without = untangled(Tangles(torn), Crossed(), reach=9.0, rounds=2).count
    tangles = untangled(Tangles(torn), Crossed(), reach=9.0, rounds=2, start=ball)
    mended, left = tangles.mesh, tangles.count
    assert without > 0
    assert left == 0
    assert mended.check(self_intersections=True).ok


def test_attempts_that_diverge_are_not_told():
    """They would be many, and of vertices of a piece: how many are left tangled is told in the end."""
    ball = sm.sphere(3)
    torn = Tangles(ball.moved(np.where(np.arange(ball.n_vertices)[:, None] == 0, -1.5, 1.0) * ball.vertices))

    class Runaway:
        def gap(self, vertices, normals, reach):
            return np.full(len(vertices), 1e9)

    assert torn.count
    assert untangled(torn, Runaway(), reach=9.0) is torn


def test_a_region_that_cannot_be_untangled_stays_while_others_are():
    """Two balls with a fold each: around one, the data pulls all freed vertices through the other side."""
    ball = sm.sphere(8).triangulated()
    both = sm.dual((np.concatenate([ball.vertices, ball.vertices + np.array([9.0, 0, 0])]),
                    np.concatenate([ball.faces, ball.faces + len(ball.vertices)])))  # fmt: skip
    vertices = np.array(both.vertices)
    right = vertices[:, 0] > 5
    middle = np.where(right[:, None], [9.0, 0, 0], 0.0)
    pushed = np.linalg.norm(vertices - middle - [0, 0, 1], axis=1) < 0.15
    vertices[pushed] -= [0, 0, 2.3]
    torn = both.moved(vertices)

    class Data:
        def gap(self, vertices, normals, reach):
            return np.where(vertices[:, 0] > 4.5, 1 - np.linalg.norm(vertices - [9.0, 0, 0], axis=1), -5.0)

    tangles = untangled(Tangles(torn), Data(), reach=9.0)
    mended, left = tangles.mesh, tangles.count
    assert left == tangled_vertices(torn)[~right].sum()
    assert not tangled_vertices(mended)[right].any()
    assert_array_equal(mended.vertices[~right], torn.vertices[~right])
    away = 1 - np.linalg.norm(mended.vertices[right] - [9, 0, 0], axis=1)
    assert np.sqrt((away**2).mean()) < 0.0025  # the untangled part is back on the data


def test_untangling_leaves_an_untangled_mesh_unchanged():
    ball = sm.sphere(6)
    tangles = untangled(Tangles(ball), sm.targets.Triangles(sm.sphere(9, radius=1.1).triangulated()), reach=0.5)
    mended, left = tangles.mesh, tangles.count
    assert mended is ball
    assert left == 0


@pytest.mark.parametrize("init", ["sphere", *nightly("ellipsoid")])
@pytest.mark.parametrize("vertices", [20, *nightly(50)])
def test_primitives_of_very_few_vertices_do_not_collapse(init, vertices):
    egg = sm.sphere(16).vertices * [3, 2, 1]
    model = sm.reconstruct(egg, vertices=vertices, init=init, creases="none")
    assert 0.6 * vertices <= model.mesh.n_vertices <= 1.1 * vertices
    assert model.mesh.volume > 10
    assert model.tangled == 0
