"""Fitting: least squares against their plain telling, closest places against libigl, and moves without folds."""

from __future__ import annotations

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from simplexmesh.mesh import _kernels_crossing as crossing
from simplexmesh.mesh import _kernels_fitting as kernels
from simplexmesh.mesh import _kernels_guard as guard
from simplexmesh.mesh import _kernels_untangle as untangling
from simplexmesh.mesh import shapes
from simplexmesh.mesh.check import misoriented
from simplexmesh.mesh.fitting import Fit, Surface, faces_of
from simplexmesh.mesh.guarding import Guard
from simplexmesh.mesh.self_intersection import self_intersections
from simplexmesh.mesh.triangulation import fan
from tests.reference_decimate import shaken
from tests.test_mesh_editing import MESHES

names = st.sampled_from(["sphere", "torus", "plane", "cylinder", "torus with holes"])
seeds = st.integers(0, 2**16)
BOUNDS = guard.Bounds(0.05, -0.3)


@settings(max_examples=30)
@given(seeds)
def test_the_closest_point_of_a_triangle_is_that_of_libigl(seed):
    rng = np.random.default_rng(seed)
    p, corners, weights = rng.normal(size=3), rng.normal(size=(3, 3)), np.empty(3)
    found = kernels.closest_on_triangle(p, *corners, weights)
    squared, _, closest = igl.point_mesh_squared_distance(p[None], corners, np.array([[0, 1, 2]]))
    assert_allclose(found, squared[0])
    assert_allclose(weights @ corners, closest[0], atol=1e-9)


