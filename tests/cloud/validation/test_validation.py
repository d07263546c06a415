"""The verdict: right models pass in 19 of 20 cases whatever their noise, wrong ones do not."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.cloud.validation import smoothing
from simplexmesh.cloud.validation.normality import normality_test
from simplexmesh.cloud.validation.regression import polynomial_terms
from simplexmesh.cloud.validation.unfolding import unfolded
from simplexmesh.cloud.validation.validation import MOST_POINTS, Validation, validated
from tests.cloud.validation import fitted
from tests.cloud.validation.fitted import LENGTH, cone_points, cylinder_fit, is_rate, linear_fit, places, told

ROUND = (True, False)
NOISES = {
    "normal": lambda rng, z: rng.normal(size=len(z)),
    "heavy-tailed": lambda rng, z: rng.standard_t(3, len(z)),
    "skew": lambda rng, z: rng.exponential(size=len(z)) - 1,
    "3 % outliers": lambda rng, z: rng.normal(size=len(z)) * np.where(rng.uniform(size=len(z)) < 0.03, 6, 1),
    "growing": lambda rng, z: rng.normal(size=len(z)) * (1 + 2 * z / LENGTH),
}
RELIEFS = {  # relief in deviations of the noise, and what share of 1332 points must find it
    "cone": (lambda a, z: 1.2 * z / LENGTH, 0.5),
    "bent": (lambda a, z: 3 * (z / LENGTH) ** 2, 0.95),
    "two planes": (lambda a, z: 2.5 * np.abs(a), 0.95),
    "step": (lambda a, z: 0.8 * (z > LENGTH / 2), 0.9),
    "ripples": (lambda a, z: 0.5 * np.sin(16 * np.pi * z / LENGTH), 0.8),
    "flange": (lambda a, z: 2.0 * ((z > 0.6 * LENGTH) & (z < 0.65 * LENGTH)), 0.9),
    "bump": (lambda a, z: 3 * np.exp(-(((z / LENGTH - 0.5) / 0.08) ** 2) - (a / 0.2) ** 2), 0.9),
}

NIGHTLY, PROMPT, COMMON = pytest.mark.nightly, ("cone", "step", "ripples"), ("normal", "heavy-tailed")


def verdict(fit, rng=0, derivatives=True, **options) -> Validation:
    J = fit.derivatives if derivatives else None
    return validated(fit.feet, fit.residuals, fit.coordinates, 5, periods=ROUND, derivatives=J, rng=rng, **options)


def wrong(found):
    return int(np.sum([not each.valid for each in found]))


class TestProtocols:
    @pytest.mark.parametrize(
        ("name", "noise", "half_angle", "stated"),
        [
            ("P2 noise", 5.6, 0.0, {"e'": (5.38, 5.9), "F": (0.21, 1.5), "rho": (0.22, 0.33), "D_n": (0.010, 0.029)}),
            ("P3 6 deg", 1.4, 6.0, {"e'": (3.7, 4.5), "F": (550, 850), "rho": (6.2, 9.0), "D_n": (0.045, 0.08)}),
            ("P3 7 deg", 1.4, 7.0, {"e'": (4.2, 5.0), "F": (700, 1050), "rho": (7.7, 11), "D_n": (0.045, 0.085)}),
        ],
    )
    def test_stated_values(self, name, noise, half_angle, stated):
        """As of the thesis: neighbors of the points as measured; the verdict takes those of their feet."""
        found = []
        for seed in range(8):
            fit = cylinder_fit(cone_points(np.random.default_rng(seed), noise, np.radians(half_angle)))
            smooth = smoothing.nearest_neighbors(fit.points) @ fit.residuals
            regression = fitted.regression_test(fit.residuals, unfolded(fit.coordinates, ROUND))
            rho = float(smoothing.smoothed_ratio(fit.residuals, smooth))
            result = verdict(fit, seed)
            found.append([result.noise, regression.statistic, rho, result.normality.statistic])
            assert (regression.p_value < 1e-30) == (half_angle > 0)
            assert half_angle == 0 or not result.valid
            assert half_angle > 0 or regression.p_value > 0.1
        values = np.array(found)
        for k, (statistic, (low, high)) in enumerate(stated.items()):
            told(
                f"{name} {statistic}: {values[:, k].mean():.3g} ({values[:, k].min():.3g} to {values[:, k].max():.3g})"
            )
            assert low < values[:, k].min()
            assert values[:, k].max() < high

    def test_noise_passes(self):
        """Fits by least squares, with the jacobian of the solver."""
        fits = [cylinder_fit(cone_points(np.random.default_rng(s), 5.6, count=300)) for s in range(100)]
        found = [verdict(fit, s) for s, fit in enumerate(fits)]
        rho = np.mean([each.smoothness.statistic for each in found])
        told(f"P2, 300 points: {wrong(found)} of 100 rejected, rho of feet {rho:.3f}")
        assert is_rate(wrong(found), 100, 0.05)
        assert 0.08 < rho < 1 / 9  # less than of noise by what the fit took

    def test_ratio_of_noises_does_not_tell_but_the_statistics_do(self):
        noise, cone = (
            verdict(cylinder_fit(cone_points(np.random.default_rng(1), *how)))
            for how in ((5.6, 0.0), (1.4, np.radians(6)))
        )
        assert 1 < noise.noise / cone.noise < 1.4
        assert cone.regression.statistic > 20 * noise.regression.statistic
        assert cone.smoothness.statistic > 20 * noise.smoothness.statistic


class TestLevel:
    @pytest.mark.parametrize("name", [each if each in COMMON else pytest.param(each, marks=NIGHTLY) for each in NOISES])
    def test_of_any_noise(self, name):
        found, normal, trials = [], 0, 300
        for seed in range(trials):
            rng = np.random.default_rng(seed)
            angle, z = places(rng, 200)
            result = verdict(linear_fit(angle, z, NOISES[name](rng, z)), rng)
            found.append(result)
            normal += result.normality.passed
        told(f"{name}: rejected {wrong(found) / trials:.3f}; by normality {1 - normal / trials:.3f}")
        assert is_rate(wrong(found), trials, 0.05)
        assert (normal / trials > 0.9) == (name == "normal")

    @pytest.mark.parametrize(
        ("count", "arc"),
        [(40, 160.0), (120, 360.0), *(pytest.param(*given, marks=NIGHTLY) for given in ((120, 40.0), (1332, 160.0)))],
    )
    def test_of_any_cloud(self, count, arc):
        trials = 300 if count < 1000 else 100
        found = []
        for seed in range(trials):
            rng = np.random.default_rng(seed)
            fit = linear_fit(*places(rng, count, arc), rng.normal(0, 2.0, count))
            found.append(verdict(fit, rng, noise=2.0))
        told(f"{count} points, {arc:.0f} degrees, known noise: rejected {wrong(found) / trials:.3f}")
        assert is_rate(wrong(found), trials, 0.05)

    def test_without_derivatives_is_below(self):
        found = []
        for seed in range(300):
            rng = np.random.default_rng(seed)
            found.append(verdict(linear_fit(*places(rng, 200), rng.normal(size=200)), rng, derivatives=False))
        told(f"without derivatives: rejected {wrong(found) / 300:.3f}")
        assert wrong(found) <= 12

    def test_p_values_agree_with_the_verdict(self):
        for seed in range(60):
            rng = np.random.default_rng(seed)
            angle, z = places(rng, 100)
            result = verdict(linear_fit(angle, z, rng.normal(size=100) + z / 200), rng, noise=1.1)
            assert result.valid == (result.p_value >= 0.05)
            levels = [each.significance for each in (result.regression, result.smoothness, result.chi_square)]
            assert np.prod(1 - np.array(levels)) == pytest.approx(0.95)
            assert result.p_value >= min(each.p_value for each in (result.regression, result.smoothness))


class TestPower:
    @pytest.mark.parametrize(
        "name", [each if each in PROMPT else pytest.param(each, marks=NIGHTLY) for each in RELIEFS]
    )
    def test_relief_is_found(self, name):
        relief, share = RELIEFS[name]
        found = []
        for seed in range(30):
            rng = np.random.default_rng(seed)
            angle, z = places(rng, 1332)
            found.append(verdict(linear_fit(angle, z, rng.normal(size=1332) + relief(angle, z)), rng))
        each = {
            key: np.mean([not getattr(f, key).passed for f in found])
            for key in ("regression", "smoothness", "normality", "runs")
        }
        told(f"{name}: rejected {wrong(found) / 30:.2f}; " + ", ".join(f"{k} {v:.2f}" for k, v in each.items()))
        assert wrong(found) / 30 >= share

    def test_larger_noise_than_known_is_found(self):
        rng = np.random.default_rng(0)
        fit = linear_fit(*places(rng, 400), rng.normal(0, 1.3, 400))
        assert verdict(fit).valid
        result = verdict(fit, noise=1.0)
        assert not result.valid
        assert [result.regression.passed, result.smoothness.passed, result.chi_square.passed] == [True, True, False]
        assert verdict(fit, noise=1.3).valid

    def test_a_radius_that_was_not_fitted_shows(self):
        """With the derivatives of what was fitted, a constant offset is relief."""
        rng = np.random.default_rng(1)
        fit = linear_fit(*places(rng, 400), rng.normal(size=400))
        options = {"periods": ROUND, "derivatives": fit.derivatives[:, :4]}
        assert validated(fit.feet, fit.residuals, fit.coordinates, 4, **options).valid
        assert not validated(fit.feet, fit.residuals + 0.5, fit.coordinates, 4, **options).valid

    def test_folded_sheets_are_missed_but_not_normal(self):
        """Both walls of a plate at the same coordinates: a plane is fitted to what is noise of two values."""
        rng = np.random.default_rng(2)
        at = np.column_stack([rng.uniform(-1, 1, (500, 2)), np.zeros(500)])
        walls = np.where(rng.uniform(size=500) < 0.5, 0.2, -0.2) + rng.normal(0, 0.01, 500)
        result = validated(at, walls, at[:, :2], 3)
        assert result.valid
        assert result.normality.p_value < 1e-6
        in_space = smoothing.nearest_neighbors(at + walls[:, None] * [0, 0, 1])
        assert smoothing.smoothed_ratio(walls, in_space @ walls) > 10
        assert not validated(at, walls, at[:, :2], 3, noise=0.01).valid


class TestResult:
    def test_of_a_fitted_primitive(self):
        rng = np.random.default_rng(3)
        angle, z = places(rng, 500)
        pipe = sm.primitives.Cylinder([0, 0, 0], [0, 0, 1], 100.0)
        points = pipe.at(np.stack([angle, z], axis=1))
        points = points + pipe.gradient(points) * rng.normal(0, 1.0, 500)[:, None]
        for _ in range(5):
            step = np.linalg.lstsq(pipe.derivatives(points), -pipe.distance(points))[0]
            pipe = pipe.stepped(step)
        result = validated(
            *(pipe.projected(points), pipe.distance(points), pipe.coordinates(points), pipe.n_parameters),
            noise=1.0, periods=pipe.periods, derivatives=pipe.derivatives(points),
        )  # fmt: skip
        assert result.valid
        assert result.noise == pytest.approx(1.0, rel=0.1)
        assert result.noise**2 * 495 == pytest.approx(result.rms**2 * 500)

    def test_pose_scale_and_order_do_not_matter(self):
        rng = np.random.default_rng(4)
        fit = linear_fit(*places(rng, 300), rng.normal(size=300))
        turn, shift = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=3) * 1e4
        coordinates = np.stack(
            [np.mod(fit.coordinates[:, 0] + 2, 2 * np.pi), 0.001 * fit.coordinates[:, 1] + 5], axis=1
        )
        moved = validated(
            *(0.001 * fit.feet @ turn.T + shift, 0.001 * fit.residuals, coordinates, 5),
            noise=0.001, periods=ROUND, derivatives=fit.derivatives * [1e6, 1, 1, 1, 0.001],
        )  # fmt: skip
        plain = verdict(fit, noise=1.0)
        assert moved.rms == pytest.approx(0.001 * plain.rms)
        for name in ("regression", "smoothness", "chi_square", "normality", "runs"):
            one, other = getattr(moved, name), getattr(plain, name)
            assert one.statistic == pytest.approx(other.statistic, rel=1e-5)
            assert one.p_value == pytest.approx(other.p_value, rel=1e-3)

    def test_statistics_are_those_of_the_tests(self):
        apart = []
        for seed in range(20):
            rng = np.random.default_rng(seed)
            fit = linear_fit(*places(rng, 300), rng.normal(size=300))
            result = verdict(fit)
            terms = polynomial_terms(unfolded(fit.coordinates, ROUND))
            exact = fitted.nested_model_test(fit.residuals, terms, fit.derivatives)
            assert result.regression.statistic == pytest.approx(exact.statistic)
            assert result.normality.statistic == pytest.approx(normality_test(fit.residuals).statistic)
            apart.append(abs(result.regression.p_value - exact.p_value))
        assert np.mean(apart) < 0.08  # the one by signs at random, the other by the law of F

    def test_many_points_are_sampled(self):
        rng = np.random.default_rng(6)
        angle, z = places(rng, 50_000)
        off = rng.normal(size=50_000)
        right, small = (verdict(linear_fit(angle, z, off + relief)) for relief in (0, 0.1 * (z > LENGTH / 2)))
        assert (right.count, right.tested) == (50_000, MOST_POINTS)
        assert right.valid
        assert small.valid
        assert not verdict(linear_fit(angle, z, off + 1.0 * (z > LENGTH / 2)), noise=1.0).valid

    def test_same_seed_same_result(self):
        rng = np.random.default_rng(7)
        fit = linear_fit(*places(rng, 3000), rng.normal(size=3000))
        assert repr(verdict(fit, 5)) == repr(verdict(fit, 5)) == repr(verdict(fit, np.random.default_rng(5)))
        assert repr(verdict(fit, 5)) != repr(verdict(fit, 6))

    @pytest.mark.parametrize("offset", [0.0, 1e6])
    def test_rounding_is_valid(self, offset):
        """Residuals of exact points have the pattern of rounding, which means nothing."""
        rng = np.random.default_rng(8)
        angle, z = places(rng, 300)
        fit = linear_fit(angle, z, 1e-9 * np.sin(z / 50))
        result = validated(fit.feet + offset, fit.residuals, fit.coordinates, 5, periods=ROUND, noise=1.0)
        assert result.valid
        assert result.tested == 0
        assert not validated(fit.feet, 1e3 * fit.residuals, fit.coordinates, 5, periods=ROUND).valid

    def test_is_told_on_a_line(self):
        rng = np.random.default_rng(9)
        fit = linear_fit(*places(rng, 300), rng.normal(size=300))
        assert repr(verdict(fit, noise=1.0)).startswith("Validation(valid, p 0.")
        assert repr(verdict(fit, noise=0.5)).startswith("Validation(not valid, p ")
        assert "chi-square p" in repr(verdict(fit, noise=1.0))
        assert "chi-square" not in repr(verdict(fit))
        assert "\n" not in repr(verdict(fit, noise=1.0))

    def test_coordinates_that_tell_no_place_are_refused(self):
        at = np.random.default_rng(10).normal(size=(20, 3))
        with pytest.raises(ValueError, match="coordinates must differ"):
            validated(at, at[:, 0], np.zeros((20, 2)), 3)
