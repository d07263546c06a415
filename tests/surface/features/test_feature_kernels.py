"""Kernels of lines and zones beside plain Python that does the same."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import pyvista as pv
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra

import simplexmesh as sm
from simplexmesh.mesh import manifold
from simplexmesh.surface.features.lines import _kernels_jumps, _kernels_normals, _kernels_patches
from simplexmesh.surface.features.lines._kernels_chains import chains
from simplexmesh.surface.features.lines._kernels_patches import patches
from simplexmesh.surface.features.lines.edge_sets import Edges
from simplexmesh.surface.features.lines.facets import measured
from simplexmesh.surface.features.lines.invariants import shape_invariant, straight
from simplexmesh.surface.features.lines.normals import within_zones
from simplexmesh.surface.features.zoning._kernels_fronts import grow
from tests.surface.features.sheets import shaken, sheet

BODIES = [sm.sphere(3).triangulated("dual"), sheet(lambda x, y: 0.1 * np.sin(x), 0.15), sm.plane(6, 6).triangulated()]


def facets_of(mesh):
    faces = mesh.faces.astype(np.int64)
    return measured(np.array(mesh.vertices), faces, manifold.half_edge_mates(mesh.faces).ravel())


def sets(offsets, members):
    return [set(members[i:j].tolist()) for i, j in pairwise(offsets)]


class TestChains:
    @pytest.mark.parametrize("seed", range(12))
    @pytest.mark.parametrize("body", BODIES)
    def test_hold_each_chosen_edge_once_from_node_to_node(self, body, seed):
        edges = Edges(facets_of(body))
        chosen = np.random.default_rng(seed).random(len(edges.ends)) < (seed + 1) / 15
        degrees = edges.degrees(chosen)
        offsets, found, vertices = chains(edges.ends, *edges._around, chosen, degrees)
        assert_array_equal(np.sort(found), np.flatnonzero(chosen))
        for k, (i, j) in enumerate(pairwise(offsets)):
            along = vertices[i + k : j + k + 1]
            steps = np.sort(np.stack([along[:-1], along[1:]], axis=1), axis=1)
            assert_array_equal(steps, np.sort(edges.ends[found[i:j]], axis=1))
            assert (degrees[along[1:-1]] == 2).all()
            assert (degrees[along[[0, -1]]] != 2).all() or along[0] == along[-1]
        assert len(offsets) - 1 == lines_of(edges.ends[chosen].tolist(), degrees)

    def test_of_none(self):
        edges = Edges(facets_of(BODIES[0]))
        none = np.zeros(len(edges.ends), bool)
        offsets, found, vertices = chains(edges.ends, *edges._around, none, edges.degrees(none))
        assert (offsets.tolist(), found.tolist(), vertices.tolist()) == ([0], [], [])


@pytest.mark.parametrize("body", BODIES)
def test_the_cheapest_paths_are_those_of_scipy(body):
    edges, rng = Edges(facets_of(body)), np.random.default_rng(0)
    costs, usable = rng.uniform(0.1, 1.0, len(edges.ends)), rng.random(len(edges.ends)) < 0.8
    n = body.n_vertices
    graph = coo_array((costs[usable], edges.ends[usable].T), (n, n))
    away = dijkstra(graph, directed=False, indices=0)
    for goal in range(1, n, 7):
        path = edges.path(0, [goal], usable, costs)
        assert usable[path].all()
        assert np.isinf(away[goal]) == (not path)
        assert not path or costs[path].sum() == pytest.approx(away[goal])


def lines_of(edges, degrees):
    """The number of lines that edges form: pieces after edges that share a vertex of two are merged."""
    group = list(range(len(edges)))

    def root(k):
        while group[k] != k:
            k = group[k]
        return k

    for i, one in enumerate(edges):
        for j, two in enumerate(edges[:i]):
            if any(degrees[v] == 2 for v in {*one} & {*two}):
                group[root(i)] = root(j)
    return len({root(k) for k in range(len(edges))})


class TestPatches:
    @pytest.mark.parametrize("radius", [0.0, 0.12, 0.35])
    @pytest.mark.parametrize("body", BODIES)
    def test_are_the_ring_and_what_is_connected_within_a_radius(self, body, radius):
        facets = facets_of(body)
        radii = radius * np.random.default_rng(0).uniform(0.7, 1.3, len(facets.faces))
        corners = np.zeros((len(facets.faces), len(facets.vertices)), int)
        np.put_along_axis(corners, facets.faces, 1, axis=1)
        touching = [{*np.flatnonzero(row).tolist()} for row in corners @ corners.T]
        apart = ((facets.centers[:, None] - facets.centers) ** 2).sum(axis=2)
        near = [{*np.flatnonzero(row).tolist()} for row in apart <= radii[:, None] ** 2]
        expected = []
        for t, ring in enumerate(touching):
            inside, todo = {*ring}, [u for u in ring if radius and u in near[t]]
            while todo:
                new = (touching[todo.pop()] & near[t]) - inside
                inside |= new
                todo += new
            expected.append(inside)
        at = np.arange(len(facets.faces))[::-1].copy()
        found = patches(facets.faces, len(facets.vertices), facets.centers, radii[at], at)
        assert_array_equal(found[1][found[0][:-1]], at)
        assert sets(*found) == expected[::-1]
        assert len(found[1]) == sum(map(len, expected))


def test_patches_and_windows_have_so_many_triangles_at_most():
    """Of crumpled surfaces each held the whole: the time grew with the square of the triangles, and the memory."""
    ball = sm.sphere(26).triangulated("dual")
    crumpled = ball.vertices + np.random.default_rng(0).normal(scale=0.3, size=ball.vertices.shape)
    facets = facets_of(sm.TriangleMesh(crumpled, ball.faces))
    whole = len(facets.faces)
    offsets, _ = patches(facets.faces, len(facets.vertices), facets.centers, np.full(20, 9.0), np.arange(20))
    assert (np.diff(offsets) == _kernels_patches.MOST).all()
    facets = facets.seen(np.ones(whole), np.ones(whole))
    alike = np.tile(np.eye(3)[2], (whole, 1))
    sides = _kernels_jumps.Sides(alike, np.ones(whole), np.zeros(whole, bool), np.zeros(3 * whole, bool))
    stamp, queue, frame = np.full(whole, -1), np.empty(whole + 1, np.int64), tuple(map(tuple, np.eye(3)[[0, 0, 1, 2]]))
    _kernels_jumps._side(facets, sides, 0, frame, stamp, queue)
    assert 0.9 * _kernels_jumps.MOST < (stamp == 0).sum() < 1.2 * _kernels_jumps.MOST < whole / 2.5


@pytest.mark.parametrize("turn", range(3))
def test_patches_in_a_fan_have_the_neighbors_of_their_triangle(turn):
    """The hub of so many triangles, where it came first, left no room for those across the rim."""
    n = 3 * _kernels_patches.MOST
    rim = np.column_stack([np.cos(2 * np.pi * np.arange(n) / n), np.sin(2 * np.pi * np.arange(n) / n), np.zeros(n)])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    hub, outer = np.full(n, 2 * n), i + n
    faces = np.concatenate([np.column_stack([hub, i, j]), np.column_stack([i, outer, j])])
    facets = facets_of(sm.TriangleMesh(np.concatenate([rim, 2 * rim, [[0, 0, 0]]]), np.roll(faces, turn, axis=1)))
    offsets, members = patches(facets.faces, 2 * n + 1, facets.centers, np.zeros(3), np.array([0, n // 2, n - 1]))
    for t, (first, last) in zip((0, n // 2, n - 1), pairwise(offsets), strict=True):
        assert {t, t + n, (t - 1) % n, (t + 1) % n} <= set(members[first:last].tolist())


class TestGrow:
    @pytest.mark.parametrize("seed", range(6))
    @pytest.mark.parametrize("body", BODIES)
    def test_takes_neighbors_like_the_seed(self, body, seed):
        rng, facets = np.random.default_rng(seed), facets_of(body)
        n = len(facets.faces)
        values, closed = rng.random(n), np.zeros(3 * n, bool)
        inner = np.flatnonzero(facets.mates >= 0)
        some = inner[rng.random(len(inner)) < 0.2]
        closed[some] = closed[facets.mates[some]] = True
        labels, order = np.where(rng.random(n) < 0.1, n, -1), rng.permutation(n)
        expected, zones = labels.tolist(), 0
        for first in order.tolist():
            if expected[first] >= 0:
                continue
            todo = [first]
            expected[first] = zones
            while todo:
                for h in range(3 * todo[0], 3 * todo[0] + 3):
                    other = facets.mates[h] // 3
                    like = abs(values[other] - values[first]) <= 0.3
                    if facets.mates[h] >= 0 and not closed[h] and expected[other] < 0 and like:
                        expected[other] = zones
                        todo.append(other)
                todo.pop(0)
            zones += 1
        assert grow(labels, order, values, 0.3, facets.mates, closed) == zones
        assert_array_equal(labels, expected)


@pytest.fixture(params=range(3))
def patched(request):
    """Facets, with the patches of their rings."""
    facets = facets_of(shaken(BODIES[request.param], 0.2, request.param))
    n = len(facets.faces)
    offsets, members = patches(facets.faces, len(facets.vertices), facets.centers, np.zeros(n), np.arange(n))
    return facets, offsets, members, [members[i:j] for i, j in pairwise(offsets)]


class TestNormals:
    def test_means_and_spreads(self, patched):
        facets, offsets, members, rings = patched
        means, spreads = np.empty_like(facets.normals), np.empty(len(rings))
        _kernels_normals.fill_means(len(means), offsets, members, facets.areas, facets.normals, means, spreads)
        for t, ring in enumerate(rings):
            total = (facets.areas[ring, None] * facets.normals[ring]).sum(axis=0)
            length = np.linalg.norm(total)
            assert_allclose(means[t], total / length, rtol=1e-12)
            assert spreads[t] == pytest.approx(1 - length / facets.areas[ring].sum(), abs=1e-12)

    @pytest.mark.parametrize("gain", [0.1, 0.5, 1.0])
    def test_guides_are_of_the_most_consistent_patch(self, patched, gain):
        facets, offsets, members, rings = patched
        rng = np.random.default_rng(0)
        means, spreads = rng.normal(size=facets.normals.shape), rng.random(len(rings))
        guides, limits, changed = np.empty_like(means), 0.3 * rng.random(len(rings)), 0
        _kernels_normals.fill_guides(
            len(guides), offsets, members, facets.normals, means, spreads, gain, limits, guides
        )
        for t, ring in enumerate(rings):
            best = min(ring, key=lambda u: spreads[u])
            best = best if spreads[best] <= gain * spreads[t] else t
            changed += best != t
            pure = spreads[best] <= limits[best]
            assert_array_equal(guides[t], means[best] if pure else facets.normals[t])
        assert 0 < changed < len(rings)

    @pytest.mark.parametrize("width", [0.1, 0.5])
    def test_averages_are_of_normals_whose_guides_are_alike(self, patched, width):
        facets, offsets, members, rings = patched
        rng = np.random.default_rng(0)
        weights, out = rng.random(len(members)), np.empty_like(facets.normals)
        guides, widths = facets.normals + 0.2 * rng.normal(size=out.shape), width * rng.uniform(1, 2, len(out))
        _kernels_normals.fill_averages(len(out), offsets, members, weights, guides, facets.normals, widths, out)
        for t, ring in enumerate(rings):
            alike = np.exp(-((guides[ring] - guides[t]) ** 2).sum(axis=1) / (2 * widths[t] ** 2))
            total = (weights[offsets[t] : offsets[t + 1]] * alike) @ facets.normals[ring]
            assert_allclose(out[t], total / np.linalg.norm(total), atol=1e-12)

    def test_where_nothing_is_alike_the_guide_is_left(self):
        guides, out = np.array([[1.0, 0, 0], [0, 1.0, 0]]), np.empty((2, 3))
        zero = np.zeros((2, 3))
        _kernels_normals.fill_averages(
            len(out), np.arange(3), np.arange(2), np.ones(2), guides, zero, np.full(2, 0.1), out
        )
        assert_array_equal(out, guides)


class TestShapeInvariant:
    @pytest.mark.parametrize("body", [BODIES[0], sm.sphere(6).triangulated("dual")])
    def test_is_that_of_sectors_of_radius_one(self, body):
        edges = Edges(facets_of(body))
        vertices, faces = body.vertices, body.faces.tolist()
        bends = np.random.default_rng(0).uniform(0.3, 0.6, len(edges.ends))
        found = shape_invariant(edges, bends)
        assert (found > 0).mean() > 0.9
        for v in range(len(vertices)):
            turned = sum(bends[e] for e in np.flatnonzero((edges.ends == v).any(axis=1)))
            total = cell = 0.0
            for face in faces:
                if v in face:
                    a, b = (vertices[u] - vertices[v] for u in face if u != v)
                    angle = np.arccos(a @ b / np.linalg.norm(a) / np.linalg.norm(b))
                    total += angle
                    cell += angle / 4 - (2 * np.sin(angle / 2)) ** 2 / np.tan(angle) / 8
            mean, gauss = turned / 4 / (total / 6), (2 * np.pi - total) / cell
            assert found[v] == pytest.approx(max(4 * mean**2 - 2 * gauss, 0), rel=1e-6, abs=1e-9)

    def test_of_a_straight_crease(self):
        """Two of the edges at a vertex bend, and its triangles are in planes."""
        assert straight(0.4) == pytest.approx(4 * (2 * 0.4 / 4 / (2 * np.pi / 6)) ** 2)


def test_normals_within_zones_do_not_see_beyond_a_sharp_edge():
    box = sm.divided(pv.Cube().triangulate().clean(), 0.3)
    body = facets_of(box)._replace(noise=np.full(box.n_faces, 0.05))
    labels = np.unique(body.normals.round(), axis=0, return_inverse=True)[1].ravel()
    assert_allclose(within_zones(body, labels, np.arange(len(labels))), body.normals, atol=1e-12)


@pytest.mark.parametrize("body", BODIES)
def test_weights_are_gaussian_in_the_mean_distance(body):
    facets = facets_of(body)
    everywhere = np.arange(body.n_faces)
    offsets, members = patches(facets.faces, body.n_vertices, facets.centers, np.zeros(body.n_faces), everywhere)
    found = np.empty(len(members))
    _kernels_normals.fill_weights(len(facets.areas), offsets, members, facets.centers, facets.areas, found)
    for t, (i, j) in enumerate(pairwise(offsets)):
        apart = np.linalg.norm(facets.centers[members[i:j]] - facets.centers[t], axis=1)
        areas = facets.areas[members[i:j]]
        width = np.average(apart, weights=areas)
        assert_allclose(found[i:j], areas * np.exp(-((apart / width) ** 2) / 2), rtol=1e-12)


@pytest.mark.parametrize("body", BODIES)
def test_zones_are_those_of_the_graph_of_triangles(body):
    edges = Edges(facets_of(body))
    chosen = np.random.default_rng(0).random(len(edges.halves)) < 0.6
    one, two = edges.sides[~chosen].T
    links = coo_array((np.ones(len(one)), (one, two)), (body.n_faces, body.n_faces))
    expected = connected_components(links, directed=False)[1]
    assert expected.max() > 3
    assert_array_equal(edges.zones(chosen), expected)
