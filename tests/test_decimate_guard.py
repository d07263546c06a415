"""Safe vertex moves: penalties and crossings against naive references, and that neither increases."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from simplexmesh.mesh import _kernels_crossing as crossing
from simplexmesh.mesh import _kernels_fans as fans
from simplexmesh.mesh import _kernels_guard as guard
from simplexmesh.mesh import _kernels_untangle as untangling
from simplexmesh.mesh import shapes
from simplexmesh.mesh.check import misoriented
from simplexmesh.mesh.fitting import faces_of
from simplexmesh.mesh.guarding import Guard
from simplexmesh.mesh.self_intersection import self_intersections
from tests.reference_decimate import shaken
from tests.test_mesh_editing import MESHES

names = st.sampled_from(["sphere", "torus", "plane", "cylinder", "torus with holes"])
seeds = st.integers(0, 2**16)
BOUNDS, NO_LIMIT = guard.Bounds(0.05, -0.3), 2**31


@settings(max_examples=200)
@given(seed=seeds, size=st.sampled_from([3, 5, 20]), turns=st.sampled_from([1, 2]), rough=st.sampled_from([0.1, 0.7]))
def test_a_fan_that_winds_once_does_not_cross_itself(seed, size, turns, rough):
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * turns * np.arange(size) / size
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1) + rough * rng.normal(size=(size, 3))
    points = np.concatenate([ring, ring.mean(axis=0)[None]]) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    vertices = np.arange(size, dtype=np.int32)
    ahead = np.roll(vertices, -1)
    once = crossing.winds_once(points, vertices, ahead, 0, size, size, np.empty((3, 3)))
    local = points - points[size]
    vector = np.cross(local[vertices], local[ahead])
    total = vector.sum(axis=0) / np.linalg.norm(vector.sum(axis=0))
    one, two = local[vertices], local[ahead]
    turned = np.arctan2(vector @ total, (one * two).sum(axis=1) - (one @ total) * (two @ total))
    assert once == ((vector @ total > 0).all() and np.isclose(turned.sum(), 2 * np.pi))
    if once:
        triangles = np.stack([vertices, ahead, np.full(size, size)], axis=1).astype(np.int64)
        pairs = [(a, b) for a in triangles for b in triangles]
        assert not any(crossing.triangles_cross(points, a, b) for a, b in pairs)


def moving(mesh, seed=0, max_dot=2.0):
    """A guard of a mesh and its arrays for the kernels, with random target normals, unknown for half of the faces."""
    c = mesh.connectivity
    rng = np.random.default_rng(seed)
    target_normals = rng.normal(size=(len(c.face_sizes), 3))
    target_normals /= np.linalg.norm(target_normals, axis=1, keepdims=True)
    target_normals[rng.random(len(target_normals)) < 0.5] = 0
    one = Guard(mesh, faces_of(c), target_normals, np.ones(mesh.n_vertices, bool))
    return one, one._moving(mesh, max_dot)[0]


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


@settings(max_examples=10, deadline=None)
@given(name=names, seed=seeds, size=st.sampled_from([0.3, 1.0]))
def test_penalties_equal_the_naive_reference(name, seed, size):
    mesh = shaken(MESHES[name], seed, size)
    _, g = moving(mesh, seed)
    rng, workspace = np.random.default_rng(seed), np.empty((6, 3))
    v = np.array(mesh.vertices)
    for i in rng.choice(mesh.n_vertices, 5, replace=False).tolist():
        v[i] += 0.1 * rng.normal(size=3)
        guard.move_vertex(g, i, *v[i])
        moved = mesh.moved(v)
        assert_allclose(g.normals, moved.normals, atol=1e-9)
        assert_allclose(g.points, Guard._moving(moving(moved)[0], moved, 2.0)[0].points, atol=1e-12)
        total = naive_penalty(moved, g.target_normals, i, BOUNDS)
        assert_allclose(guard.local_penalty(g, i, BOUNDS, workspace, np.inf), total, atol=1e-6)
        for most in (total / 2, total + 1e-3):
            assert (guard.local_penalty(g, i, BOUNDS, workspace, most) > most) == (total > most)


@settings(max_examples=8, deadline=None)
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


@settings(max_examples=10, deadline=None)
@given(name=names, seed=seeds, size=st.sampled_from([0.5, 1.0]), step=st.sampled_from([0.02, 0.2]))
def test_crossings_are_counted_after_any_moves(name, seed, size, step):
    mesh = shaken(MESHES[name], seed, size)
    _, g = moving(mesh)
    rng = np.random.default_rng(seed)
    for i in rng.choice(mesh.n_vertices, 12).tolist():
        guard.move_vertex(g, i, *(g.points[i] + step * rng.normal(size=3)))
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
            guard.move_vertex(g, i, x, y, (1 - fraction) * z)
            seen = fans.crossings(g, i, NO_LIMIT)
            assert seen == naive_crossings(g, i)
        pierced.append(seen > 0)
        guard.move_vertex(g, i, x, y, z)
    assert sum(pierced) > 10


@settings(max_examples=10, deadline=None)
@given(name=names, seed=seeds, size=st.sampled_from([0.2, 1.0]))
def test_a_gap_is_no_wider_than_faces_are_apart(name, seed, size):
    _, g = moving(shaken(MESHES[name], seed, size))
    rng = np.random.default_rng(seed)
    for f in rng.choice(np.flatnonzero(~g.faces.hole), 5).tolist():
        for other in set(g.near[g.offsets[f] : g.offsets[f + 1]].tolist()) - {f}:
            gap = fans.gap_between(g, f, other)
            s, t = triangles_of(g, f), triangles_of(g, other)
            shared = len(set(np.ravel(s)) & set(np.ravel(t)))
            if gap >= 0:
                assert not any(crossing.triangles_cross(g.points, a, b) for a in s for b in t)
                parts = rng.dirichlet([0.3] * 3, (20, 2))
                one = [part[0] @ g.points[s[k % len(s)]] for k, part in enumerate(parts)]
                two = [part[1] @ g.points[t[k % len(t)]] for k, part in enumerate(parts)]
                assert gap <= np.linalg.norm(np.subtract(one, two), axis=-1).min() + 1e-12
            assert gap == -1 or (gap == 0) == (shared > 0)


@pytest.mark.parametrize("name", ["sphere", "torus", "plane"])
def test_a_plane_is_found_between_smooth_faces(name):
    _, g = moving(MESHES[name])
    pairs = [(f, o) for f in range(len(g.travel)) for o in g.near[g.offsets[f] : g.offsets[f + 1]].tolist() if o != f]
    assert len(pairs) > 50
    assert all(fans.gap_between(g, f, other) >= 0 for f, other in pairs)


def test_holes_are_near_nothing(monkeypatch):
    mesh, counts, overlapping_boxes = MESHES["torus with holes"], [], untangling.overlapping_boxes
    monkeypatch.setattr(
        untangling, "overlapping_boxes", lambda low, *rest: (counts.append(len(low)), overlapping_boxes(low, *rest))[1]
    )
    g = moving(mesh)[1]
    hole = mesh.connectivity.face_is_hole
    assert counts == [mesh.n_faces]  # each hole would be near each other one, wherever they are
    assert not hole[g.near].any()
    assert (np.diff(g.offsets)[hole] == 0).all()
    assert all(f in g.near[g.offsets[f] : g.offsets[f + 1]] for f in np.flatnonzero(~hole))


@settings(max_examples=20)
@given(seed=seeds, max_dot=st.sampled_from([0.0, 2.0]))
def test_overlapping_boxes_are_those_of_all_pairs(seed, max_dot):
    rng = np.random.default_rng(seed)
    low = rng.uniform(0, 1, (30, 3))
    high = low + rng.uniform(0, 0.3, (30, 3))
    normals = rng.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets, near = untangling.overlapping_boxes(low, high, normals, max_dot, np.zeros(3), 0.2, np.array([7, 7, 7]))
    for i in range(30):
        expected = (low <= high[i]).all(axis=1) & (high >= low[i]).all(axis=1) & (normals @ normals[i] <= max_dot)
        assert set(near[offsets[i] : offsets[i + 1]]) == set(np.flatnonzero(expected))


@settings(max_examples=8, deadline=None)
@given(name=names, seed=seeds)
def test_moves_create_no_folds(name, seed):
    mesh = MESHES[name]
    target_normals = np.zeros((len(mesh.connectivity.face_sizes), 3))
    free = np.random.default_rng(seed).random(mesh.n_vertices) < 0.9
    one = Guard(mesh, faces_of(mesh.connectivity), target_normals, free)
    moved = mesh
    for k in range(3):
        moved = moved.moved(one.advanced(moved, shaken(mesh, seed + k, 3.0).vertices, -2.0))
    assert not misoriented(moved.vertices, mesh.connectivity)[1].any()
    assert_array_equal(moved.vertices[~free], mesh.vertices[~free])
    assert np.abs(moved.vertices - mesh.vertices).max() > 0


def naively_advanced(one, mesh, target, max_step, bounds):
    """The vertices, each moved with repeated halving until nothing is worse, everything recomputed each time."""
    for i in range(mesh.n_vertices):
        start = one._moving(mesh, 2.0)[0]
        wrong, crossed = naive_penalty(mesh, start.target_normals, i, bounds), naive_crossings(start, i)
        step = target[i] - mesh.vertices[i]
        fraction = min(1.0, max_step / np.linalg.norm(step))
        for _ in range(3):
            v = np.array(mesh.vertices)
            v[i] += fraction * step
            moved = mesh.moved(v)
            there = one._moving(moved, 2.0)[0]
            worse = naive_penalty(moved, there.target_normals, i, bounds) > wrong + guard.TOLERANCE
            if not worse and naive_crossings(there, i) <= crossed:
                mesh = moved
                break
            fraction /= 2
    return mesh.vertices


@settings(max_examples=3, deadline=None)
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
