"""Safe vertex moves: penalties and crossings against naive references, and that neither increases."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from simplexmesh.mesh import shapes
from simplexmesh.mesh.check import misoriented
from simplexmesh.mesh.decimation import _kernels_fans as fans
from simplexmesh.mesh.decimation import _kernels_guard as guard
from simplexmesh.mesh.decimation.fitting import faces_of
from simplexmesh.mesh.decimation.guarding import Guard
from simplexmesh.mesh.face_geometry import face_normals
from simplexmesh.mesh.triangles import _kernels_intersection as crossing
from simplexmesh.mesh.triangles.self_intersection import overlapping_boxes, self_intersections
from tests.mesh.decimation.reference import shaken
from tests.mesh.operators.test_editing import MESHES

names = st.sampled_from(["sphere", "torus", "plane", "cylinder", "torus with holes"])
seeds = st.integers(0, 2**16)
BOUNDS, NO_LIMIT = guard.Bounds(0.05, -0.3), 2**31


def arrays(one, mesh, *, facing=False):
    """The arrays for the kernels, with all pairs of nearby faces or those that face each other."""
    solid = np.flatnonzero(~mesh.connectivity.face_is_hole)
    pairs = np.concatenate([one._near_pairs(mesh), np.stack([solid, solid], axis=1)])
    return one._moving(mesh, one._facing_pairs(mesh) if facing else pairs)


def moving(mesh, seed=0):
    """A guard of a mesh and its arrays for the kernels, with random target normals, unknown for half of the faces."""
    c = mesh.connectivity
    rng = np.random.default_rng(seed)
    target_normals = rng.normal(size=(len(c.face_sizes), 3))
    target_normals /= np.linalg.norm(target_normals, axis=1, keepdims=True)
    target_normals[rng.random(len(target_normals)) < 0.5] = 0
    one = Guard(mesh, faces_of(c), target_normals, np.ones(mesh.n_vertices, bool))
    return one, arrays(one, mesh)


def naive_penalty(mesh, target_normals, i, bounds):
    """The penalty around a vertex, from the normals of the mesh."""
    c, v, n = mesh.connectivity, mesh.vertices, mesh.normals
    cosine = lambda a, b: a @ b / np.linalg.norm(a) / np.linalg.norm(b)  # noqa: E731
    wrong = lambda x: max(bounds.mutual - x, 0) + (x < 0)  # noqa: E731
    loops = np.split(c.face_vertices, c.face_offsets[1:-1])
    vectors = np.zeros((len(loops), 3))
    touched = set(c.vertex_faces[[i, *c.neighbors[i]]].ravel().tolist())
    total = 0.0
    for f in touched - set(np.flatnonzero(c.face_is_hole).tolist()):
        corners = v[loops[f]]
        for p, q in zip(loops[f], np.roll(loops[f], -1), strict=True):
            t = np.cross(v[q] - v[p], corners.mean(axis=0) - v[p])
            vectors[f] += t
            total += wrong(cosine(t, n[p] + n[q]))
            if target_normals[f].any():
                total += max(bounds.target - cosine(t, target_normals[f]), 0)
    return total + sum(wrong(cosine(n[j], vectors[c.vertex_faces[j]].sum(axis=0))) for j in (i, *c.neighbors[i]))


@settings(max_examples=10)
@given(name=names, seed=seeds, size=st.sampled_from([0.3, 1.0]))
def test_penalties_equal_the_naive_reference(name, seed, size):
    mesh = shaken(MESHES[name], seed, size)
    _, g = moving(mesh, seed)
    rng = np.random.default_rng(seed)
    v = np.array(mesh.vertices)
    for i in rng.choice(mesh.n_vertices, 5, replace=False).tolist():
        v[i] += 0.1 * rng.normal(size=3)
        guard.move_vertex(g, i, tuple(v[i]))
        moved = mesh.moved(v)
        assert_allclose(g.normals, moved.normals, atol=1e-9)
        assert_allclose(g.points, moving(moved)[1].points, atol=1e-12)
        total = naive_penalty(moved, g.target_normals, i, BOUNDS)
        assert_allclose(guard.local_penalty(g, i, BOUNDS, np.inf), total, atol=1e-6)
        for most in (total / 2, total + 1e-3):
            assert (guard.local_penalty(g, i, BOUNDS, most) > most) == (total > most)


def test_candidates_are_means_of_neighbors_and_steps_both_ways_along_all_axes():
    mesh = shaken(MESHES["sphere"], 0, 0.3)
    _, g = moving(mesh)
    start, best, size = tuple(mesh.vertices[5]), (1.0, 2.0, 3.0), 0.7
    found = np.array([guard.candidate(g, 5, k, start, best, size) for k in range(guard.N_CANDIDATES)])
    middle = mesh.vertices[mesh.neighbors[5]].mean(axis=0)
    assert_allclose(found[:2], [middle, (middle + start) / 2], atol=1e-12)
    steps = np.kron([[guard.LARGE_STEP], [guard.SMALL_STEP]], np.kron(np.eye(3), [[1], [-1]]))
    assert_allclose(found[2:], best + size * steps, atol=1e-12)


def test_triangles_without_area_count_as_reversed():
    ball = shapes.sphere(3)
    point, c = ball.moved(np.ones_like(ball.vertices)), ball.connectivity
    unknown = np.zeros((len(c.face_sizes), 3))
    g = arrays(Guard(point, faces_of(c), unknown, np.ones(ball.n_vertices, bool)), point)
    corners = c.face_sizes[np.unique(c.vertex_faces[[0, *c.neighbors[0]]])].sum()
    assert guard.local_penalty(g, 0, BOUNDS, np.inf) == pytest.approx((corners + 4) * (BOUNDS.mutual + 2))


@settings(max_examples=8)
@given(name=names, seed=seeds, size=st.sampled_from([0.5, 2.0]))
def test_crossings_are_those_of_the_mesh(name, seed, size):
    mesh = shaken(MESHES[name], seed, size)
    _, g = moving(mesh)
    pairs, beside = self_intersections(mesh.vertices, mesh.connectivity), mesh.connectivity.vertex_faces.tolist()
    assert_array_equal(np.flatnonzero(g.crossed), np.unique(pairs))
    for i in range(0, mesh.n_vertices, 7):
        assert (fans.crossings(g, i, NO_LIMIT) > 0) == any(set(pair) & set(beside[i]) for pair in pairs.tolist())


def triangles_of(g, f):
    """The triangles of a fan."""
    corners = range(g.faces.offsets[f], g.faces.offsets[f + 1])
    return [np.array([g.faces.vertices[c], g.faces.ahead[c], len(g.normals) + f], np.int64) for c in corners]


def naive_crossings(g, i):
    """The number of crossing pairs of triangles around a vertex, from all pairs of nearby faces."""
    near = {
        (min(f, other), max(f, other))
        for f in g.vertex_faces[i].tolist()
        for other in g.near[g.offsets[f] : g.offsets[f + 1]].tolist()
    }
    return sum(
        crossing.triangles_cross(g.points, s, t)
        for f, other in near
        for k, s in enumerate(triangles_of(g, f))
        for t in triangles_of(g, other)[k + 1 if f == other else 0 :]
    )


@settings(max_examples=10)
@given(name=names, seed=seeds, size=st.sampled_from([0.5, 1.0]), step=st.sampled_from([0.02, 0.2]))
def test_crossings_are_counted_after_any_moves(name, seed, size, step):
    mesh = shaken(MESHES[name], seed, size)
    _, g = moving(mesh)
    rng = np.random.default_rng(seed)
    for i in rng.choice(mesh.n_vertices, 12).tolist():
        guard.move_vertex(g, i, tuple(g.points[i] + step * rng.normal(size=3)))
        total = naive_crossings(g, i)
        assert fans.crossings(g, i, NO_LIMIT) == total
        assert all((fans.crossings(g, i, most) > most) == (total > most) for most in range(total + 2))


def test_a_vertex_that_pierces_the_wall_behind_is_seen():
    ball = shapes.sphere(8)
    thin = ball.moved(ball.vertices * (1, 1, 0.015))
    g = moving(thin)[1]
    assert not g.crossed.any()
    pierced = []
    for i in np.flatnonzero((np.abs(thin.vertices[:, 0]) < 0.3) & (thin.vertices[:, 2] > 0.01)).tolist():
        x, y, z = g.points[i]
        for fraction in (0.5, 1.5, 2.2, 3.0):
            guard.move_vertex(g, i, (x, y, (1 - fraction) * z))
            seen = fans.crossings(g, i, NO_LIMIT)
            assert seen == naive_crossings(g, i)
        pierced.append(seen > 0)
        guard.move_vertex(g, i, (x, y, z))
    assert sum(pierced) > 10


def test_holes_are_near_nothing():
    mesh = MESHES["torus with holes"]
    g = moving(mesh)[1]
    hole = mesh.connectivity.face_is_hole
    assert not hole[g.near].any()
    assert (np.diff(g.offsets)[hole] == 0).all()
    assert all(f in g.near[g.offsets[f] : g.offsets[f + 1]] for f in np.flatnonzero(~hole))


def test_facing_faces_are_opposed_and_not_adjacent():
    thin = shapes.sphere(8).moved(shapes.sphere(8).vertices * (1, 1, 0.015))
    c, one = thin.connectivity, moving(thin)[0]
    normals = face_normals(thin.vertices, c.face_vertices, c.face_offsets)
    near, facing = ({tuple(p) for p in pairs.tolist()} for pairs in (one._near_pairs(thin), one._facing_pairs(thin)))
    beside = {tuple(sorted(p)) for p in c.edge_faces.tolist()}
    assert facing == {(f, o) for f, o in near - beside if normals[f] @ normals[o] <= 0}
    assert len(facing) > 100


@given(seed=seeds)
def test_overlapping_boxes_are_those_of_all_pairs(seed):
    rng = np.random.default_rng(seed)
    low = rng.uniform(0, 1, (30, 3))
    high = low + rng.uniform(0, 0.3, (30, 3))
    pairs = {tuple(pair) for pair in overlapping_boxes(low, high, 0.2).tolist()}
    assert pairs == {
        (i, j) for j in range(30) for i in range(j) if (low[i] <= high[j]).all() and (low[j] <= high[i]).all()
    }


@settings(max_examples=8)
@given(name=names, seed=seeds)
def test_moves_create_no_folds(name, seed):
    mesh = MESHES[name]
    target_normals = np.zeros((len(mesh.connectivity.face_sizes), 3))
    free = np.random.default_rng(seed).random(mesh.n_vertices) < 0.9
    one = Guard(mesh, faces_of(mesh.connectivity), target_normals, free)
    moved = mesh
    for k in range(3):
        moved = moved.moved(one.advanced(moved, shaken(mesh, seed + k, 3.0).vertices, -2.0))
    assert not misoriented(moved)[1].any()
    assert_array_equal(moved.vertices[~free], mesh.vertices[~free])
    assert np.abs(moved.vertices - mesh.vertices).max() > 0


def naively_advanced(one, mesh, target, max_step, bounds):
    """The vertices, each moved with repeated halving until nothing is worse, everything recomputed each time."""
    for i in range(mesh.n_vertices):
        start = arrays(one, mesh)
        wrong, crossed = naive_penalty(mesh, start.target_normals, i, bounds), naive_crossings(start, i)
        step = target[i] - mesh.vertices[i]
        fraction = min(1.0, max_step / np.linalg.norm(step))
        for _ in range(3):
            v = np.array(mesh.vertices)
            v[i] += fraction * step
            moved = mesh.moved(v)
            there = arrays(one, moved)
            worse = naive_penalty(moved, there.target_normals, i, bounds) > wrong + guard.TOLERANCE
            if not worse and naive_crossings(there, i) <= crossed:
                mesh = moved
                break
            fraction /= 2
    return mesh.vertices


@settings(max_examples=2)
@given(seed=seeds, size=st.sampled_from([0.3, 0.8]))
def test_vertices_move_as_far_as_in_the_naive_reference(seed, size):
    mesh = shaken(shapes.sphere(2), seed, size)
    one, g = moving(mesh, seed)
    target = shaken(mesh, seed + 1, 0.5).vertices
    guard.advance(g, target, 0.1, 3, BOUNDS)
    assert_allclose(g.points[: len(target)], naively_advanced(one, mesh, target, 0.1, BOUNDS), atol=1e-9)


def test_walls_do_not_pass_each_other():
    ball = shapes.sphere(8)
    thin = moved = ball.moved(ball.vertices * (1, 1, 0.015))
    target = np.where(thin.vertices[:, 2:] > 0, thin.vertices * (1, 1, -3), thin.vertices)
    for _ in range(5):
        g = moving(moved)[1]
        guard.advance(g, target, 0.008, 5, guard.Bounds(0.05, -2.0))
        moved = moved.moved(g.points[: len(target)])
    assert len(self_intersections(moved.vertices, thin.connectivity)) == 0
    assert (thin.vertices[:, 2] - moved.vertices[:, 2] > 0.01).sum() > 300


def test_a_target_that_folds_nothing_is_reached():
    ball = shapes.sphere(8)
    c = ball.connectivity
    one = Guard(ball, faces_of(c), np.zeros((len(c.face_sizes), 3)), np.ones(ball.n_vertices, bool))
    assert_allclose(one.advanced(ball, 1.01 * ball.vertices, -2.0), 1.01 * ball.vertices, atol=1e-12)


@pytest.mark.parametrize("size", [1.0, 1.5])
def test_folds_and_crossings_are_undone(size):
    mesh = shaken(shapes.sphere(8), 3, size)
    c = mesh.connectivity
    assert not mesh.check(self_intersections=True)
    one = Guard(mesh, faces_of(c), np.zeros((len(c.face_sizes), 3)), np.ones(mesh.n_vertices, bool))
    for _ in range(3):
        mesh = mesh.moved(one.untangled(mesh, 0.1, -2.0))
    assert mesh.check(self_intersections=True)
