"""The trials of the benchmark: known rows of its tables, and the conclusions of the thesis that hold."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.bench.trials import candidates, meshes, published
from simplexmesh.bench.trials.pointwise import Pointwise, spreads, tilts
from simplexmesh.bench.truth.discretized import split_square, uv_sphere
from simplexmesh.bench.truth.graphs import ARTICLE, graph

THESIS_METHODS = {kind: list(named) for kind, named in published.THESIS.items()}


# Specification 3.3: errors of H at d = 0.1 and 0.0005, exact normals
KNOWN = [
    (6, "sphere", "R", {"quadric": (3.1e-4, 7.6e-9), "sine": (0, 0), "taubin": (0, 0), "discrete": (0, 0)}),
    (6, "cylinder", "Rda", {"discrete": (1.3e-2, 1.3e-2), "taubin": (1.8e-2, 1.8e-2), "sine": (3.9e-5, 0)}),
    (6, "cubic", "R", {"chen_schmitt": (3.0e-1, 3.0e-1), "sine": (1.9e-4, 4.7e-9), "quadric": (0, 0)}),
    (6, "cubic", "U", {"sine": (1.7e-2, 8.5e-5), "quadric": (1.7e-2, 8.5e-5), "langer": (1.5e-2, 7.5e-5)}),
    (6, "monkey_saddle", "Rdd", {"quadric": (6.5e-3, 3.2e-5), "sine": (1.3e-3, 6.7e-6)}),
    (6, "elliptic_paraboloid", "Rdds", {"discrete": (2.1e-1, 1.3e-1), "sine": (6.7e-2, 1.7e-6)}),
    (12, "cylinder", "R", {"chen_schmitt": (3.5e-1, 3.5e-1), "taubin": (1.0e-4, 3.5e-9)}),
    (12, "hyperboloid", "Rdds", {"discrete": (2.1e-1, 2.1e-1), "taubin": (3.8e-2, 3.8e-2)}),
    (12, "trigonometric", "Rdds", {"langer": (5.9e-3, 1.5e-7), "sine": (5.9e-3, 1.5e-7)}),
]
KNOWN_NORMALS = [
    (6, "sphere", "Rdds", {"plane": (1.4e-2, 6.8e-5), "area": (1.3e-2, 6.4e-5), "extended_sine": (0, 0)}),
    (6, "elliptic_paraboloid", "Rdd", {"quadric": (8.9e-4, 0), "extended_sine": (3.0e-4, 0)}),
    (6, "cubic", "U", {"plane": (1.1e-2, 6.2e-5), "area": (1.2e-2, 6.2e-5), "extended_sine": (1.7e-4, 4.4e-9)}),
    (12, "trigonometric", "U", {"area": (2.2e-5, 0), "plane": (3.7e-3, 1.9e-5)}),
]


class TestPointwise:
    @pytest.mark.parametrize(("kind", "known"), [("curvature", KNOWN), ("normals", KNOWN_NORMALS)])
    def test_has_the_numbers_of_the_specification(self, kind, known):
        test = Pointwise(list(ARTICLE.values()), distances=np.array([0.1, 0.0005]))
        methods = {name for *_, cells in known for name in cells}
        found = {
            (c.count, c.surface, c.scheme, c.method): c.errors
            for name in methods
            for c in test.curves(kind, name)
            if c.quantity in "HN"
        }
        for count, surface, scheme, cells in known:
            for name, errors in cells.items():
                got = found[count, surface, scheme, name]
                np.testing.assert_allclose(got, errors, rtol=0.08, atol=2.5e-9, err_msg=f"{name} {surface} {scheme}")

    def test_own_scales_and_whole_meshes_stay_out(self):
        test = Pointwise([graph("sphere")], counts=(6,))
        for kind, registry in candidates.REGISTRIES.items():
            for name, registered in registry.items():
                assert not (registered.own_scale and test.curves(kind, name))

    def test_spread_is_the_difference_over_schemes(self):
        test = Pointwise([graph("cylinder")], counts=(6,), distances=np.array([0.1]))
        curves = [c for c in test.curves("curvature", "discrete") if c.quantity == "H"]
        (line,) = spreads(curves)
        values = [c.values[0] for c in curves]
        assert len(values) == 5
        assert line["spread"] == pytest.approx((max(values) - min(values)) / curves[0].scale)


@pytest.fixture(scope="module")
def errors():
    """Errors at the distance nearest to 0.1 by (kind, method), then (surface, scheme, neighbors)."""
    test = Pointwise(list(ARTICLE.values()))
    found = {}
    for kind, names in THESIS_METHODS.items():
        for name in names:
            curves = [c for c in test.curves(kind, name) if c.quantity in "HN"]
            found[kind, name] = {(c.surface, c.scheme, c.count): c.error_at(0.1) for c in curves}
    return found


class TestFindings:
    """The conclusions of the thesis (4.3) that hold."""

    def test_the_quadric_is_the_best_on_quadrics_and_the_worst_on_spheres(self, errors):
        for scheme in ("R", "Rda", "Rdd"):
            for count in (6, 12):
                for surface in ("exponential", "elliptic_paraboloid", "hyperboloid", "trigonometric"):
                    found = {
                        name: e[surface, scheme, count] for (kind, name), e in errors.items() if kind == "curvature"
                    }
                    assert found["quadric"] <= min(found.values()) + 1e-12, (surface, scheme, count)
                found = {name: e["sphere", scheme, count] for (kind, name), e in errors.items() if kind == "curvature"}
                del found["discrete"]
                assert found["quadric"] == max(found.values())

    def test_circles_collapse_on_the_cubic_and_the_cylinder_with_twelve(self, errors):
        found = errors["curvature", "chen_schmitt"]
        assert found["cylinder", "R", 12] == pytest.approx(0.3536, abs=1e-3)
        assert found["cubic", "R", 12] == pytest.approx(0.3, abs=0.01)

    def test_the_sphere_is_exact_for_all_but_quadrics_and_cotangents(self, errors):
        for name in ("taubin", "langer", "chen_schmitt", "sine"):
            values = [e for (surface, *_), e in errors["curvature", name].items() if surface == "sphere"]
            assert max(values) < 1e-9, name

    def test_planes_are_exact_on_symmetric_rings_only(self, errors):
        found = errors["normals", "plane"]
        assert max(found[surface, "R", 6] for surface in ("sphere", "cylinder", "hyperboloid", "exponential")) < 1e-12
        assert min(found[surface, "Rda", 6] for surface in ("sphere", "cylinder", "hyperboloid", "exponential")) > 1e-4

    def test_circles_give_exact_normals_on_spheres_and_poor_ones_elsewhere(self, errors):
        found, area = errors["normals", "chen_schmitt"], errors["normals", "area"]
        assert max(e for (surface, *_), e in found.items() if surface == "sphere") < 1e-9
        assert all(found[surface, "R", 6] > area[surface, "R", 6] for surface in ("cylinder", "hyperboloid", "cubic"))

    def test_area_weights_beat_the_sine_where_the_thesis_says(self, errors):
        area, sine = errors["normals", "area"], errors["normals", "extended_sine"]
        where = [("monkey_saddle", "Rda", 6), ("monkey_saddle", "Rda", 12), ("trigonometric", "Rda", 6)]
        for place in [*where, ("trigonometric", "Rda", 12), ("trigonometric", "U", 12)]:
            assert area[place] < sine[place]

    def test_the_sine_gives_the_best_normals_on_the_whole(self, errors):
        typical = {
            name: np.exp(np.mean(np.log(np.maximum(list(e.values()), 1e-9))))
            for (kind, name), e in errors.items()
            if kind == "normals"
        }
        assert min(typical, key=typical.get) == "extended_sine"


class TestMeshes:
    def test_have_the_numbers_of_the_specification(self):
        names = {"curvature": ["sine", "quadric", "taubin", "discrete"], "normals": ["area", "plane", "quadric"]}
        rows = {
            (r["method"], r["quantity"]): r for r in meshes.mesh_errors(split_square(graph("hyperboloid"), 32), names)
        }
        for name, mean, largest in [("sine", 5.0e-5, 1.3e-4), ("quadric", 9.3e-5, 2.0e-4), ("taubin", 1.6e-2, 3.9e-2)]:
            line = rows[name, "H"]
            assert (line["mean error"], line["max error"]) == pytest.approx((mean, largest), rel=0.08)
        assert rows["area", "N"]["mean error"] < 1e-15
        assert rows["plane", "N"]["mean error"] == pytest.approx(2.6e-4, rel=0.05)
        rows = {(r["method"], r["quantity"]): r for r in meshes.mesh_errors(uv_sphere(32, 32), names)}
        assert rows["taubin", "K"]["mean error"] == pytest.approx(0.11, rel=0.05)
        assert rows["sine", "H"]["max error"] < 1e-12
        assert rows["quadric", "H"]["mean error"] == pytest.approx(1.9e-3, rel=0.05)

    def test_what_fails_is_counted_and_left_out(self):
        made = uv_sphere(6, 6)
        few = np.bincount(made.mesh.faces.ravel()) < 6
        assert few.sum() == 12  # the two rings beside the poles
        line, _ = meshes.mesh_errors(made, {"curvature": ["full_quadric"], "normals": []})
        assert line["failed"] == 12
        with pytest.warns(sm.SimplexMeshWarning, match="12 of 32 vertices"):
            mean = sm.curvature(made.mesh, "full_quadric", normals=made.exact.normals).mean
        assert line["mean error"] == pytest.approx(np.abs(mean - made.exact.mean)[~few].mean(), rel=1e-9)

    def test_orders_on_meshes(self):
        sizes, found = (8, 16, 32, 64), {"sine": [], "taubin": []}
        for place, made in meshes.refined([graph("hyperboloid")], sizes):
            if place["mesh"] == "SplitSquare":
                for line in meshes.mesh_errors(made, {"curvature": list(found), "normals": []}):
                    found[line["method"]] += [line["mean error"]] * (line["quantity"] == "H")
        orders = {name: -np.polyfit(np.log(sizes), np.log(errors), 1)[0] for name, errors in found.items()}
        assert orders["sine"] == pytest.approx(2, abs=0.15)
        assert abs(orders["taubin"]) < 0.15


class TestBorder:
    def test_estimators_of_rings_have_nothing_there_and_others_do(self):
        rows = {(row["method"], row["noise"]): row for row in meshes.border_errors({"curvature": ["discrete", "sine"]})}
        assert rows["discrete", 0.0]["failed at the border"] == 1
        assert rows["sine", 0.0]["failed at the border"] < 0.2
        assert rows["sine", 0.0]["border"] > 0
        assert rows["sine", 0.1]["inside"] > 5 * rows["sine", 0.0]["inside"]


class TestTilt:
    def test_only_the_discrete_operators_do_not_care(self):
        names = {"curvature": ["sine", "quadric", "extended_quadric", "discrete"], "normals": ["extended_sine", "area"]}
        rows = list(tilts(list(ARTICLE.values()), names, (0.0, 5.0)))
        found = {(row["method"], row["degrees"]): row["error"] for row in rows}
        assert found["discrete", 5.0] == pytest.approx(found["discrete", 0.0], rel=1e-6)
        for name in ("sine", "quadric"):
            assert found[name, 5.0] > 20 * found[name, 0.0]
        assert found["extended_quadric", 5.0] < 2 * found["extended_quadric", 0.0]
        assert found["extended_sine", 5.0] == pytest.approx(found["extended_sine", 0.0], abs=1e-8)
        assert ("area", 0.0) not in found


class TestArticle:
    """Means of |error| on the spherical cap without noise, the first rows of tables 10 and 11 (2012)."""

    @pytest.mark.filterwarnings("ignore::simplexmesh.SimplexMeshWarning")
    @pytest.mark.parametrize(
        ("method", "options", "mean", "gauss"),
        [
            ("discrete", {"area": "voronoi"}, 7.09784e-10, 2.73413e-05),
            ("quadric", {}, 2.79425e-05, 2.79485e-05),
            ("extended_quadric", {}, 5.35647e-05, 5.3564e-05),
        ],
    )
    def test_without_noise_its_row_comes_out(self, method, options, mean, gauss):
        made = split_square(graph("sphere"), 50)
        found = sm.curvature(made.mesh, method, **options)
        assert np.abs(found.mean - made.exact.mean)[made.inner].mean() == pytest.approx(mean, rel=5e-4)
        assert np.abs(found.gauss - made.exact.gauss)[made.inner].mean() == pytest.approx(gauss, rel=5e-4)


class TestTori:
    def test_the_torus_comes_out_as_it_did(self):
        names = {"curvature": ["sine"], "normals": ["area"]}
        rows = list(meshes.case_errors(meshes.Case("2.5k", irregular=False), names))
        found = {(row["method"], row["quantity"]): row["error"] for row in rows}
        assert found["sine", "H"] == pytest.approx(8.5e-4, rel=0.05)
        assert found["area", "N"] == pytest.approx(0.109, rel=0.05)
        assert ("sine, 3 rings", "H") in found

    def test_columns_of_other_programs_are_those_of_the_cases(self):
        assert {len(values) for values in published.OTHERS.values()} == {13}
        assert [case.shape for case in meshes.CASES[:13]] == ["torus"] * 13
        assert len({case.title for case in meshes.CASES}) == len(meshes.CASES)
