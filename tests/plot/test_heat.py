"""Scalars, classes and marks: colors are those of the values, failures are off the scale."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given
from hypothesis import strategies as st

import simplexmesh as sm
from simplexmesh.plot import color_scale, polydata
from tests.nightly.marks import nightly


@pytest.fixture(autouse=True)
def _closed():
    yield
    pv.close_all()


RING = sm.torus(24, 12).triangulated("dual")
VALUES = RING.vertices[:, 2]
CUBE = sm.Volume(np.ones((4, 4, 4)))


def drawn(plotter):
    """What is in a picture."""
    return [actor.mapper.dataset for actor in plotter.actors.values() if getattr(actor, "mapper", None) is not None]


def shade(path):
    """The picture as (rows, columns, 3) numbers."""
    return np.asarray(pv.read(path).active_scalars).reshape(-1, 3)


class TestColormap:
    def test_runs_from_blue_over_green_to_red(self):
        table = color_scale.blue_to_red(-2.0, 2.0)
        low, middle, high = (np.array(table.map_value(x))[:3] for x in (-2.0, 0.0, 2.0))
        assert low.argmax() == 2
        assert middle.argmax() == 1
        assert high.argmax() == 0
        shades = np.array([table.map_value(x)[:3] for x in np.linspace(-2, 2, 50)])
        assert np.abs(np.diff(shades, axis=0)).max() < 0.15  # no steps

    def test_failures_have_a_color_off_the_scale(self):
        table = color_scale.blue_to_red(0.0, 1.0)
        failed = np.array(pv.Color(color_scale.FAILED).float_rgb)
        shades = np.array([table.map_value(x)[:3] for x in np.linspace(0, 1, 200)])
        assert np.linalg.norm(shades - failed, axis=1).min() > 0.25
        assert tuple(table.nan_color.float_rgb) == tuple(pv.Color(color_scale.FAILED).float_rgb)


class TestHeat:
    @pytest.mark.parametrize(
        "surface",
        [RING, sm.torus(24, 12), sm.PointCloud(RING.vertices), sm.PointCloud(RING.vertices, RING.vertex_normals)],
        ids=["triangles", "simplex mesh", "points", "disks"],
    )
    def test_carries_the_numbers(self, surface):
        at = surface.points if isinstance(surface, sm.PointCloud) else surface.vertices
        plotter = sm.plot.heat(surface, at[:, 2], name="height (mm)", limits=(-1.0, 1.0))
        polydata = next(each for each in drawn(plotter) if "heat" in each.point_data)
        assert polydata["heat"] == pytest.approx(polydata.points[:, 2], abs=0.25)
        assert "height (mm)\n" in plotter.scalar_bars

    @pytest.mark.parametrize("normals", [None, "z"])
    def test_very_many_points_are_thinned_everywhere(self, monkeypatch, normals):
        monkeypatch.setattr(polydata, "MOST_POINTS", 500)
        x, y = (each.ravel() for each in np.mgrid[0:1:40j, 0:1:40j])  # in rows, as scanned
        cloud = sm.PointCloud(np.stack([x, y, 0 * x], axis=1), np.tile([0, 0, 1.0], (1600, 1)) if normals else None)
        (shown,) = (each for each in drawn(sm.plot.heat(cloud, x)) if "heat" in each.point_data)
        assert shown.n_cells == 500
        assert np.abs(shown["heat"] - shown.points[:, 0]).max() < 0.05
        assert shown["heat"].max() > 0.95

    def test_failed_vertices_are_gray_in_the_picture(self, tmp_path):
        values = np.full(RING.n_vertices, 1.0)
        one = shade(sm.plot.picture(tmp_path / "one.png", sm.plot.heat(RING, values, limits=(0, 2))))
        values[:] = np.nan
        other = shade(sm.plot.picture(tmp_path / "other.png", sm.plot.heat(RING, values, limits=(0, 2))))
        above = len(one) // 4  # the scale is below
        colorful = [int((np.ptp(each[above:].astype(int), axis=1) > 60).sum()) for each in (one, other)]
        assert colorful[0] > 10_000 > 100 > colorful[1]

    @pytest.mark.parametrize(
        ("values", "expected"),
        [
            ([-1.0, 0.5, 3.0] * 100, (-3.0, 3.0)),
            ([0.0, 1.0, 2.0] * 100, (0.0, 2.0)),
            ([9.0, 9.5, 10.0] * 100, (9.0, 10.0)),
            ([5.0] * 100, (4.5, 5.5)),
            ([np.nan] * 100, (0.0, 1.0)),
            ([0.1] * 999 + [1e9], (-0.4, 0.6)),
            (
                [-1.0, 1.0] * 400 + [-3.1, 3.1] * 50 + [-900.0, 900.0] * 50,
                (-4.0, 4.0),
            ),  # long tails: four times the middle
            ([-1.0, 1.0] * 300 + [-900.0, 900.0] * 200, (-900.0, 900.0)),  # but not where they are many
            ([-0.001, 0.00317] * 100, (-0.0032, 0.0032)),
            ([0.0, 1234.0] * 100, (0.0, 1400.0)),
            ([0.0] * 88 + [-1.0, 1.0] * 6, (-1.0, 1.0)),  # most is zero
        ],
    )
    def test_limits(self, values, expected):
        even = np.ones(len(values))
        assert color_scale.ends(np.array(values), None, even) == pytest.approx(expected)
        assert color_scale.ends(np.array(values), (1, 2), even) == (1.0, 2.0)

    @given(st.floats(1e-200, 1e200))
    def test_round_ends_are_no_less_and_not_much_more(self, value):
        found = color_scale._rounded(value)
        assert value * (1 - 1e-6) <= found <= 1.26 * value
        assert len(f"{found / 4:.4g}".replace("-", "").replace(".", "").split("e")[0].strip("0")) <= 3

    def test_labels_of_thousands_are_written_out(self):
        for high, written in ((3600.0, "3600"), (0.0032, "0.0032"), (2e7, "2e+07")):
            plotter = sm.plot.heat(RING, VALUES, limits=(-high, high))
            assert next(iter(plotter.scalar_bars.values())).GetLabelFormat() % high == written

    def test_limits_are_weighted_by_area(self):
        """Half of the vertices are in a corner of a hundredth of the area."""
        small = sm.TriangleMesh(
            np.vstack([RING.vertices, 0.1 * RING.vertices]), np.vstack([RING.faces, RING.faces + 288])
        )
        values = np.repeat([1.0, 50.0], 288)
        plotter = sm.plot.heat(small, values)
        assert next(iter(plotter.scalar_bars.values())).lookup_table.scalar_range == (0.5, 1.5)

    def test_marks_are_balls_at_their_places(self):
        points = RING.vertices[[0, 100]]
        plotter = sm.plot.heat(RING, VALUES, marks=points)
        balls = [each for each in drawn(plotter) if each.n_points == 362]
        assert [ball.center for ball in balls] == [pytest.approx(point, abs=0.01) for point in points.tolist()]

    def test_lines_are_tubes_along_them(self):
        lines = sm.level_lines(RING, VALUES)
        plotter = sm.plot.heat(RING, VALUES, lines=[*lines, lines[0].points[:1], lines[0].points[:5]])
        tubes = [each for each in drawn(plotter) if each.n_points and "heat" not in each.point_data]
        assert len(tubes) == 3
        for line, tube in zip(lines, tubes[:2], strict=True):
            assert tube.length == pytest.approx(np.linalg.norm(np.ptp(line.points, axis=0)), rel=0.05)
            assert np.abs(np.asarray(tube.points)[:, 2]).max() < 0.02

    def test_takes_salient_points(self):
        found = sm.salient_points(RING, of=VALUES)
        balls = [each for each in drawn(sm.plot.heat(RING, VALUES, marks=found)) if "heat" not in each.point_data]
        at = np.vstack([np.asarray(each.points) for each in balls if each.n_points])
        assert len(found.points)
        for point in found.points:  # around each there is a small ball, and nothing is drawn elsewhere
            assert np.linalg.norm(at - point, axis=1).min() < 0.1
        assert max(np.linalg.norm(found.points - place, axis=1).min() for place in at) < 0.1

    def test_goes_into_a_panel(self):
        plotter = sm.plot.stage(columns=2)
        plotter.subplot(0, 1)
        assert sm.plot.heat(RING, VALUES, plotter=plotter, title="heights") is plotter

    @pytest.mark.parametrize(
        ("call", "words"),
        [
            (lambda: sm.plot.heat(RING, [1.0]), "values must have shape (288,), not (1,)"),
            (lambda: sm.plot.heat(RING, VALUES, limits=(2, 1)), "limits must increase, not go from 2 to 1"),
            (lambda: sm.plot.heat(RING, VALUES, limits=(np.nan, 1)), "limits must be finite, not nan"),
            (lambda: sm.plot.heat(RING, VALUES, marks=[0, 1]), "marks must have shape (*, 3), not (2,)"),
            (
                lambda: sm.plot.heat(sm.Volume(np.ones((4, 4, 4))), VALUES),
                "surface must be a mesh or points, not Volume",
            ),
            (
                lambda: sm.plot.classes(RING, [0.5] * 288),
                "labels must be (288,) class numbers of at least 0",
            ),
            (lambda: sm.plot.classes(RING, [-1] * 288), "labels must be (288,) class numbers of at least 0"),
        ],
    )
    def test_bad_input_is_refused(self, call, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            call()
        assert str(caught.value).startswith(words)


class TestClasses:
    def test_each_is_of_its_color_and_nothing_blends(self):
        labels = (VALUES > 0).astype(int)
        shown = polydata.vertex_cells(RING, "classes", np.array([[1.0, 0, 0], [0, 0, 1]])[labels])
        assert {tuple(color) for color in np.asarray(shown["classes"])} == {(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)}
        assert shown.area == pytest.approx(RING.area)
        corners = np.asarray(shown.points)[::4]  # the vertex each part belongs to
        assert (np.asarray(shown["classes"])[::4, 2] == (corners[:, 2] > 0)).all()
        flat = shown.compute_normals(point_normals=False, consistent_normals=False, auto_orient_normals=False)
        lit = np.asarray(shown.point_data["Normals"]).reshape(-1, 4, 3).mean(axis=1)
        assert (np.einsum("ij,ij->i", flat.cell_data["Normals"], lit) > 0).all()

    @pytest.mark.parametrize("surface", [RING, sm.torus(24, 12), sm.PointCloud(RING.vertices)])
    def test_legend_names_the_classes_that_occur(self, surface):
        at = surface.points if isinstance(surface, sm.PointCloud) else surface.vertices
        plotter = sm.plot.classes(surface, (at[:, 2] > 0).astype(int) * 2, names=["low", "none", "high"])
        names = [name for name in plotter.actors if name.startswith("legend entry") and "dot" not in name]
        written = [plotter.actors[name].input for name in names]
        assert written == ["low", "high"]

    @pytest.mark.parametrize(("columns", "beside"), [(1, False), *nightly((4, True))])
    def test_legend_keeps_clear_of_what_is_shown(self, columns, beside):
        plane = pv.Plane(i_size=1.4).triangulate()
        plate = sm.TriangleMesh(plane.points, plane.regular_faces)
        plotter = sm.plot.stage(columns=columns)
        for column in range(columns - 1):
            plotter.subplot(0, column)
            if beside:
                sm.plot.heat(RING, VALUES, plotter=plotter)
        plotter.subplot(0, columns - 1)
        kinds = np.arange(len(plate.vertices)) % 8
        names = ["peak", "ridge", "saddle ridge", "flat", "minimal", "saddle valley", "valley", "pit"]
        sm.plot.classes(plate, kinds, names=names, colors=["#ff0000"] * 8, plotter=plotter)
        sm.plot.looked_at(plotter, "xy")
        with_legend = self.photo(plotter)
        actors = [name for name in plotter.renderers[-1].actors if "entry" in name]
        assert len(actors) == 16
        for name in actors:
            plotter.renderers[-1].actors[name].SetVisibility(False)
        without = self.photo(plotter)
        plotter.renderers[-1].remove_all_lights()
        for actor in plotter.renderers[-1].actors.values():
            actor.SetVisibility(False)
        bare = self.photo(plotter)
        written, shown = np.abs(with_legend - without).max(axis=2) > 30, np.abs(without - bare).max(axis=2) > 30
        assert written.sum() > 500
        assert shown.sum() > 5000
        assert not (written & shown).any()
        width = with_legend.shape[1]
        assert not written[:, : (columns - 1) * width // columns].any()
        assert not written[:, -2:].any()

    def photo(self, plotter):
        plotter.render()
        return np.asarray(plotter.screenshot(return_img=True)).astype(int)

    @pytest.mark.parametrize(
        ("call", "words"),
        [
            (
                lambda: sm.plot.classes(RING, np.arange(288) % 3, names=["a", "b"]),
                "names must have one entry per class, at least 3, not 2",
            ),
            (
                lambda: sm.plot.classes(RING, np.arange(288) % 3, colors=["red"]),
                "colors must have one entry per class, at least 3, not 1",
            ),
            (lambda: sm.plot.heat(RING, ["high"] * 288), "values must be numbers, not "),
            (lambda: sm.plot.heat(RING, VALUES, limits=(0, 1, 2)), "limits must be two numbers, not (0, 1, 2)"),
            (lambda: sm.plot.heat(RING, VALUES, limits=3), "limits must be two numbers, not 3"),
        ],
    )
    def test_wrong_lengths_are_refused(self, call, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            call()
        assert str(caught.value).startswith(words)

    def test_labels_may_be_booleans(self):
        plotter = sm.plot.classes(RING, VALUES > 0, names=["below", "above"])
        assert sum("entry" in name for name in plotter.actors) == 4

    def test_accepts_what_the_functions_return(self):
        curvature = sm.curvature(RING, "sine")
        kinds = sm.hk_classes(RING, curvature=curvature)
        plotter = sm.plot.classes(RING, kinds)
        assert sum("entry" in name for name in plotter.actors) == 2 * len(kinds.counts)  # a dot and a name each
        plotter = sm.plot.classes(RING, sm.regions(RING, kinds))
        assert max(each.n_cells for each in drawn(plotter)) >= RING.n_faces
        assert not any("entry" in name for name in plotter.actors)  # regions have numbers, no names
        plotter = sm.plot.classes(RING, kinds, legend=False)
        assert not any("entry" in name for name in plotter.actors)


class TestCurvature:
    def test_four_panels_show_what_the_functions_find(self):
        found = sm.curvature(RING, "sine")
        plotter = sm.plot.curvature(RING, curvature=found, unit="mm", title="ring", count=3)
        assert plotter.shape == (1, 4)
        surfaces = [next(iter(each.actors.values())).mapper.dataset for each in plotter.renderers]
        expected = [found.mean, found.gauss, sm.saliency(RING, curvature=found)]
        for shown, values in zip(surfaces, expected, strict=False):
            assert shown["heat"].max() <= np.nanmax(values) + 1e-9
            assert np.corrcoef(shown["heat"], values[nearest(RING.vertices, shown.points)])[0, 1] > 0.95
        assert set(plotter.scalar_bars.keys()) == {
            "mean curvature H (1/mm)\n", "Gaussian curvature K (1/mm²)\n", "saliency (rad)\n",
        }  # fmt: skip
        kinds = sm.hk_classes(RING, curvature=found)
        written = [
            actor.input for name, actor in plotter.renderers[3].actors.items() if name.endswith(tuple("0123456789"))
        ]
        assert set(written) <= set(kinds.counts)
        assert written
        cameras = {tuple(np.round(each.camera.position, 9)) for each in plotter.renderers}
        assert len(cameras) == 1

    def test_marks_at_most_count_points(self):
        egg = sm.ellipsoid((3, 1, 1), 12).triangulated("dual")
        balls = []
        for count in (0, 1, 2):
            plotter = sm.plot.curvature(egg, curvature=sm.curvature(egg, "sine"), count=count)
            meshes = [
                actor.mapper.dataset for actor in plotter.renderers[2].actors.values() if getattr(actor, "mapper", None)
            ]
            balls.append(sum(each.n_points == 362 for each in meshes))
        assert balls == [0, 1, 2]

    @pytest.mark.parametrize(
        ("call", "words"),
        [
            (lambda: sm.plot.curvature(CUBE), "surface must be a mesh or points, not Volume"),
            (lambda: sm.plot.curvature(RING, count=-1), "count must be at least 0, not -1"),
            (lambda: sm.plot.curvature(RING, up="w", curvature=3), "up must be one of 'auto', 'x', "),
            (
                lambda: sm.plot.curvature(RING, curvature=3),
                "curvature must be a Curvature, made by simplexmesh.curvature",
            ),
        ],
    )
    def test_bad_input_is_refused(self, call, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            call()
        assert str(caught.value).startswith(words)


def nearest(points, to):
    return np.linalg.norm(np.asarray(to)[:, None] - points, axis=2).argmin(axis=1)
