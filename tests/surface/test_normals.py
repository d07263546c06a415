"""Normals: what is exact, what the thesis's rings give, how fast errors fall, and what every estimator keeps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.bench.truth import rings as truth
from simplexmesh.bench.truth.discretized import sawtooth, split_square, uv_sphere
from simplexmesh.bench.truth.graphs import graph
from simplexmesh.surface.normals import _kernels_extended_sine as kernels
from simplexmesh.surface.normals.estimate import METHODS, found_normals
from tests.bench import article_rings
from tests.nightly.marks import nightly
from tests.surface import normal_errors, reference_normals

NAMES = sorted(name for name in METHODS if not METHODS[name].own_scale)
OF_FACES = [name for name in NAMES if METHODS[name].needs_faces]
OF_NEIGHBORS = [name for name in NAMES if not METHODS[name].needs_faces]
ON_SPHERES = ["chen_schmitt", "extended_sine", "max"]


def one(points, method, *, start=None, **options):
    """The normal at the first of the points, whose neighbors are the others in order."""
    normals = None if start is None else np.tile(start, (len(points), 1))
    found = found_normals(*reference_normals.ringed(points), method, normals=normals, **options)
    assert found.reasons.tolist() == [0]
    return found.normals[0]


def tilted(normal, angle, azimuth):
    """A unit vector at an angle from another."""
    _, first, second = np.linalg.svd(normal[None])[2]
    return np.cos(angle) * normal + np.sin(angle) * (np.cos(azimuth) * first + np.sin(azimuth) * second)


def all_sphere_rings():
    yield from (article_rings.article_ring(d, kind) for kind in article_rings.KINDS for d in (0.5, 0.05, 0.0005))
    surface = graph("sphere")
    for scheme in truth.SCHEMES:
        yield from (truth.scheme_ring(surface, scheme, n, d) for n in (6, 12) for d in (0.5, 0.05, 0.0005))


def rough_ring(seed, m=None):
    """A point and neighbors around it on no particular surface."""
    rng = np.random.default_rng(seed)
    m = m or int(rng.integers(5, 13))
    t = 2 * np.pi * (np.arange(m) + rng.uniform(-0.35, 0.35, m)) / m
    r = rng.uniform(0.6, 1.4, m)
    a, b, c = rng.normal(size=3) * 0.3
    x, y = r * np.cos(t), r * np.sin(t)
    z = a * x * x + b * x * y + c * y * y + rng.normal(size=m) * 0.02
    points = np.concatenate([[[0, 0, 0]], np.stack([x, y, z], axis=1)])
    return points @ Rotation.random(random_state=int(seed) % 2**31).as_matrix().T + rng.normal(size=3)


# --- what is exact -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ON_SPHERES)
def test_is_exact_on_spheres_wherever_the_neighbors(method):
    for ring in all_sphere_rings():
        assert_allclose(one(ring.points, method), ring.exact.normals[0], atol=1e-9)


def test_of_a_quadric_graph_over_its_tangent_plane_is_exact():
    for name in ("elliptic_paraboloid", "hyperboloid"):
        for scheme in truth.SCHEMES:
            ring = truth.scheme_ring(graph(name), scheme, 6, 0.5)
            assert_allclose(one(ring.points, "quadric", start=[0, 0, 1.0]), [0, 0, 1], atol=1e-14)


def test_of_the_quadric_is_the_one_its_curvatures_refer_to():
    mesh = sm.torus(20, 12).triangulated("dual")
    curvatures = sm.curvature(mesh, "extended_quadric", least=5)
    assert_allclose(sm.vertex_normals(mesh, "quadric"), curvatures.normals, atol=1e-15)


def test_passes_lead_to_the_quadric_over_its_own_tangent_plane():
    ring = truth.scheme_ring(graph("elliptic_paraboloid"), "Rdds", 12, 0.1)
    start = tilted(np.array([0, 0, 1.0]), 0.2, 1.0)
    errors = [np.linalg.norm(one(ring.points, "quadric", start=start, passes=k) - [0, 0, 1]) for k in (1, 2, 4, 8)]
    assert errors[0] > 4 * errors[1] > 16 * errors[2]
    assert errors[3] < 1e-6


def test_of_a_symmetric_ring_is_the_planes():
    for name in ("cylinder", "hyperboloid", "monkey_saddle", "exponential"):
        ring = truth.scheme_ring(graph(name), "R", 6, 0.3)
        assert_allclose(one(ring.points, "plane"), [0, 0, 1], atol=1e-14)
        assert_allclose(one(ring.points, "extended_sine"), [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize("make", [split_square, sawtooth])
def test_by_area_is_exact_on_grids_of_a_hyperboloid(make):
    found = make(graph("hyperboloid"), 32)
    normals = sm.vertex_normals(found.mesh, "area")
    assert np.abs(normals - found.exact.normals)[found.inner].max() < 1e-14


@pytest.mark.parametrize("method", NAMES)
def test_of_a_plane_is_the_planes(method):
    n = np.array([0.6, 0.0, 0.8])
    t, r = 2 * np.pi * np.arange(9) / 9 + 0.2 * np.sin(np.arange(9)), 1 + 0.3 * np.cos(7 * np.arange(9))
    flat = np.stack([0.8 * r * np.cos(t), r * np.sin(t), -0.6 * r * np.cos(t)], axis=1)
    flat = np.concatenate([np.zeros((1, 3)), flat]) + 1.0
    assert_allclose(np.abs(one(flat, method, start=None if method in OF_FACES else n)), n, atol=1e-14)


# --- the thesis's figures ----------------------------------------------------------------------------------------


def drawn(ring):
    """Whether rounding chooses the pairs of Chen and Schmitt: the last one in is as opposite as the first one out."""
    worth = [pair[0] for pair in reference_normals.opposed(ring.center, ring.neighbors)]
    m = len(ring.neighbors)
    return worth[m] - worth[m - 1] < 1e-10 * np.ptp(worth)  # rounding makes 5e-12, the closest true difference 8e-10


@pytest.mark.parametrize(("distance", "least"), [(0.1, 15), (0.0005, 8)])
def test_some_pairs_of_chen_and_schmitt_are_distinguished(distance, least):
    rings = [truth.scheme_ring(graph(s), scheme, n, distance) for n, s, scheme, _ in normal_errors.rows()]
    assert sum(not drawn(ring) for ring in rings) >= least


@pytest.mark.parametrize(
    ("count", "surface", "scheme", "errors"), normal_errors.rows(), ids=lambda v: "" if isinstance(v, dict) else str(v)
)
def test_errors_on_the_rings_of_the_thesis(count, surface, scheme, errors):
    for method, expected in errors.items():
        for distance, value in zip((0.1, 0.0005), expected, strict=True):
            ring = truth.scheme_ring(graph(surface), scheme, count, distance)
            if method == "chen_schmitt" and drawn(ring):
                continue
            error = np.linalg.norm(one(ring.points, method) - ring.exact.normals[0])
            assert abs(error - value) < max(0.055 * value, 2e-9), (method, distance, error)


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (lambda: uv_sphere(32, 32), {"plane": (1.1e-2, 4.6e-2), "area": (4.6e-3, 1.7e-2), "quadric": (1.8e-5, 7.9e-5)}),
        (
            lambda: split_square(graph("sphere"), 32),
            {"plane": (4.2e-4, 1.4e-3), "area": (3.3e-4, 1.2e-3), "quadric": (1.3e-7, 8.6e-7)},
        ),
        (
            lambda: sawtooth(graph("sphere"), 32),
            {"plane": (3.2e-4, 8.7e-4), "area": (2.8e-4, 7.7e-4), "quadric": (1.0e-7, 3.6e-7)},
        ),
        (
            lambda: split_square(graph("hyperboloid"), 32),
            {"plane": (2.6e-4, 4.1e-4), "quadric": (2.6e-4, 4.1e-4), "extended_sine": (2.9e-4, 4.1e-4)},
        ),
        (
            lambda: sawtooth(graph("hyperboloid"), 32),
            {"plane": (2.2e-4, 2.8e-4), "quadric": (2.2e-4, 3.0e-4), "extended_sine": (2.5e-4, 3.1e-4)},
        ),
    ],
    ids=["uv sphere", "sphere squares", "sphere saw", "hyperboloid squares", "hyperboloid saw"],
)
def test_errors_on_the_meshes_of_the_thesis(mesh, expected):
    found = mesh()
    for method, (mean, most) in expected.items():
        normals = sm.vertex_normals(found.mesh, method, at=found.inner)
        error = np.linalg.norm(normals - found.exact.normals[found.inner], axis=1)
        assert abs(error.mean() - mean) < 0.06 * mean, (method, error.mean())
        assert abs(error.max() - most) < 0.06 * most, (method, error.max())


TABLE_4_1 = """
0.5000 0.250790 0.252723
0.4500 0.250287 0.252204
0.4000 0.249711 0.251752
0.3500 0.249447 0.251336
0.3000 0.249092 0.250970
0.2500 0.248810 0.250678
0.2000 0.248559 0.250420
0.1500 0.248376 0.250230
0.1000 0.248323 0.250172
0.0500 0.248257 0.250107
0.0050 0.248168 0.250024
0.0005 0.248145 0.250000
"""


@pytest.mark.parametrize("line", TABLE_4_1.split("\n")[1:-1])
def test_the_mean_of_faces_is_the_normal_behind_the_table_of_goldfeather_and_interrante(line):
    """T Tab 4.1: quadrics over the plane of that normal, without and with a slope, on the perturbed ring."""
    distance, simple, extended = map(float, line.split())
    ring = article_rings.gs03_ring(distance, perturbed=True)
    R = reference_normals.frame(one(ring.points, "mean"))
    x, y, z = ((ring.neighbors - ring.center) @ R.T).T
    a, _, c = np.linalg.lstsq(np.c_[x * x, x * y, y * y], z, rcond=None)[0]
    close = 2e-6 if distance == 0.0005 else 1.5e-4
    assert abs(-(a + c) - simple) < close
    a, b, c, d, e = np.linalg.lstsq(np.c_[x * x, x * y, y * y, x, y], z, rcond=None)[0]
    mean = -(a * (1 + e * e) + c * (1 + d * d) - b * d * e) / (1 + d * d + e * e) ** 1.5
    assert abs(mean - extended) < close


# --- ExtendedSineFitting -----------------------------------------------------------------------------------------


def fitted(ring, start, *, newton, tolerance=1e-9):
    """The normal, and how many fits it took."""
    out, fits, reasons = np.zeros((1, 3)), np.zeros(1, np.int64), np.zeros(1, np.uint8)
    seen = ring.around._rows, ring.points, start[None], kernels.Solver(newton, tolerance, 50)
    kernels.extended_sine(1, ring.around.centers, *seen, out, fits, reasons)
    assert reasons[0] == 0
    return out[0], int(fits[0])


@pytest.mark.parametrize("off", [1, 15, 45, 60])
def test_extended_sine_does_not_depend_on_the_initial_normal(off):
    rng = np.random.default_rng(off)
    for name in ("sphere", "cylinder", "cubic", "exponential", "trigonometric"):
        for scheme in truth.SCHEMES:
            ring = truth.scheme_ring(graph(name), scheme, int(rng.choice([6, 12])), 0.1)
            known, _ = fitted(ring, ring.exact.normals[0], newton=True)
            start = tilted(ring.exact.normals[0], np.radians(off), rng.uniform(0, 2 * np.pi))
            by_newton, fits = fitted(ring, start, newton=True)
            assert_allclose(by_newton, known, atol=3e-9)
            assert fits <= 60
            by_search, fits = fitted(ring, start, newton=False)
            assert_allclose(by_search, by_newton, atol=1e-8)
            assert fits <= 3000
            if name == "sphere":
                assert np.linalg.norm(by_search - ring.exact.normals[0]) < 1e-7


def test_extended_sine_takes_few_fits():
    for name in ("sphere", "cylinder", "cubic"):
        for scheme in truth.SCHEMES:
            ring = truth.scheme_ring(graph(name), scheme, 6, 0.1)
            start = tilted(ring.exact.normals[0], 0.3, 1.0)
            assert fitted(ring, start, newton=True)[1] <= 10
            assert 100 < fitted(ring, start, newton=False)[1] < 1400


@given(seed=st.integers(0, 2**31 - 1))
def test_both_solvers_and_both_twins_find_the_same_normal(seed):
    points = rough_ring(seed)
    start = reference_normals.of_faces(points[0], reference_normals.around(points[1:]), "area")
    expected = reference_normals.extended_sine_root(points[0], points[1:], start)
    assert_allclose(one(points, "extended_sine", start=start), expected, atol=1e-7)
    assert_allclose(one(points, "extended_sine", start=start, solver="ternary"), expected, atol=1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_the_search_equals_the_corrected_algorithm(seed, monkeypatch):
    points = rough_ring(seed, 7)
    start = reference_normals.plane(points[0], points[1:], points[0] - points[1:].mean(axis=0) + 1e-9)
    calls, harmonics = [], reference_normals.harmonics
    monkeypatch.setattr(reference_normals, "harmonics", lambda *of: (calls.append(1), harmonics(*of))[1])
    expected = reference_normals.extended_sine(points[0], points[1:], start, tolerance=1e-10)
    _, row = reference_normals.ringed(points)
    out, fits, reasons = np.zeros((1, 3)), np.zeros(1, np.int64), np.zeros(1, np.uint8)
    kernels.extended_sine(
        1, row.centers, row._rows, points, start[None], kernels.Solver(False, 1e-10, 50), out, fits, reasons
    )
    assert_allclose(out[0], expected, atol=1e-9)
    assert abs(fits[0] - len(calls)) <= 2  # one step more or less where rounding decides


def test_extended_sine_falls_back_on_the_quadric():
    t = 2 * np.pi * np.array([0, 1, 2]) / 3 + 0.3
    cross = np.concatenate([np.stack([r * np.cos(t), r * np.sin(t), 0.1 * r * np.cos(t)], 1) for r in (1.0, 2.0)])
    points = np.concatenate([np.zeros((1, 3)), cross])  # six neighbors in three directions
    start = np.array([0, 0, 1.0])
    expected = one(points, "quadric", start=start)
    assert_allclose(one(points, "extended_sine", start=start), expected, atol=1e-15)


# --- orders of convergence ---------------------------------------------------------------------------------------


def order(method, surface, scheme, count=6):
    """The slope of log error against log distance over six halvings, and the errors."""
    distances = 0.1 / 2.0 ** np.arange(6)
    errors = []
    for distance in distances:
        ring = truth.scheme_ring(graph(surface), scheme, count, distance)
        errors.append(np.linalg.norm(one(ring.points, method) - ring.exact.normals[0]))
    return np.polyfit(np.log(distances), np.log(errors), 1)[0], errors


@pytest.mark.parametrize("count", [6, 12])
@pytest.mark.parametrize("scheme", ["Rda", "Rdd", "Rdds", "U"])
class TestOrders:
    @pytest.mark.parametrize("method", ["extended_sine", "quadric"])
    def test_is_two_where_the_surface_has_cubic_terms(self, scheme, count, method):
        for surface in ("cubic", "monkey_saddle"):
            slope, errors = order(method, surface, scheme, count)
            assert max(errors) < 1e-9 or abs(slope - 2) < 0.1

    @pytest.mark.parametrize("method", ["extended_sine", "quadric"])
    def test_is_three_where_it_has_none(self, scheme, count, method):
        for surface in ("cylinder", "elliptic_paraboloid"):
            slope, _ = order(method, surface, scheme, count)
            assert abs(slope - 3) < 0.25

    @pytest.mark.parametrize("method", ["plane", "area"])
    def test_of_the_plane_and_the_faces_is_one(self, scheme, count, method):
        slope, _ = order(method, "elliptic_paraboloid", scheme, count)
        assert abs(slope - 1) < 0.1


# --- naive twins -------------------------------------------------------------------------------------------------

TWINS = {
    "plane": lambda P, Q, N: reference_normals.plane(P, Q, N),
    "quadric": lambda P, Q, N: reference_normals.quadric(P, Q, N),
    "chen_schmitt": lambda P, Q, N: reference_normals.chen_schmitt(P, Q, N),
}
OPTIONS = [
    ("plane", {"variant": "svd4"}, lambda P, Q, N: reference_normals.plane(P, Q, N, "svd4")),
    ("quadric", {"passes": 3}, lambda P, Q, N: reference_normals.quadric(P, Q, N, 3)),
    ("chen_schmitt", {"normalized": True}, lambda P, Q, N: reference_normals.chen_schmitt(P, Q, N, True)),
    *((name, {}, twin) for name, twin in TWINS.items()),
    *(
        (name, {}, lambda P, Q, N, name=name: reference_normals.of_faces(P, reference_normals.around(Q), name))
        for name in OF_FACES
    ),
]


@given(seed=st.integers(0, 2**31 - 1))
@pytest.mark.parametrize(("method", "options", "twin"), OPTIONS, ids=lambda v: v if isinstance(v, str) else "")
def test_kernels_equal_their_twins(method, options, twin, seed):
    points = rough_ring(seed)
    side = reference_normals.of_faces(points[0], reference_normals.around(points[1:]), "area")
    start = {} if method in OF_FACES else {"start": side}
    assert_allclose(one(points, method, **start, **options), twin(points[0], points[1:], side), atol=1e-9)


def test_means_of_faces_use_the_existing_triangles():
    """On borders, and where two bodies meet in a point, which no ring of neighbors tells."""
    points = np.random.default_rng(0).normal(size=(7, 3))
    body = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    faces = np.concatenate([body[:3], np.where(body > 0, body + 3, 0)])
    for method in OF_FACES:
        found = sm.vertex_normals((points, faces), method)
        for i in range(7):
            turned = [face[j:] + face[:j] for face in faces.tolist() for j in range(3) if face[j] == i]
            wedges = [(points[a], points[b]) for _, a, b in turned]
            assert_allclose(found[i], reference_normals.of_faces(points[i], wedges, method), atol=1e-12)


# --- what every estimator keeps ----------------------------------------------------------------------------------


@given(
    seed=st.integers(0, 2**31 - 1),
    scale=st.floats(1e-3, 1e3),
    shift=st.tuples(*[st.floats(-10, 10)] * 3),
    turn=st.integers(0, 2**31 - 1),
)
@pytest.mark.parametrize("method", NAMES)
def test_rotates_with_the_surface_whatever_its_place_and_size(method, seed, scale, shift, turn):
    points = rough_ring(seed)
    R = Rotation.random(random_state=turn).as_matrix()
    moved = scale * points @ R.T + np.array(shift)
    found, expected = one(moved, method), one(points, method) @ R.T
    assert_allclose(found, expected, atol=1e-7)


@given(turn=st.integers(0, 2**31 - 1), surface=st.sampled_from(["elliptic_paraboloid", "hyperboloid", "cylinder"]))
def test_ties_of_opposite_pairs_are_not_broken_by_rounding(turn, surface):
    ring = truth.scheme_ring(graph(surface), "R", 12, 0.1)
    R = Rotation.random(random_state=turn).as_matrix()
    assert_allclose(one(ring.points @ R.T, "chen_schmitt"), R @ one(ring.points, "chen_schmitt"), atol=1e-9)


@given(seed=st.integers(0, 2**31 - 1))
@pytest.mark.parametrize("method", ["plane", "quadric", "extended_sine", "chen_schmitt"])
def test_does_not_depend_on_the_order_of_the_neighbors(method, seed):
    points = rough_ring(seed)
    mixed = np.concatenate([points[:1], np.random.default_rng(seed).permutation(points[1:])])
    start = reference_normals.of_faces(points[0], reference_normals.around(points[1:]), "area")
    assert_allclose(one(mixed, method, start=start), one(points, method, start=start), atol=1e-8)


@pytest.mark.parametrize("method", NAMES)
def test_reversed_faces_reverse_the_normals(method):
    mesh = sm.torus(20, 12).triangulated("dual")
    there, back = sm.vertex_normals(mesh, method), sm.vertex_normals((mesh.vertices, mesh.faces[:, ::-1]), method)
    if method != "chen_schmitt":  # its ties fall otherwise
        assert_allclose(back, -there, atol=1e-8)
    assert ((back * there).sum(axis=1) < -0.9).all()


@pytest.mark.parametrize("method", NAMES)
def test_of_some_vertices_are_rows_of_all(method):
    mesh = sm.torus(20, 12).triangulated("dual")
    assert_allclose(sm.vertex_normals(mesh, method, at=[7, 3, 7]), sm.vertex_normals(mesh, method)[[7, 3, 7]])


@pytest.mark.parametrize("along_the_beam", [False, *nightly(True)])
@pytest.mark.parametrize(("ratio", "noise"), [(5, 0.2), (50, 2), *nightly((10, 0.2), (50, 0.2))])
def test_clouds_on_lines_of_a_scanner_have_normals_and_curvatures(ratio, noise, along_the_beam):
    count = round((10_000 / ratio) ** 0.5)
    turn, height = np.meshgrid(np.linspace(0, 3, 10_000 // count), np.linspace(0.6, 2.4, count))
    ball = np.column_stack([(f(turn) * np.sin(height)).ravel() for f in (np.cos, np.sin)] + [np.cos(height).ravel()])
    deviation = noise * 3 * count / 10_000 * np.random.default_rng(0).normal(size=ball.shape)
    points = ball + (deviation[:, :1] * ball if along_the_beam else deviation)
    off = np.degrees(np.arccos(np.abs((sm.vertex_normals(points) * ball).sum(axis=1)).clip(0, 1)))
    assert np.median(off) < 1.5
    assert np.median(np.abs(np.abs(sm.curvature(points).mean) - 1)) < 0.25
