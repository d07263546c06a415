"""Points that determine nothing, and arguments that are none: one sentence each."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import simplexmesh as sm
from tests.cloud.fitting.clouds import PRIMITIVES, noisy, same

every = pytest.mark.parametrize("kind", PRIMITIVES)
LEAST = {"plane": 3, "sphere": 4, "cylinder": 5, "cone": 6, "torus": 7, "line": 2, "circle": 3}
RNG = np.random.default_rng(0)


@every
def test_too_few_points(kind):
    points = RNG.normal(size=(LEAST[kind] - 1, 3))
    with pytest.raises(ValueError, match=f"points must be at least {LEAST[kind]} to determine a {kind}"):
        sm.fit_primitive(points, kind)
    with pytest.raises(ValueError, match=r"different ones to determine|all .* are at one place"):
        sm.fit_primitive(np.repeat(points, 40, axis=0), kind)
    with pytest.raises(ValueError, match="not 0"):
        sm.fit_primitive(np.zeros((0, 3)), kind)


@every
def test_a_million_points_at_one_place(kind):
    with pytest.raises(ValueError, match="all 1,000,000 are at one place"):
        sm.fit_primitive(np.full((1_000_000, 3), 0.1), kind)


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "cone", "torus"])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_points_in_a_plane(kind, offset):
    points = RNG.normal(size=(100, 2)) @ [[1, 2, 0.5], [0, 1, -1]] + offset
    with pytest.raises(ValueError, match=f"points must not lie in one plane: they do not determine a {kind}"):
        sm.fit_primitive(points, kind)
    assert sm.fit_primitive(points, "any").kind == "plane"


@pytest.mark.parametrize("kind", ["plane", "sphere", "cylinder", "cone", "torus", "circle"])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_points_on_a_line(kind, offset):
    points = RNG.normal(size=(100, 1)) * [[1, 2, 0.5]] + offset
    with pytest.raises(ValueError, match=f"points must not lie on one line: they do not determine a {kind}"):
        sm.fit_primitive(points, kind)
    with pytest.raises(ValueError, match="points must determine a plane"):
        sm.fit_primitive(points, "any")


@every
def test_duplicates_change_nothing(kind):
    _, points = noisy(kind, 200)
    once, often = sm.fit_primitive(points, kind), sm.fit_primitive(np.repeat(points, 3, axis=0), kind)
    assert same(once, often, 1e-4)


@every
def test_as_many_points_as_parameters(kind):
    """The fit is exact or says that it is none, and the noise is not known."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        points = noisy(kind, LEAST[kind], seed=3)[1]
        try:
            found = sm.fit_primitive(points, kind, start=PRIMITIVES[kind][0])
        except ValueError as error:
            assert "determine" in str(error)  # noqa: PT017
            return
    assert found.fit.validation is None
    assert np.isnan(found.fit.noise) == (kind not in ("circle",)) or found.rms > 0


POINTS = noisy("cylinder", 50)[1]
WRONG = [
    ((POINTS, "cilinder"), {}, ValueError, "did you mean 'cylinder'"),
    ((POINTS, "plane"), {"radius": 2.0}, ValueError, "radius must be left out: a plane has none"),
    ((POINTS, "cylinder"), {"half_angle": 0.2}, ValueError, "half_angle must be left out: a cylinder has none"),
    ((POINTS, "any"), {"radius": 2.0}, ValueError, "radius must be left out where any kind is looked for"),
    ((POINTS, "cylinder"), {"radius": -1.0}, ValueError, "radius must be above 0"),
    ((POINTS, "cylinder"), {"radius": "5 cm"}, TypeError, "radius must be a number"),
    ((POINTS, "cylinder"), {"axis": [0, 0, 0]}, ValueError, "axis must be a direction"),
    ((POINTS, "cone"), {"half_angle": 30.0}, ValueError, "half_angle must be below pi / 2, in radians"),
    ((POINTS, "cylinder"), {"start": sm.primitives.Sphere([0, 0, 0], 1)}, TypeError, "start must be a cylinder"),
    ((POINTS, "any"), {"start": sm.primitives.Sphere([0, 0, 0], 1)}, TypeError, "start must be"),
    ((POINTS, "cylinder"), {"normals": POINTS[:5]}, ValueError, r"normals must have shape \(50, 3\)"),
    ((POINTS, "cylinder"), {"weights": -np.ones(50)}, ValueError, "weights must be at least 0"),
    ((POINTS, "cylinder"), {"weights": np.zeros(50)}, ValueError, "not all 0"),
    ((POINTS, "cylinder"), {"weights": np.ones(50), "robust": True}, ValueError, "weights must not be given"),
    ((POINTS, "cylinder"), {"robust": 1}, TypeError, "robust must be true or false"),
    ((POINTS, "cylinder"), {"noise": 0.0}, ValueError, "noise must be above 0"),
    ((POINTS[:, :2], "cylinder"), {}, ValueError, r"points must have shape \(\*, 3\)"),
    (
        (np.where(np.arange(150).reshape(50, 3) == 7, np.nan, POINTS), "cylinder"),
        {},
        ValueError,
        "points must be finite",
    ),
    ((1e80 * POINTS, "cylinder"), {}, ValueError, "choose another unit"),
]


@pytest.mark.parametrize(("arguments", "more", "error", "sentence"), WRONG)
def test_wrong_arguments(arguments, more, error, sentence):
    with pytest.raises(error, match=sentence):
        sm.fit_primitive(*arguments, **more)


def test_a_cloud_and_its_file_are_points_too(tmp_path):
    points = np.random.default_rng(0).normal(size=(200, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    cloud = sm.PointCloud(points, normals=points)
    cloud.save(tmp_path / "ball.ply")
    for given in (cloud, tmp_path / "ball.ply"):
        assert sm.fit_primitive(given, "sphere").radius == pytest.approx(1.0)
