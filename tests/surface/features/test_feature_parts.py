"""Lines and zones of parts with exactly known creases, in four tessellations, with noise."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.surface.features.zoning.result import zoned
from tests.nightly.marks import nightly
from tests.surface.features.parts import noisy, reference, tessellated
from tests.surface.features.reference import Reference
from tests.surface.features.scoring import crease_score, kinds_told, networks, paths, rand_index, samples
from tests.surface.features.solids import Solid, pose, profile

SEEDS = {"block": 0, "plate": 1, "crossing": 1, "dome": 2, "bracket": 0}
FACES = 7000
(IRREGULAR,) = nightly("irregular")


body_of = cache(reference)


@cache
def part(name, kind):
    body = body_of(name, SEEDS[name])
    return tessellated(body, kind, body.edge(FACES) / (4 if kind == "sliver" else 1), SEEDS[name])


@cache
def found(name, kind, noise):
    """A part with noise and its network."""
    given = noisy(part(name, kind), noise, SEEDS[name]) if noise else part(name, kind)
    return given, sm.feature_lines(given.mesh)


@cache
def score(name, kind, noise):
    given, network = found(name, kind, noise)
    return crease_score(paths(network), given)


def mean(attribute, kind, noise):
    return np.nanmean([getattr(score(name, kind, noise), attribute) for name in SEEDS])


@pytest.mark.parametrize(
    ("noise", "precision", "recall"),
    [(0.0, 0.97, 0.97), *nightly((0.05, 0.97, 0.95)), (0.1, 0.95, 0.92), *nightly((0.2, 0.9, 0.82))],
)
@pytest.mark.parametrize("kind", ["scan", *nightly("aligned"), IRREGULAR])
class TestWithNoise:
    def test_lines_are_creases_and_creases_are_found(self, kind, noise, precision, recall):
        assert mean("precision", kind, noise) > precision
        assert mean("recall", kind, noise) > recall
        assert 0.75 < mean("excess", kind, noise) < 1.1

    def test_zones_are_the_patches(self, kind, noise, precision, recall):
        agree = []
        for name in SEEDS:
            given, network = found(name, kind, noise)
            agree.append(rand_index(sm.zones(given.mesh, network).labels, given.patches))
        assert np.mean(agree) > recall - 0.15


@pytest.mark.parametrize("kind", [*nightly("aligned"), IRREGULAR, "sliver", "scan"])
class TestWithout:
    @pytest.mark.parametrize("name", SEEDS)
    def test_every_line_closes_or_ends_at_others(self, kind, name):
        assert score(name, kind, 0.0).loose == 0

    def test_there_are_as_many_networks_as_of_creases(self, kind):
        true = [networks(list(np.concatenate([of.creases, of.soft])), 1e-9) for of in (part(n, kind) for n in SEEDS)]
        assert sum(abs(score(n, kind, 0.0).pieces - pieces) for n, (pieces, _) in zip(SEEDS, true, strict=True)) <= 3

    def test_creases_of_20_degrees_are_found(self, kind):
        assert score("block", kind, 0.0).soft_recall > 0.9


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_there_are_as_many_zones_as_patches(noise):
    """None are between two courses of one crease; of softer creases in noise one may be missed."""
    pairs = [found(name, "scan", noise) for name in SEEDS]
    more = [len(sm.zones(given.mesh, network)) - len(given.kinds) for given, network in pairs]
    assert sum(np.abs(more)) <= 2
    assert sum(more) < 2


@pytest.mark.parametrize(
    ("noise", "off", "recall"), [(0.0, 1, 0.95), *nightly((0.05, 4, 0.95)), (0.1, 5, 0.9), *nightly((0.2, 8, 0.7))]
)
@pytest.mark.parametrize("kind", ["aligned", "scan"])
def test_right_angles_are_right(kind, noise, off, recall):
    given, network = found("plate", kind, noise)
    angle = np.degrees(np.concatenate([line.angle for line in network.lines]))
    assert np.median(angle) == pytest.approx(90, abs=off)
    assert crease_score(paths(sm.feature_lines(given.mesh, angle=np.radians(75))), given).recall > recall


@pytest.mark.parametrize(("noise", "right"), [(0.0, 0.95), (0.1, 0.9)])
@pytest.mark.parametrize("kind", [*nightly("aligned"), "scan"])
def test_zones_are_what_the_patches_are(kind, noise, right):
    told = []
    for name in SEEDS:
        given, network = found(name, kind, noise)
        zones = sm.zones(given.mesh, network)
        told += [pair for pair in kinds_told(zones, given) if pair[1]]
        assert np.isfinite(zones.errors).all()
    assert len(told) > 35
    assert np.mean([one == other for one, other in told]) > right


@pytest.mark.parametrize("noise", [0.02, 0.05])
@pytest.mark.parametrize("kind", [*nightly("aligned"), "scan"])
def test_creases_of_simplified_scans_are_found(noise, kind):
    scores, zones = [], []
    for name in set(SEEDS) - {"dome"}:  # round all over: its triangles stay even, as those of a scan
        given = noisy(part(name, kind), noise, SEEDS[name])
        network = sm.feature_lines(sm.simplify(given.mesh, 4 * noise * given.edge))
        scores.append(crease_score(paths(network), given))
        zones.append(len(sm.zones(network.mesh, network)) / len(given.kinds))
    assert np.mean([each.precision for each in scores]) > 0.8
    assert np.mean([each.recall for each in scores]) > 0.8
    assert 0.7 < np.mean(zones) < 1.4


@pytest.mark.parametrize("off", [0.05, *nightly(0.1)])
def test_bends_of_curved_faces_between_large_flat_ones_are_no_noise(off):
    """As files of CAD have them: nothing on planes but what triangles need, and many irregular ones on balls."""
    given = part("dome", "irregular")
    network = sm.feature_lines(sm.simplify(given.mesh, off * given.edge))
    assert network.noise < 1e-6 * given.edge
    assert crease_score(paths(network), given).recall > 0.95


@pytest.mark.parametrize("off", [*nightly(0.02), 0.05])
def test_facets_of_fillets_are_no_faces(off):
    """A cylinder rounded above, in triangles of which none is surrounded by others in its plane."""
    side = profile((0, 0), (1, 0), (1, 1), (0, 1), radii=[(2, 0.25)])
    cap = Reference("cap", [("+", Solid(side, None, pose(axis=(1, 2, 3))))])
    given = tessellated(cap, "irregular", cap.edge(6000))
    network = sm.feature_lines(sm.simplify(given.mesh, off * given.edge))
    assert [line.closed for line in network.lines] == [True]
    assert crease_score(paths(network), given).recall > 0.95


@pytest.mark.parametrize("kind", ["aligned", IRREGULAR])
def test_creases_of_20_degrees_are_found_in_noise(kind):
    """That of the other edges is measured inside of smooth parts, not across their creases."""
    assert score("block", kind, 0.05).soft_recall > 0.9


def away(name, noise):
    """The median distances of a scan's points of lines, and of the vertices that these follow, from the creases."""
    given, network = found(name, "scan", noise)
    tree = cKDTree(samples(np.concatenate([given.creases, given.soft]), 0.01 * given.edge)[0])
    points = np.concatenate([line.points for line in network.lines])
    vertices = network.mesh.vertices[np.concatenate([line.vertices for line in network.lines])]
    return np.median(tree.query(points)[0]) / given.edge, np.median(tree.query(vertices)[0]) / given.edge


