"""Beams and flanges fitted to what scanners see of them: sizes, deviations, what no point tells, strays."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from tests.cloud.fitting.clouds import with_outliers
from tests.nightly.marks import nightly

P = sm.primitives
KINDS = {"beam": P.Beam, "flange": P.Flange, "flange pair": P.FlangePair}
NOISE = 5e-4
every = pytest.mark.parametrize("kind", KINDS)


def made(kind, rng):
    """A beam or flange of random sizes anywhere, with ends."""
    first, _, axis = Rotation.random(random_state=rng.integers(2**31)).as_matrix()
    place, size = 5 * rng.normal(size=3), rng.uniform(0.1, 0.6)
    if kind == "beam":
        width = size * rng.uniform(0.4, 1)
        thick = size * rng.uniform(0.04, 0.09), width * rng.uniform(0.04, 0.09)
        out = P.Beam(place, axis, size, width, *thick, across=first)
        ends = [[0, rng.uniform(2, 8) * size], [0, out._knots[-1]]]
    else:
        out = KINDS[kind](place, axis, size / 2, size * rng.uniform(0.08, 0.3), size * rng.uniform(0.2, 0.37))
        beyond = rng.uniform(0.5, 1.5, 2) * size * [1, kind == "flange pair"]
        ends = [[-np.pi, np.pi], [-beyond[0], min(out._knots[4] + beyond[1], out._knots[-1])]]
    return out.with_fit(P.Fit(0.0, 0.0, np.zeros((out.n_parameters,) * 2), np.array(ends), 1))


def stations(primitive, rng, *, across):
    """Two places to scan from, diagonally opposite: of a beam also from one side of the web and flanges each."""
    turn, up = rng.uniform(0.3, 1), rng.uniform(0.3, 0.8)
    one = [np.cos(turn), np.sin(turn), up]
    other = [-np.cos(turn), -np.sin(turn) if across else np.sin(turn), -up]
    middle, size = primitive.bounds.mean(axis=0), np.linalg.norm(np.ptp(primitive.bounds, axis=0))
    return middle + 3 * size * np.array([one, other]) @ primitive.frame


def scanned(primitive, rng, *, count=1500, across=True):
    """Noisy points of those sides that are seen from the stations, with nothing of the primitive before them."""
    cloud = primitive.sampled(3 * count, rng=rng)
    size = float(np.ptp(cloud.points, axis=0).max())
    seen = np.zeros(len(cloud.points), bool)
    for station in stations(primitive, rng, across=across):
        to = station - cloud.points
        to /= np.linalg.norm(to, axis=1)[:, None]
        facing = np.einsum("ij,ij->i", to, cloud.normals) > 0.1
        left, at = np.flatnonzero(facing & ~seen), cloud.points + 2e-3 * size * to
        for _ in range(100):  # as far on as nothing can be met
            free = primitive.distance(at[left])
            left, free = left[free > 0], free[free > 0]
            at[left] += np.maximum(free, 3e-3 * size)[:, None] * to[left]
            gone = np.linalg.norm(at[left] - cloud.points[left], axis=1) > 1.5 * size
            seen[left[gone]] = True
            left = left[~gone]
            if not len(left):
                break
    at = np.flatnonzero(seen)[:count]
    return cloud.points[at] + NOISE * rng.normal(size=(len(at), 1)) * cloud.normals[at]


@every
@pytest.mark.parametrize("count", [5, *nightly(20)])
def test_many_seen_from_two_stations(kind, count):
    off = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        primitive = made(kind, rng)
        points = scanned(primitive, rng)
        assert len(points) > 800
        found = sm.fit_primitive(points, kind)
        assert found.rms < 1.05 * NOISE
        assert abs(found.axis @ primitive.axis) > np.cos(np.radians(0.2))
        deviations = np.sqrt(np.diag(found.covariance))[-len(found._shape) :]
        off.append((np.array(found._shape) - primitive._shape) / deviations)
        if kind == "beam":
            assert abs(found.frame[0] @ primitive.frame[0]) > np.cos(np.radians(0.2))
        if kind == "flange":
            assert found.axis @ primitive.axis > 0
    assert np.abs(off).max() < 5
    assert 0.7 < np.sqrt(np.mean(np.square(off))) < 1.3


def test_a_beam_seen_from_above_needs_a_measure():
    for seed in range(2):
        rng = np.random.default_rng(seed)
        beam = made("beam", rng)
        points = scanned(beam, rng, across=False)
        with pytest.raises(ValueError, match=r"leave some of its parameters free: shift \w, depth, flange thickness$"):
            sm.fit_primitive(points, "beam")
        found = sm.fit_primitive(points, "beam", measures={"depth": beam.depth})
        assert found.depth == beam.depth
        assert found.covariance[5].tolist() == [0.0] * 9
        off = np.array(found._shape[1:]) - beam._shape[1:]
        assert (np.abs(off) < 5 * np.sqrt(np.diag(found.covariance))[-3:]).all()


@every
def test_units_and_motions(kind):
    rng = np.random.default_rng(3)
    primitive = made(kind, rng)
    points = scanned(primitive, rng)
    found = sm.fit_primitive(points, kind)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = 1000 * Rotation.random(random_state=1).as_matrix(), [4e5, 5e6, 100]
    moved = sm.fit_primitive(points @ T[:3, :3].T + T[:3, 3], kind)
    assert np.allclose(moved._shape, 1000 * np.array(found._shape), rtol=1e-5)


@pytest.mark.parametrize("kind", ["flange", "flange pair"])
def test_strays(kind):
    rng = np.random.default_rng(3)
    primitive = made(kind, rng)
    points, out = with_outliers(scanned(primitive, rng), 0.1, rng)
    steady = sm.fit_primitive(points, kind, robust=True)
    assert np.allclose(steady._shape, primitive._shape, atol=6 * NOISE)
    assert np.mean(out[steady.fit.vertices]) < 0.02


@every
def test_fits_have_ends_and_verdicts(kind):
    rng = np.random.default_rng(5)
    primitive = made(kind, rng)
    found = sm.fit_primitive(scanned(primitive, rng), kind)
    assert found.fit.validation.valid
    assert (found.mesh().genus, found.mesh().n_holes) == (0, 1 if kind == "flange" else 2)
    along = 0 if kind == "beam" else 1
    assert np.ptp(found.extent[along]) == pytest.approx(np.ptp(primitive.extent[along]), rel=0.1)


@pytest.mark.parametrize(
    ("kind", "measures", "said"),
    [
        ("beam", {"height": 1.0}, "height must be left out: a beam has none"),
        ("beam", {"depth": -1.0}, "depth must be above 0"),
        ("beam", {1: 1.0}, "1 must be left out: a beam has none"),
        ("cylinder", {"depth": 1.0}, "depth must be left out: a cylinder has none"),
        (
            "flange",
            {"neck": 1.0},
            "neck must be left out: a flange has none; its measures are radius, thickness, neck_",
        ),
        ("flange", {"neck radius": 1.0}, "neck radius must be left out"),
        ("beam", {"axis": [0, 0, 1]}, "axis must be left out"),
        ("beam", {"depth": None}, "depth must be a number"),
        ("any", {"depth": 1.0}, "depth must be left out where any kind is looked for"),
        ("flange", {"neck_radius": "wide"}, "neck_radius must be a number"),
        ("flange", [("radius", 1.0)], "measures must map names to lengths, not be a list"),
    ],
)
def test_measures_that_are_none(kind, measures, said):
    with pytest.raises((TypeError, ValueError), match=said):
        sm.fit_primitive(np.random.default_rng(0).normal(size=(100, 3)), kind, measures=measures)


@pytest.mark.parametrize("known", [{"radius": 0.1}, {"measures": {"radius": 0.1}}, {"axis": [0, 0, 1]}])
def test_a_flange_of_which_a_measure_or_the_axis_is_known(known):
    """Starts about wrong axes, of which the neck is wider than the known radius, ended the whole fit."""
    rng = np.random.default_rng(0)
    turn, along = rng.uniform([0, -0.2], [2 * np.pi, 0.18], (3_000, 2)).T
    points = sm.primitives.Flange([0, 0, 0], [0, 0, 1], 0.1, 0.03, 0.05).at(np.stack([turn, along], axis=1))
    found = sm.fit_primitive(points + rng.normal(0, 3e-4, points.shape), "flange", **known)
    assert found._shape == pytest.approx((0.1, 0.03, 0.05), abs=5e-4)


def test_a_pair_is_no_start_of_a_flange_and_no_measure_is_given_twice():
    points, pair = (
        np.random.default_rng(0).normal(size=(100, 3)),
        sm.primitives.FlangePair([0, 0, 0], [0, 0, 1], 2, 1, 1),
    )
    with pytest.raises(TypeError, match="start must be a flange"):
        sm.fit_primitive(points, "flange", start=pair)
    with pytest.raises(ValueError, match="radius must be given once"):
        sm.fit_primitive(points, "flange", radius=1.0, measures={"radius": 1.0})


def test_a_known_measure_that_suits_no_start_is_named():
    """The sentence said that the points were flat, which they are not."""
    points = np.random.default_rng(0).normal(size=(300, 3))
    with pytest.raises(ValueError, match="points must determine a flange, but these, or neck_radius as known, lead to"):
        sm.fit_primitive(points, "flange", measures={"neck_radius": 50.0})
