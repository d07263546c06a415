"""Fits of one kind: from nothing but points, with known parameters, in any pose and unit."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from scipy.stats import chi2, kstest, spearmanr

import simplexmesh as sm
from simplexmesh.cloud.fitting.solver import solve
from tests.cloud.fitting.clouds import PRIMITIVES, SURFACES, exact, moved, noisy, same

P = sm.primitives
every = pytest.mark.parametrize("kind", PRIMITIVES)


@every
def test_exact_points(kind):
    primitive, points = exact(kind)
    found = sm.fit_primitive(points, kind)
    assert same(found, primitive, 1e-6)
    assert found.rms < 1e-6
    assert found.fit.count == len(points)


@every
def test_least_squares_are_those_from_the_truth(kind):
    primitive, points = noisy(kind)
    found = sm.fit_primitive(points, kind)
    from_truth = solve(primitive, points)
    assert_allclose(found.rms, np.sqrt(np.mean(from_truth.distance(points) ** 2)), rtol=1e-7)


@every
def test_errors_are_those_of_the_formulas(kind):
    primitive, points = noisy(kind)
    fit = sm.fit_primitive(points, kind).fit
    square = (sm.fit_primitive(points, kind).distance(points) ** 2).sum()
    count = len(points) * (2 if kind in ("line", "circle") else 1)
    assert_allclose(fit.rms, np.sqrt(square / len(points)))
    assert_allclose(fit.noise, np.sqrt(square / (count - primitive.n_parameters)))
    assert 0.018 < fit.noise < 0.022


@every
def test_points_are_within_the_extent(kind):
    _, points = noisy(kind)
    found = sm.fit_primitive(points, kind)
    sizes = np.diff(found.extent)[:, 0]
    assert (sizes >= 0).all()
    if kind not in ("line", "circle"):
        assert_allclose(found.sampled(50).points, found.projected(found.sampled(50).points), atol=1e-9)


@every
def test_motions_move_fits(kind):
    _, points = noisy(kind)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.random(random_state=3).as_matrix(), [5, -7, 3]
    there = sm.fit_primitive(points @ T[:3, :3].T + T[:3, 3], kind)
    assert same(there, sm.fit_primitive(points, kind).transformed(T), 2e-4)


@every
@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_units(kind, scale):
    _, points = noisy(kind)
    here, there = sm.fit_primitive(points, kind), sm.fit_primitive(scale * points, kind)
    T = np.diag([1 / scale] * 3 + [1])
    assert same(there.transformed(T), here, 2e-4)
    assert_allclose(there.rms, scale * here.rms, rtol=1e-6)


@every
def test_far_from_the_origin(kind):
    _, points = noisy(kind)
    far = np.array([1e6, -2e6, 5e5])
    here, there = sm.fit_primitive(points, kind), sm.fit_primitive(points + far, kind)
    assert_allclose(there.rms, here.rms, rtol=1e-6)
    assert_allclose(np.diagonal(there.covariance), np.diagonal(here.covariance), rtol=1e-2)


KNOWN = [
    ("plane", {"axis": [1, 2, 0.3]}),
    ("plane", {"point": [1, 2, 3]}),
    ("sphere", {"radius": 2.0}),
    ("sphere", {"point": [1, 2, 3]}),
    ("cylinder", {"radius": 2.0}),
    ("cylinder", {"axis": [1, 2, 0.3]}),
    ("cylinder", {"point": [1, 2, 3]}),
    ("cylinder", {"axis": [1, 2, 0.3], "point": [1, 2, 3]}),
    ("cylinder", {"axis": [-1, -2, -0.3], "radius": 2.0}),
    ("cone", {"half_angle": 0.3}),
    ("cone", {"axis": [-1, -2, -0.3]}),
    ("cone", {"point": [1, 2, 3]}),
    ("torus", {"radius": 4.0}),
    ("torus", {"tube_radius": 1.0}),
    ("torus", {"axis": [1, 2, 0.3], "tube_radius": 1.0}),
    ("torus", {"point": [1, 2, 3]}),
    ("line", {"axis": [1, 2, 0.3]}),
    ("line", {"point": [1, 2, 3]}),
    ("circle", {"radius": 2.0}),
    ("circle", {"axis": [1, 2, 0.3]}),
    ("circle", {"point": [1, 2, 3]}),
]


@pytest.mark.parametrize(("kind", "known"), KNOWN)
def test_known_parameters_are_kept(kind, known):
    primitive, points = noisy(kind)
    found, free = sm.fit_primitive(points, kind, **known), sm.fit_primitive(points, kind)
    for name, value in known.items():
        if name == "axis":
            sign = 1 if kind == "cone" else np.sign(primitive._pose[1] @ value)
            assert_allclose(found._pose[1] @ primitive._pose[1], sign, atol=1e-12)
        elif name == "point":
            on = found._pose[0] - np.array(value)
            assert abs(np.linalg.norm(on)) < 1e-9
        else:
            assert getattr(found, name) == pytest.approx(value, rel=1e-12)
    assert free.rms <= found.rms * (1 + 1e-9)
    assert found.rms < 1.05 * free.rms
    fixed = np.diagonal(found.covariance) == 0
    assert 0 < fixed.sum() < len(fixed)
    assert (np.diagonal(found.covariance) <= 1.02 * np.diagonal(free.covariance)).all() or kind == "cylinder"


def test_a_wrong_known_radius_is_kept_too():
    _, points = noisy("cylinder")
    with pytest.warns(sm.SimplexMeshWarning, match="with radius as known"):
        found = sm.fit_primitive(points, "cylinder", radius=2.3)
    assert found.radius == 2.3
    assert found.rms > 1.3 * sm.fit_primitive(points, "cylinder").rms


def test_given_starts_and_normals():
    primitive, points = noisy("torus")
    free = sm.fit_primitive(points, "torus")
    assert same(sm.fit_primitive(points, "torus", start=primitive), free, 1e-4)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (len(points), 1))
    assert same(sm.fit_primitive(points, "torus", normals=signs * primitive.gradient(points)), free, 1e-4)


def test_weights_are_inverse_variances():
    primitive, points = exact("cylinder", 600)
    rng = np.random.default_rng(0)
    deviation = rng.choice([0.01, 0.1], len(points))
    points = moved(primitive, points, deviation[:, None], rng)
    plain, weighted = (sm.fit_primitive(points, "cylinder", weights=w) for w in (None, 7 / deviation**2))
    assert weighted.covariance[4, 4] < 0.2 * plain.covariance[4, 4]
    assert abs(weighted.radius - 2) < 4 * np.sqrt(weighted.covariance[4, 4])
    expected = 1 / weighted.normal_equations(points, deviation**-2.0)[0][4, 4]
    assert expected < weighted.covariance[4, 4]
    assert_allclose(weighted.covariance * np.mean(1 / deviation**2), _covariance(weighted, points, deviation), rtol=0.2)


def _covariance(primitive, points, deviation):
    return np.linalg.inv(primitive.normal_equations(points, deviation**-2.0)[0]) * np.mean(1 / deviation**2)


@every
def test_weights_count_points(kind):
    _, points = noisy(kind, 200)
    counts = np.random.default_rng(0).integers(0, 4, len(points))
    weighted = sm.fit_primitive(points, kind, weights=counts)
    assert same(weighted, sm.fit_primitive(np.repeat(points, counts, axis=0), kind), 1e-4)
    assert weighted.fit.count == np.count_nonzero(counts)


def test_known_noise_sets_the_covariance():
    _, points = noisy("sphere")
    plain, told = sm.fit_primitive(points, "sphere"), sm.fit_primitive(points, "sphere", noise=0.04)
    assert_allclose(told.covariance, plain.covariance * (0.04 / plain.fit.noise) ** 2)
    assert told.fit.validation.chi_square is not None


@pytest.mark.parametrize("kind", SURFACES)
def test_right_kinds_are_valid_and_wrong_ones_not(kind):
    _, points = noisy(kind, 800)
    assert sm.fit_primitive(points, kind).fit.validation.p_value > 1e-3
    wrong = "cylinder" if kind == "sphere" else "sphere"
    if kind != "plane":
        assert not sm.fit_primitive(points, wrong).fit.validation.valid


@pytest.mark.nightly
@every
def test_deviations_are_as_predicted(kind):
    """The mean of the squared errors, in units of the predicted covariance, is the number of parameters."""
    primitive, points = exact(kind, 200)
    rng = np.random.default_rng(1)
    found = []
    for _ in range(60):
        fit = sm.fit_primitive(moved(primitive, points, 0.02, rng), kind, start=primitive)
        matrix, downhill, _ = fit.normal_equations(points)
        step = np.linalg.solve(matrix, downhill)
        found.append(step @ np.linalg.solve(fit.covariance, step) / primitive.n_parameters)
    deviation = np.sqrt(2 / primitive.n_parameters / len(found))
    assert abs(np.mean(found) - 1) < 4 * deviation


def cylinders(count):
    """Yield radius-1 cylinders' points of every arc, length, offset and noise, and what they are."""
    for seed in range(count):
        rng = np.random.default_rng(seed)
        arc, length = np.radians(rng.uniform(30, 360)), np.exp(rng.uniform(np.log(0.2), np.log(10)))
        offset, noise = rng.choice([0, 1, 10, 1e6]), rng.choice([0.01, 0.03, 0.1])
        pipe = P.Cylinder(offset * rng.normal(size=3), rng.normal(size=3), 1.0)
        points = pipe.at(np.column_stack([rng.uniform(0, arc, 500), rng.uniform(0, length, 500)]))
        yield pipe, moved(pipe, points, noise, rng), noise


