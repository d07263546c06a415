"""Which kind points are of: five scenes as in table 5.1 of the thesis, and kinds that a simpler one replaces."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.cloud.fitting import selection
from tests.cloud.fitting.clouds import SURFACES, exact, moved, noisy, same, with_outliers
from tests.nightly.marks import nightly

P = sm.primitives
SCENES = {
    "torus": (P.Torus([0, 0, 0], [0, 0, 1], 300.0, 100.0), [[0, 1.6], [-1.5, 1.5]], 5407, 4.66),
    "cone": (P.Cone([0, 0, 0], [0, 0, 1], np.radians(15)), [[0, 3.0], [60, 160]], 664, 0.48),
    "cylinder": (P.Cylinder([0, 0, 0], [0, 0, 1], 100.0), [[0, 2.8], [0, 400]], 7946, 2.30),
    "sphere": (P.Sphere([0, 0, 0], 38.0), [[0, 3.0], [-1, 1]], 388, 0.58),
    "plane": (P.Plane([0, 0, 0], [0, 0, 1]), [[0, 300], [0, 200]], 1169, 2.22),
}
"""Sizes and noise of table 5.1, in millimeters."""


def scene(kind, seed):
    """Return the points of a scene, somewhere."""
    primitive, ends, count, noise = SCENES[kind]
    rng = np.random.default_rng(seed)
    low, high = np.array(ends, float).T
    points = moved(primitive, primitive.at(rng.uniform(low, high, (count, 2))), noise, rng)
    return points @ Rotation.random(random_state=seed).as_matrix().T + rng.normal(0, 1e4, 3)


@pytest.mark.parametrize("seed", [0, *nightly(1, 2, 3)])
@pytest.mark.parametrize("kind", SCENES)
def test_table_of_the_thesis(kind, seed):
    """The right kind is chosen, where the least e' is often that of a richer one."""
    points = scene(kind, seed)
    found = sm.fit_primitive(points, "any")
    assert found.kind == kind
    assert found.fit.noise == pytest.approx(SCENES[kind][3], rel=0.12)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        simpler = [sm.fit_primitive(points, each).fit.noise for each in selection.SIMPLER.get(kind, ())]
    assert all(noise > 1.5 * found.fit.noise for noise in simpler)


@pytest.mark.parametrize("kind", SURFACES)
def test_exact_choices(kind):
    primitive, points = exact(kind)
    assert same(sm.fit_primitive(points, "any"), primitive)


@pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=[pytest.mark.nightly] * (k not in ("plane", "cone"))) for k in SURFACES]
)
def test_robust_choices(kind):
    cloud = with_outliers(noisy(kind, 400)[1], 0.2, np.random.default_rng(0))[0]
    assert sm.fit_primitive(cloud, "any", robust=True).kind == kind


NESTED = [
    ("plane", "cylinder"),
    ("plane", "torus"),
    ("sphere", "torus"),
    ("cylinder", "cone"),
]


@pytest.mark.parametrize(("kind", "wanted"), NESTED)
def test_a_simpler_kind_is_named(kind, wanted):
    _, points = noisy(kind, 600, noise=0.05)
    with pytest.warns(sm.SimplexMeshWarning, match=f"as well on a {kind}: the parameters of the {wanted}"):
        sm.fit_primitive(points, wanted, start=_start(wanted, points))


def _start(wanted, points):
    middle = points.mean(axis=0)
    starts = {
        "cylinder": P.Cylinder(middle + np.array([0, 0, 9]), [1, 0, 0], 9.0),
        "torus": P.Torus(middle, [0, 0, 1], 3.0, 1.5),
        "cone": P.Cone(middle - 20 * P.Cylinder(middle, [1, 2, 0.3], 1).axis, [1, 2, 0.3], 0.1),
    }
    return starts[wanted]


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize("radius", [1000.0, 0.06])
def test_a_radius_that_points_contradict_is_told(radius, robust):
    """A pipe of radius 0.05 is nearly a plane of one of 1000: distances are noise to all tests."""
    with pytest.warns(sm.SimplexMeshWarning, match=r"^with radius as known the points are .* radius 0\.0[45]"):
        sm.fit_primitive(pipe_of_5_cm(), "cylinder", radius=radius, robust=robust)


@pytest.mark.parametrize("known", [{"radius": 0.0505}, {"axis": [0, 0.002, 1]}, {"point": [0, 0, 7]}])
def test_values_that_are_nearly_right_are_not_warned_of(known):
    assert sm.fit_primitive(pipe_of_5_cm(), "cylinder", **known).radius == pytest.approx(0.05, rel=0.02)


def test_a_wrong_radius_of_a_long_pipe_is_told():
    """Its points are a hundredth of a thousandth of their size away from the wrong one."""
    with pytest.warns(sm.SimplexMeshWarning, match=r"^with radius as known the points are .* radius 0\.0[45]"):
        sm.fit_primitive(pipe_of_5_cm(100.0), "cylinder", radius=0.06)


def pipe_of_5_cm(length=1.0):
    rng = np.random.default_rng(0)
    turn, height = rng.uniform([0, 0], [2 * np.pi, length], (2000, 2)).T
    return np.stack([0.05 * np.cos(turn), 0.05 * np.sin(turn), height], axis=1) + rng.normal(0, 1e-3, (2000, 3))


def test_the_wanted_kind_is_not_warned_of():
    for kind in SURFACES:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            sm.fit_primitive(noisy(kind)[1], kind)


def test_a_layer_of_noise_is_no_tube():
    cloud = np.random.default_rng(0).normal(size=(600, 3)) * [1, 1, 5]
    with pytest.warns(sm.SimplexMeshWarning, match="a layer about as thick as the cylinder"):
        sm.fit_primitive(cloud, "cylinder")
    assert sm.fit_primitive(cloud, "any").kind == "plane"


def test_the_order_of_scores():
    """A parameter more must take more than chance from the sum of squares."""
    points = noisy("cylinder", 500)[1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        plane, cylinder, cone = (sm.fit_primitive(points, kind) for kind in ("plane", "cylinder", "cone"))
    assert cone.rms <= cylinder.rms < plane.rms
    assert selection.simplest([plane, cylinder, cone], points) is cylinder
    assert selection.simplest([plane, cone], points) is cone
