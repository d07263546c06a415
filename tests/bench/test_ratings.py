"""Convergence of synthetic curves, and the ratings, which are those of the documentation."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from simplexmesh.bench import run
from simplexmesh.bench.trials import published, ratings
from simplexmesh.bench.trials.curve import Curve
from simplexmesh.bench.trials.pointwise import DISTANCES
from simplexmesh.bench.truth.graphs import ARTICLE

THESIS_METHODS = {kind: list(named) for kind, named in published.THESIS.items()}


def curve(values, *, truth=0.0, quantity="H", scale=1.0):
    return Curve("none", quantity, "none", "R", 6, DISTANCES, np.asarray(values, float), np.asarray(truth), scale)


class TestCurve:
    @pytest.mark.parametrize("order", [1, 2, 3])
    def test_order_is_the_power_of_the_distance(self, order):
        assert curve(0.3 * DISTANCES**order).order == pytest.approx(order, abs=1e-3)

    def test_a_right_limit(self):
        c = curve(0.5 + DISTANCES**2, truth=0.5)
        assert (c.monotone, c.has_limit, c.converges, c.limit_is_correct, c.exact) == (True, True, True, True, False)

    def test_a_wrong_limit_is_a_limit(self):
        c = curve(0.4 + DISTANCES**2, truth=0.5)
        assert (c.converges, c.limit_is_correct) == (True, False)
        assert c.order == pytest.approx(0, abs=0.1)

    def test_no_limit(self):
        c = curve(np.log(DISTANCES))
        assert (c.monotone, c.has_limit) == (True, False)

    def test_not_monotone(self):
        c = curve(DISTANCES * np.where(np.arange(13) % 2, 1, -1))
        assert (c.monotone, c.has_limit, c.converges) == (False, True, False)

    def test_round_off_is_no_error(self):
        noise = 1e-15 / DISTANCES**2 * np.where(np.arange(13) % 2, 1, -1)
        c = curve(0.5 + noise, truth=0.5)
        assert (c.exact, c.monotone, c.converges, c.limit_is_correct) == (True,) * 4
        assert np.isnan(c.order)

    def test_normals_converge_when_their_error_falls(self):
        tilted = np.stack([DISTANCES, 0 * DISTANCES, np.ones(13)], axis=1)
        up = np.array([0.0, 0.0, 1.0])
        c = curve(tilted, truth=up, quantity="N")
        assert (c.monotone, c.has_limit, c.limit_is_correct) == (True, True, True)
        assert c.order == pytest.approx(1, abs=1e-3)
        assert not curve(tilted[::-1], truth=up, quantity="N").monotone

    def test_a_missing_estimate_is_no_convergence(self):
        values = 0.5 + DISTANCES
        values[4] = np.nan
        c = curve(values, truth=0.5)
        assert (c.failed, c.monotone, c.has_limit) == (True, False, False)


@pytest.fixture(scope="module")
def rated():
    return run.measured(list(ARTICLE.values()), THESIS_METHODS, lambda *_: None, quick=True).ratings


class TestRatings:
    @pytest.mark.nightly
    def test_stand_in_the_documentation(self, rated):
        text = (Path(__file__).parents[2] / "docs" / "benchmark.md").read_text(encoding="utf-8")
        for kind, rows in rated.items():
            table = text.partition(f"<!-- bench: ratings of {kind} -->")[2].partition("<!-- end -->")[0]
            for row in rows:
                (line,) = [line for line in table.splitlines() if line.startswith(f"| {row['method']} |")]
                cells = [cell.split()[0] for cell in line.split("|")[2:5]]
                assert cells == [f"`{row[name]}`" for name in ("precision", "convergence", "stability")]

    @pytest.mark.nightly
    def test_that_differ_from_the_thesis_are_explained_and_no_others(self, rated):
        text = (Path(__file__).parents[2] / "docs" / "benchmark.md").read_text(encoding="utf-8")
        for kind, rows in rated.items():
            assert {row["method"] for row in rows} == set(published.THESIS[kind])
            differing = {
                (row["method"], criterion)
                for row in rows
                for criterion, theirs in zip(published.CRITERIA, published.THESIS[kind][row["method"]], strict=True)
                if row[criterion] != theirs
            }
            reasons = text.partition(f"<!-- reasons for {kind} -->")[2].partition("<!-- end -->")[0]
            assert set(re.findall(r"^- `(\w+)`, (\w+): \w", reasons, re.MULTILINE)) == differing

    def test_what_was_not_measured_has_no_order(self):
        assert ratings.rated("curvature", "adaptive", [], [])["order"] is None

    @pytest.mark.nightly
    def test_the_best_are_the_thesiss(self, rated):
        best = {row["method"]: row["precision"] for row in rated["normals"] if row["method"] != "adaptive"}
        assert min(best, key=lambda name: ratings.GRADES.index(best[name])) in ("extended_sine", "quadric")

    @pytest.mark.parametrize(
        ("shares", "order", "sign"),
        [
            (0.5, 2, "---"),
            (0.7, 2, "--"),
            (0.8, 2, "-"),
            (0.95, 3, "+/-"),
            (1.0, 1, "+"),
            (1.0, 2, "++"),
            (1.0, 3, "+++"),
        ],
    )
    def test_convergence_rule(self, shares, order, sign):
        assert ratings.convergence({"right limits": shares, "order": order}) == sign

    def test_a_wild_vertex_caps_stability(self):
        numbers = {"spread": 1e-4, "worst on a mesh": 1.5}
        assert ratings.stability("curvature", numbers) == "-"
        assert ratings.stability("curvature", numbers | {"worst on a mesh": 0.5}) == "+++"
        assert ratings.stability("curvature", {"spread": 1.0, "worst on a mesh": 1.5}) == "---"

    def test_rules_state_the_limits_that_are_used(self):
        numbers = dict.fromkeys(("at a point", "on meshes"))
        for limit, sign in ratings.PRECISION[:-1]:
            assert f"`{sign}` up to {limit:g}" in ratings.RULES
            assert ratings.precision("curvature", numbers | {"on meshes": 0.999 * limit}) == sign
            assert ratings.precision("curvature", numbers | {"on meshes": 1.001 * limit}) != sign
            assert ratings.precision("normals", numbers | {"on meshes": 0.0999 * limit}) == sign