def problem(mesh, seed):
    """Random samples, places and weights on a mesh."""
    rng, f, n, s = np.random.default_rng(seed), faces_of(mesh.connectivity), mesh.n_vertices, 50
    corner = rng.choice(np.flatnonzero(~f.hole[f.owner]), s).astype(np.int32)
    places = kernels.Places(corner, rng.dirichlet((1, 1, 1), s))
    direction = rng.normal(size=(s, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    root = rng.normal(size=(n, 3, 3))
    terms = kernels.Terms(
        rng.normal(size=(s, 3)),
        direction,
        rng.uniform(1, 2, s),
        rng.uniform(0, 1, s),
        np.ascontiguousarray(mesh.neighbors, np.int32),
        rng.dirichlet((1, 1, 1), n),
        root @ root.transpose(0, 2, 1),
        rng.uniform(0.5, 1, n),
        rng.normal(size=(len(f.hole), 3)),
    )
    return f, places, terms


def energy(v, start, f, places, t):
    """The sum of squares, told plainly; vertices keep to where they start."""
    middle = np.array([v[f.vertices[a:b]].mean(axis=0) for a, b in zip(f.offsets, f.offsets[1:], strict=False)])
    c, w = places.corner, places.weights
    there = w[:, :1] * v[f.vertices[c]] + w[:, 1:2] * v[f.ahead[c]] + w[:, 2:] * middle[f.owner[c]]
    off = there - t.samples
    dot = (off * t.direction).sum(axis=1)
    total = (t.along * dot**2 + t.across * ((off**2).sum(axis=1) - dot**2)).sum()
    uneven = v - np.einsum("nj,njk->nk", t.share, v[t.neighbors])
    total += np.einsum("ni,nij,nj->", uneven, t.even, uneven) + (t.stay * ((v - start) ** 2).sum(axis=1)).sum()
    return total + ((t.flat[f.owner] * (v[f.vertices] - middle[f.owner])).sum(axis=1) ** 2).sum()


@settings(max_examples=5, deadline=None)
@given(name=names, seed=seeds)
def test_the_least_squares_are_least(name, seed):
    mesh = shaken(MESHES[name], seed)
    f, places, terms = problem(mesh, seed)
    v = np.array(mesh.vertices)
    gradient, middle = np.empty_like(v), np.empty((len(f.hole), 3))
    kernels.pulled(v, middle, f, places, terms, 1.0, gradient)
    step = np.random.default_rng(seed).normal(size=v.shape)
    ends = [energy(v + sign * step, v, f, places, terms) for sign in (1, -1)]
    assert_allclose((gradient * step).sum(), (ends[0] - ends[1]) / 4, atol=1e-9 * max(ends))
    best = kernels.solved(v, f, places, terms, 3000)
    least = energy(best, v, f, places, terms)
    for size in (1e-3, 1.0):
        assert energy(best + size * step, v, f, places, terms) > least
    assert energy(kernels.solved(v, f, places, terms, 5), v, f, places, terms) >= least * (1 - 1e-9)


@pytest.mark.parametrize("name", ["sphere", "torus", "plane"])
def test_samples_find_the_closest_place(name):
    mesh = MESHES[name]
    other = shaken(mesh, 0, 0.3)
    s, c = Surface.of(other), mesh.connectivity
    free, along = np.ones(mesh.n_vertices, bool), np.zeros((len(c.face_sizes), 3))
    _, largest = Fit(s, mesh, np.arange(len(c.face_sizes), dtype=np.int32), along, free).distances()
    points, triangles = fan(mesh.vertices, c)
    squared = igl.point_mesh_squared_distance(s.points, points, triangles)[0]
    if not c.n_holes:
        assert_allclose(largest, np.sqrt(squared.max()))
    assert largest >= np.sqrt(squared.max()) * (1 - 1e-9)


@settings(max_examples=200)
@given(seed=seeds, size=st.sampled_from([3, 5, 20]), turns=st.sampled_from([1, 2]), rough=st.sampled_from([0.1, 0.7]))
def test_a_fan_that_goes_around_once_does_not_cross_itself(seed, size, turns, rough):
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * turns * np.arange(size) / size
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1) + rough * rng.normal(size=(size, 3))
    points = np.concatenate([ring, ring.mean(axis=0)[None]]) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    vertices = np.arange(size, dtype=np.int32)
    ahead = np.roll(vertices, -1)
    once = crossing.round_once(points, vertices, ahead, 0, size, size, np.empty((3, 3)))
    middle = points - points[size]
    vector = np.cross(middle[vertices], middle[ahead])
    total = vector.sum(axis=0) / np.linalg.norm(vector.sum(axis=0))
    one, two = middle[vertices], middle[ahead]
    turned = np.arctan2(vector @ total, (one * two).sum(axis=1) - (one @ total) * (two @ total))
    assert once == ((vector @ total > 0).all() and np.isclose(turned.sum(), 2 * np.pi))
    if once:
        triangles = np.stack([vertices, ahead, np.full(size, size)], axis=1).astype(np.int64)
        pairs = [(a, b) for a in triangles for b in triangles]
        assert not any(crossing.triangles_cross(points, a, b) for a, b in pairs)


def guarded(mesh, seed=0, facing=2.0):
    """A guard of a mesh, and what its kernels work on; faces should point along random vectors, some along none."""
    c = mesh.connectivity
    rng = np.random.default_rng(seed)
    along = rng.normal(size=(len(c.face_sizes), 3))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    along[rng.random(len(along)) < 0.5] = 0
    one = Guard(mesh, faces_of(c), along, np.ones(mesh.n_vertices, bool))
    return one, one._guarded(mesh, facing)[0]


def plain_faults(mesh, along, i, bounds):
    """What is wrong around a vertex, by the mesh's own normals."""
    c, v, n = mesh.connectivity, mesh.vertices, mesh.normals
    cosine = lambda a, b: a @ b / np.linalg.norm(a) / np.linalg.norm(b)  # noqa: E731
    wrong = lambda x: max(bounds.among - x, 0) + (x < 0)  # noqa: E731
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
            if along[f].any():
                total += max(bounds.along - cosine(t, along[f]), 0)
    return total + sum(wrong(cosine(n[j], vectors[c.vertex_faces[j]].sum(axis=0))) for j in (i, *c.neighbors[i]))


@settings(max_examples=10, deadline=None)
@given(name=names, seed=seeds, size=st.sampled_from([0.3, 1.0]))
def test_faults_are_those_of_the_plain_telling(name, seed, size):
    mesh = shaken(MESHES[name], seed, size)
    _, g = guarded(mesh, seed)
    rng, room = np.random.default_rng(seed), guard.new_room()
    v = np.array(mesh.vertices)
    for i in rng.choice(mesh.n_vertices, 5, replace=False).tolist():
        v[i] += 0.1 * rng.normal(size=3)
        guard.put_vertex(g, i, *v[i])
        moved = mesh.moved(v)
        assert_allclose(g.normals, moved.normals, atol=1e-9)
        assert_allclose(g.points, Guard._guarded(guarded(moved)[0], moved, 2.0)[0].points, atol=1e-12)
        assert_allclose(guard.faults(g, i, BOUNDS, room), plain_faults(moved, g.along, i, BOUNDS), atol=1e-6)


@settings(max_examples=8, deadline=None)
@given(name=names, seed=seeds, size=st.sampled_from([0.5, 2.0]))
def test_crossings_are_those_of_the_mesh(name, seed, size):
    mesh = shaken(MESHES[name], seed, size)
    _, g = guarded(mesh)
    pairs = self_intersections(mesh.vertices, mesh.connectivity)
    assert_array_equal(np.flatnonzero(g.crossed), np.unique(pairs))
    room = guard.new_room()
    beside = [set(row) for row in mesh.connectivity.vertex_faces.tolist()]
    for i in range(0, mesh.n_vertices, 7):
        assert (guard.crossings(g, i, room) > 0) == any(set(pair) & beside[i] for pair in pairs.tolist())


def test_holes_are_near_nothing(monkeypatch):
    mesh, counts, near_boxes = MESHES["torus with holes"], [], untangling.near_boxes
    monkeypatch.setattr(
        untangling, "near_boxes", lambda low, *rest: (counts.append(len(low)), near_boxes(low, *rest))[1]
    )
    g = guarded(mesh)[1]
    hole = mesh.connectivity.face_is_hole
    assert counts == [mesh.n_faces]  # each hole would be near each other one, wherever they are
    assert not hole[g.near].any()
    assert (np.diff(g.offsets)[hole] == 0).all()
    assert all(f in g.near[g.offsets[f] : g.offsets[f + 1]] for f in np.flatnonzero(~hole))


@settings(max_examples=20)
@given(seed=seeds, facing=st.sampled_from([0.0, 2.0]))
def test_near_boxes_are_those_that_overlap(seed, facing):
    rng = np.random.default_rng(seed)
    low = rng.uniform(0, 1, (30, 3))
    high = low + rng.uniform(0, 0.3, (30, 3))
    along = rng.normal(size=(30, 3))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    offsets, near = untangling.near_boxes(low, high, along, facing, np.zeros(3), 0.2, np.array([7, 7, 7]))
    for i in range(30):
        expected = (low <= high[i]).all(axis=1) & (high >= low[i]).all(axis=1) & (along @ along[i] <= facing)
        assert set(near[offsets[i] : offsets[i + 1]]) == set(np.flatnonzero(expected))


@settings(max_examples=8, deadline=None)
@given(name=names, seed=seeds)
def test_no_fold_comes_with_a_move(name, seed):
    mesh = MESHES[name]
    along = np.zeros((len(mesh.connectivity.face_sizes), 3))
    free = np.random.default_rng(seed).random(mesh.n_vertices) < 0.9
    one = Guard(mesh, faces_of(mesh.connectivity), along, free)
    moved = mesh
    for k in range(3):
        moved = moved.moved(one.advanced(moved, shaken(mesh, seed + k, 3.0).vertices, -2.0))
    assert not misoriented(moved.vertices, mesh.connectivity)[1].any()
    assert_array_equal(moved.vertices[~free], mesh.vertices[~free])
    assert np.abs(moved.vertices - mesh.vertices).max() > 0


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