def reached(count):
    """Return, of fits of cylinders without a warning: how many, radii within three deviations, least squares met."""
    told = near = least = 0
    for pipe, points, noise in cylinders(count):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = sm.fit_primitive(points, "cylinder")
        if caught:
            assert noise > 0.01  # nothing is undetermined but for noise
            continue
        told += 1
        near += abs(found.radius - 1) < 3 * np.sqrt(found.covariance[4, 4])
        least += found.rms <= (1 + 1e-6) * np.sqrt(np.mean(solve(pipe, points).distance(points) ** 2))
    return told, near, least


def test_cylinders_of_every_shape():
    told, near, least = reached(30)
    assert told >= 24
    assert near >= 0.95 * told
    assert least == told


@pytest.mark.nightly
def test_many_cylinders_of_every_shape():
    told, near, least = reached(700)
    assert told >= 0.9 * 700
    assert near >= 0.98 * told
    assert least >= 0.998 * told


def test_a_million_points():
    _, points = noisy("cylinder", 1_000_000, noise=0.05)
    found = sm.fit_primitive(points, "cylinder")
    assert abs(found.radius - 2) < 4 * np.sqrt(found.covariance[4, 4])
    assert np.sqrt(found.covariance[4, 4]) < 1e-3
    assert found.fit.validation.p_value > 1e-3