@pytest.mark.parametrize("name", SEEDS)
def test_points_of_lines_lie_nearer_the_creases_than_vertices_do(name):
    points, vertices = away(name, 0.0)
    assert points < 0.2 * vertices


@pytest.mark.parametrize(("noise", "off"), [(0.1, 0.17), (0.2, 0.3)])
def test_points_of_lines_lie_on_creases_whatever_the_noise(noise, off):
    assert np.mean([away(name, noise)[0] for name in SEEDS]) < off


def test_a_zone_of_one_triangle_astride_a_crease_keeps_it():
    given, network = found("dome", "scan", 0.0)
    zones = sm.zones(given.mesh, network)
    across = np.flatnonzero(zones.labels != zones._parts)
    assert len(across) > 10
    for triangle in across[:: len(across) // 10]:
        parts = zones._parts.copy()
        parts[triangle] = len(zones)
        more = zoned(network, parts)
        assert np.array_equal(np.unique(more.labels), np.arange(len(zones) + 1))


@pytest.mark.parametrize("noise", [0.05, *nightly(0.1), 0.2])
@pytest.mark.parametrize("kind", ["aligned", IRREGULAR])
def test_noise_is_estimated(kind, noise):
    pairs = (found(name, kind, noise) for name in ("block", "plate"))
    assert np.mean([network.noise / given.edge for given, network in pairs]) == pytest.approx(noise, rel=0.15)


@pytest.mark.parametrize("kind", ["aligned", "sliver", "scan"])
@pytest.mark.parametrize("radius", [*nightly(0.25), 0.49])
def test_fillets_are_no_creases(kind, radius):
    side = profile((0, 0), (2, 0), (2, 1), (0, 1), radii=[(k, radius) for k in range(4)])
    slab = Reference("slab", [("+", Solid(side, 0.6, pose(axis=(1, 2, 3))))])
    lines = sm.feature_lines(tessellated(slab, kind, slab.edge(4000)).mesh).lines
    assert [line.closed for line in lines] == [True, True]
    around = 6 - (8 - 2 * np.pi) * radius
    assert [line.length for line in lines] == pytest.approx([around, around], rel=0.02)


@pytest.mark.parametrize("kind", ["aligned", "scan"])
@pytest.mark.parametrize("edges", [2.0, *nightly(2.5)])
def test_small_fillets_are_no_creases_in_noise(kind, edges):
    """Windows as wide as noise asks for see past them, as if their two sides met in one line."""
    side = profile((0, 0), (2, 0), (2, 1), (0, 1), radii=[(k, 0.0665 * edges) for k in range(4)])
    slab = Reference("slab", [("+", Solid(side, 0.6, pose(axis=(1, 2, 3))))])
    given = noisy(tessellated(slab, kind, slab.edge(4000)), 0.05)
    found = crease_score(paths(sm.feature_lines(given.mesh)), given)
    assert found.precision > 0.93
    assert found.recall > 0.95


@pytest.mark.parametrize("name", ["bracket", *nightly("block", "crossing")])
def test_lines_do_not_depend_on_numbers_nor_mirrors(name):
    mesh, rng = noisy(part(name, "scan"), 0.1).mesh, np.random.default_rng(0)
    shuffled = rng.permutation(mesh.n_vertices)
    faces = np.argsort(shuffled)[mesh.faces]
    copies = (
        (mesh.vertices, mesh.faces, np.arange(mesh.n_vertices)),
        (mesh.vertices * [-1, 1, 1], mesh.faces[:, ::-1], np.arange(mesh.n_vertices)),
        (mesh.vertices[shuffled], np.roll(rng.permutation(faces), 1, axis=1), shuffled),
    )
    lines = []
    for vertices, triangles, number in copies:
        network = sm.feature_lines(sm.TriangleMesh(vertices, triangles))
        along = [number[np.append(line.vertices, line.vertices[: int(line.closed)])] for line in network.lines]
        lines.append({frozenset(pair) for v in along for pair in zip(v[:-1].tolist(), v[1:].tolist(), strict=True)})
    assert lines[0] == lines[1] == lines[2]