def test_weights_choose_the_kind_and_the_start_too():
    primitive, points = noisy("cylinder")
    rng = np.random.default_rng(3)
    strays = rng.uniform(points.min(axis=0) - 2, points.max(axis=0) + 2, (400, 3))
    weights = np.append(np.ones(len(points)), np.full(len(strays), 1e-9))
    for kind in ("any", "cylinder"):
        found = sm.fit_primitive(np.concatenate([points, strays]), kind, weights=weights)
        assert found.kind == "cylinder"
        assert found.radius == pytest.approx(primitive.radius, rel=0.01)


def test_validation_of_weighted_points_knows_their_noise():
    primitive, points = exact("cylinder", 800)
    rng = np.random.default_rng(2)
    deviation = np.where(rng.random(800) < 0.5, 0.005, 0.05)
    points = points + (deviation * rng.normal(size=800))[:, None] * primitive.gradient(points)
    weights = 1 / deviation**2
    found = sm.fit_primitive(points, "cylinder", weights=weights, noise=float(weights.mean() ** -0.5))
    tests = found.fit.validation
    assert tests.valid
    assert tests.chi_square.statistic == pytest.approx(800, rel=0.15)
    assert tests.normality.passed


def test_a_robust_fit_tells_which_points_it_used():
    _, points = noisy("sphere")
    far = points.copy()
    far[:40] += 1.0
    fit = sm.fit_primitive(far, "sphere", robust=True).fit
    assert len(fit.vertices) == fit.count
    assert len(np.intersect1d(fit.vertices, np.arange(40))) < 8
    assert sm.fit_primitive(points, "sphere").fit.vertices is None


def test_normals_are_as_far_off_as_planes_through_neighbors_say():
    """Of known noise, the squared tilt by its covariance has the chi-square law of two degrees."""
    rng = np.random.default_rng(0)
    ratios, said, off = [], [], []
    for _ in range(200):
        near = rng.uniform(-1, 1, (rng.integers(6, 60), 3)) * [*rng.uniform(0.1, 1, 2), 0]
        near[:, 2] = rng.normal(0, 0.02, len(near))
        plane = sm.fit_primitive(near, "plane", noise=0.02)
        tilt = plane.frame[:2] @ [0, 0, 1.0]
        covariance = plane.covariance[:2, :2]
        ratios.append(tilt @ np.linalg.solve(covariance, tilt))
        said.append(np.trace(covariance))
        off.append(tilt @ tilt)
    assert kstest(ratios, chi2(2).cdf).pvalue > 1e-3
    assert spearmanr(said, off).statistic > 0.6
