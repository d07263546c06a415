"""Plots show what was given, and image files are written whole or not at all."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

import simplexmesh as sm
from simplexmesh.plot import camera
from simplexmesh.plot import polydata as shapes
from simplexmesh.plot.color_scale import bar, blue_to_red, scale, titled
from simplexmesh.plot.scalars import scalars_of


@pytest.fixture(autouse=True)
def _closed():
    yield
    pv.close_all()


@pytest.fixture
def ball():
    return sm.sphere(4, radius=2.0)


def ball_volume(radius=6.0, spacing=1.0, direction=None):
    x, y, z = np.mgrid[-10:11, -10:11, -10:11] * spacing
    return sm.Volume(radius - np.sqrt(x * x + y * y + z * z), spacing, (-10 * spacing,) * 3, direction)


class TestDrawable:
    def test_has_the_vertices_then_the_centers_of_faces(self, ball):
        polydata, lines = shapes.geometry(ball)
        assert polydata.n_points == ball.n_vertices + ball.n_faces
        np.testing.assert_array_equal(np.asarray(polydata.points)[: ball.n_vertices], ball.vertices)
        assert lines.n_lines == ball.connectivity.n_edges

    def test_keeps_holes_open(self):
        tube = sm.cylinder()
        polydata, _ = shapes.geometry(tube)
        assert polydata.n_points == tube.n_vertices + tube.n_faces
        assert polydata.n_open_edges == sum(tube.connectivity.face_sizes[tube.connectivity.face_is_hole])

    def test_normals_point_outward(self, ball):
        polydata, _ = shapes.geometry(ball)
        assert (np.einsum("ij,ij->i", polydata.point_data["Normals"], polydata.points) > 0).all()

    def test_a_face_takes_the_mean_of_its_vertices(self, ball):
        values = ball.vertices[:, 0]
        expected = [values[face].mean() for face in ball.faces]
        np.testing.assert_allclose(shapes.per_point(ball, values)[ball.n_vertices :], expected, atol=1e-12)

    def test_many_points_are_thinned_and_few_kept(self):
        points = np.random.default_rng(0).normal(size=(shapes.MOST_POINTS + 1000, 3))
        polydata, lines = shapes.geometry(sm.PointCloud(points))
        assert (polydata.n_points, lines) == (shapes.MOST_POINTS, None)
        assert shapes.geometry(sm.PointCloud(points[:10]))[0].n_points == 10

    def test_a_cube_keeps_its_edges(self):
        cube = pv.Cube().triangulate()
        polydata, _ = shapes.geometry(shapes.as_drawable(cube))
        assert np.abs(polydata.point_data["Normals"]).max(axis=1) == pytest.approx(1)

    def test_points_with_normals_are_disks_that_face_along_them(self, ball):
        polydata, _ = shapes.geometry(sm.PointCloud(ball.vertices, ball.normals))
        rims = np.asarray(polydata.points).reshape(ball.n_vertices, shapes.CORNERS, 3)
        np.testing.assert_allclose(rims.mean(axis=1), ball.vertices, atol=1e-12)
        turned = np.cross(rims[:, 0] - ball.vertices, rims[:, 1] - ball.vertices)
        assert (np.einsum("ij,ij->i", turned, ball.normals) > 0).all()

    def test_normals_that_point_into_the_model_are_reversed(self, ball):
        out = sm.PointCloud(1.01 * ball.vertices, ball.normals)
        for given in (out, sm.PointCloud(out.points, -out.normals)):
            np.testing.assert_allclose(shapes.oriented_like(given, ball).normals, out.normals, atol=1e-12)


class TestIsosurface:
    @pytest.mark.parametrize("flip", [1.0, -1.0])
    def test_is_at_the_level_and_faces_outward(self, flip):
        direction = np.diag([flip, 1.0, 1.0])
        volume = ball_volume(spacing=0.5, radius=3.0, direction=direction)
        center = volume.to_world([10, 10, 10])
        surface = shapes.isosurface(volume, 0.0, None)
        np.testing.assert_allclose(np.linalg.norm(surface.vertices - center, axis=1), 3.0, atol=0.05)
        assert surface.volume == pytest.approx(4 / 3 * np.pi * 27, rel=0.02)

    def test_of_a_label_is_closed_even_at_the_border(self):
        labels = np.zeros((6, 6, 6), dtype=np.uint8)
        labels[0:3, 2:4, 2:4] = 3
        surface = shapes.isosurface(sm.Volume(labels), None, 3)
        assert surface.is_closed
        assert surface.bounds[0] == pytest.approx([-0.5, 1.5, 1.5])
        assert surface.bounds[1] == pytest.approx([2.5, 3.5, 3.5])

    @pytest.mark.parametrize("inside", ["above", "below"])
    def test_of_a_level_is_closed_at_the_border_and_faces_out_of_the_inside(self, inside):
        x = np.broadcast_to(np.arange(8.0)[:, None, None], (8, 8, 8))
        surface = shapes.isosurface(sm.Volume(x), 3.5, None, inside)
        assert surface.is_closed
        assert surface.volume > 0

    def test_needs_a_level(self):
        with pytest.raises(ValueError, match=r"^level must be given to show the surface of a volume$"):
            shapes.isosurface(ball_volume(), None, None)

    def test_refuses_a_level_outside_the_range(self):
        with pytest.raises(ValueError, match=r"^level must be between .* not 99$"):
            shapes.isosurface(ball_volume(), 99, None)


class TestScalars:
    def test_distance_to_a_surface_is_along_normals(self, ball):
        near = ball.moved(1.05 * ball.vertices)
        values, _, power, diverging = scalars_of(near, "distance", ball)
        np.testing.assert_allclose(values, 0.1, atol=0.06)
        assert (power, diverging) == (1, False)

    def test_distance_is_that_of_the_reconstruction(self):
        model = sm.reconstruct(ball_volume(), level=0.0, vertices=400)
        values, *_ = scalars_of(model.mesh, "distance", ball_volume(), 0.0, None)
        assert np.sqrt(np.mean(values**2)) == pytest.approx(model.distance.mesh_to_data.rms, rel=1e-6)

    def test_distance_without_data_is_the_array_of_the_mesh(self):
        model = sm.reconstruct(ball_volume(), level=0.0, vertices=400)
        values, name, power, diverging = scalars_of(model.mesh, "distance", None)
        np.testing.assert_array_equal(values, model.mesh.data["distance"])
        assert (name, power, diverging) == ("distance to the data", 1, False)

    def test_distance_is_unknown_where_nothing_is_near(self, ball):
        values, *_ = scalars_of(ball.moved(5 * ball.vertices), "distance", ball)
        assert np.isnan(values).all()

    def test_distance_to_points_is_to_the_surface_between_them(self, ball):
        fine = sm.sphere(16, radius=2.0).vertices
        values, *_ = scalars_of(ball, "distance", fine)
        nearest = np.linalg.norm(ball.vertices[:, None] - fine, axis=2).min(axis=1)
        assert values.max() < 0.2 * nearest.mean()

    def test_distance_to_a_volume(self, ball):
        near = ball.moved(ball.vertices * 2.9)  # radius 5.8 of 6
        values, *_ = scalars_of(near, "distance", ball_volume(), 0.0, None)
        np.testing.assert_allclose(values, 0.2, atol=0.08)

    def test_curvature_is_in_inverse_lengths(self, ball):
        values, name, power, diverging = scalars_of(ball, "mean_curvature", None)
        np.testing.assert_allclose(values, 0.5, rtol=1e-3)
        assert titled(name, "mm", power) == "mean curvature (1/mm)"
        assert diverging
        values, name, power, diverging = scalars_of(ball, "sphere_curvature", None)
        np.testing.assert_allclose(values, 0.5)
        assert (titled(name, "mm", power), diverging) == ("curvature of spheres (1/mm)", True)

    def test_named_arrays(self, ball):
        values, name, *_ = scalars_of(ball.with_data(heat=ball.vertices[:, 0]), "heat", None)
        np.testing.assert_array_equal(values, ball.vertices[:, 0])
        assert titled(name, "mm", 0) == "heat"

    @pytest.mark.parametrize(
        ("wanted", "message"),
        [
            (
                "heat",
                "scalars must be one of 'mean_curvature', 'sphere_curvature', 'simplex_angle', "
                "'distance', 'deviation', not 'heat'",
            ),
            (
                "distance",
                "scalars 'distance' needs data to measure to: data is None, and the mesh has no such array",
            ),
            (np.zeros(3), "scalars must have shape (320,), not (3,)"),
        ],
    )
    def test_messages_name_what_is_wrong(self, ball, wanted, message):
        with pytest.raises(ValueError, match=r".") as caught:
            sm.plot.surface(ball, scalars=wanted)
        assert str(caught.value) == message

    def test_that_are_colors_are_shown_as_they_are(self, ball):
        paint = np.random.default_rng(0).integers(0, 256, (ball.n_vertices, 3)).astype(np.uint8)
        painted = ball.with_data(paint=paint)
        cloud = sm.PointCloud(ball.vertices, data={"paint": paint})
        for thing in (painted, painted.triangulated(), cloud):
            mapper = next(iter(sm.plot.surface(thing, scalars="paint", edges=False).actors.values())).mapper
            shown = np.asarray(mapper.dataset["colors"])
            np.testing.assert_array_equal(shown[: ball.n_vertices], paint)
            assert mapper.color_mode == "direct"

    def test_are_not_of_volumes(self):
        with pytest.raises(TypeError, match=r"^scalars need a mesh or points to color, not Volume$"):
            sm.plot.surface(ball_volume(), level=0.0, scalars="mean_curvature")

    def test_of_triangles_and_points_are_arrays_and_curvature(self, ball):
        plain = ball.triangulated()
        triangles = replace(plain, data={"heat": plain.vertices[:, 0]})
        heat = triangles.data["heat"]
        for thing in (triangles, triangles.to_pyvista(), sm.PointCloud(triangles.vertices, data={"heat": heat})):
            mapper = next(iter(sm.plot.surface(thing, scalars="heat").actors.values())).mapper
            np.testing.assert_allclose(mapper.dataset["scalars"], heat)
        fine = sm.sphere(16, radius=2.0).triangulated("dual")
        values, name, power, diverging = scalars_of(fine, "mean_curvature", None)
        np.testing.assert_allclose(values, 0.5, rtol=0.05)
        assert (name, power, diverging) == ("mean curvature", -1, True)
        with pytest.raises(ValueError, match=r"'mean_curvature', 'deviation', 'heat', not 'x'$"):
            sm.plot.surface(triangles, scalars="x")

    def test_deviation_has_a_sign_and_no_limit(self, ball):
        planned = sm.sphere(16, radius=2.0).triangulated("dual")
        dented = ball.moved(ball.vertices * np.where(ball.vertices[:, 2:] > 1.5, 0.3, 1.05))
        for made in (dented, sm.PointCloud(dented.vertices), dented.triangulated()):
            values, name, power, diverging = scalars_of(made, "deviation", planned)
            np.testing.assert_array_equal(values, sm.deviation(made, planned).distances)
            assert (name, power, diverging) == ("deviation from the data", 1, True)
            assert values.min() < -1 < 0 < values.max()
        with pytest.raises(TypeError, match=r"^scalars 'deviation' needs a surface as data, not PointCloud$"):
            sm.plot.surface(ball, scalars="deviation", data=ball.vertices)

    def test_color_triangles_beside_their_data_and_not_the_data(self, ball):
        planned, made = ball.triangulated(), ball.moved(1.1 * ball.vertices).triangulated()
        plotter = sm.plot.beside(planned, made, scalars="deviation")
        mappers = [[getattr(a, "mapper", None) for a in panel.actors.values()] for panel in plotter.renderers]
        colored = [any(m is not None and "scalars" in m.dataset.point_data for m in each) for each in mappers]
        assert colored == [False, True]


class TestScale:
    def limits(self, values, *, diverging):
        return scale(np.asarray(values, dtype=float), "x", diverging=diverging, limits=None)["clim"]

    def test_a_diverging_scale_has_zero_in_its_middle(self):
        assert self.limits([-1, 0, 3, 3, 3], diverging=True) == (-3, 3)

    def test_an_outlier_does_not_hide_the_others(self):
        assert self.limits([0.1] * 99 + [1000], diverging=False) == pytest.approx((0, 0.4))
        assert self.limits([-0.1, 0.1] * 500 + [1000], diverging=True) == pytest.approx((-0.1, 0.1))

    def test_is_of_the_values_and_not_from_zero_where_that_is_far(self):
        assert self.limits(np.linspace(20, 30, 1001), diverging=False) == pytest.approx((20, 30), abs=0.3)

    def test_has_zero_in_its_middle_for_values_of_both_signs(self, ball):
        plotter = sm.plot.surface(ball, scalars=ball.vertices[:, 0] + 0.5)
        low, high = next(iter(plotter.scalar_bars.values())).lookup_table.scalar_range
        assert low == -high < 0

    def test_leaves_vertices_without_a_value_gray(self, ball):
        values = np.where(np.arange(320) < 9, np.nan, ball.vertices[:, 0])
        mapper = next(iter(sm.plot.surface(ball, scalars=values, edges=False).actors.values())).mapper
        assert np.isnan(mapper.dataset["scalars"]).any()
        assert np.isfinite(mapper.scalar_range).all()

    def test_has_the_colors_of_heat_for_quantities_of_both_signs(self):
        table = scale(np.array([-1.0, 1.0]), "x", diverging=True, limits=None)["cmap"]
        np.testing.assert_array_equal(table.values, blue_to_red(-1, 1).values)

    @pytest.mark.parametrize(
        ("limits", "labels"),
        [
            ((0, 0.000199), ["0.00e+00", "4.98e-05", "9.95e-05", "1.49e-04", "1.99e-04"]),
            ((20, 30), ["20.0", "22.5", "25.0", "27.5", "30.0"]),
            ((-0.0032, 0.0032), ["-0.0032", "-0.0016", "0.0000", "0.0016", "0.0032"]),
            ((0, 1400), ["0", "350", "700", "1050", "1400"]),
        ],
    )
    def test_has_labels_of_one_format(self, limits, labels):
        written = bar("x", *limits)["fmt"]
        assert [written % x for x in np.linspace(*limits, 5)] == labels

    def test_few_are_beyond_its_end(self):
        values = np.random.default_rng(0).exponential(size=2000) ** 3
        assert (values > self.limits(values, diverging=False)[1]).mean() == pytest.approx(0.02, abs=0.001)

    def test_the_bar_tells_how_many_are_beyond_limits_that_nobody_gave(self, ball):
        values = np.where(np.arange(320) < 4, 1000.0, 0.1)
        assert list(sm.plot.surface(ball, scalars=values, unit="mm").scalar_bars.keys()) == ["1.2% beyond\n"]
        given = scale(values, "x", diverging=False, limits=(0, 1))["scalar_bar_args"]["title"]
        assert given == "x\n" == scale(values[4:], "x", diverging=False, limits=None)["scalar_bar_args"]["title"]

    @pytest.mark.parametrize("diverging", [True, False])
    @pytest.mark.parametrize("values", [[0.0, 0.0], [np.nan, np.nan], [5.0, 5.0]])
    def test_is_never_empty(self, values, diverging):
        low, high = self.limits(values, diverging=diverging)
        assert low < high


def on_screen(renderer, points):
    """Where points appear in a panel: (n, 2), from 0, 0 at its lower left to 1, 1."""
    aspect = camera._aspect(renderer)
    full = renderer.camera.GetCompositeProjectionTransformMatrix(aspect, -1, 1)
    matrix = np.array([[full.GetElement(i, j) for j in range(4)] for i in range(4)])
    return 0.5 + 0.5 * (np.c_[points, np.ones(len(points))] @ matrix.T)[:, :2]


class TestCamera:
    @pytest.mark.parametrize("view", [None, "xy", "-yx", (1, 2, 3), (0, 0, 1)])
    def test_everything_is_between_the_title_and_the_scale(self, ball, view):
        long = ball.moved(ball.vertices * [1, 2, 5] + 30)
        plotter = sm.plot.surface(long, scalars="mean_curvature", title="long", view=view)
        x, y = on_screen(plotter.renderer, long.vertices).T
        assert 0 < x.min() < x.max() < 1
        assert camera.BAR < y.min() < y.max() < 1 - camera.TITLE
        assert max(np.ptp(x), np.ptp(y) / (1 - camera.BAR - camera.TITLE)) > 0.85
        assert x.min() + x.max() == pytest.approx(1, abs=0.01)

    @pytest.mark.parametrize("draw", ["surface", "heat", "classes", "together"])
    @pytest.mark.parametrize("shape", [(1, 1, 3), (3, 1, 1), (1, 1, 1), (1, 1, 0.01)])
    def test_the_window_of_one_body_is_tall_or_wide_as_it_is(self, ball, shape, draw):
        body = ball.moved(ball.vertices * shape)
        numbers = np.arange(ball.n_vertices)
        plotter = {
            "surface": lambda: sm.plot.surface(body, view="xz"),
            "heat": lambda: sm.plot.heat(body, numbers, view="xz"),
            "classes": lambda: sm.plot.classes(body, numbers % 3, view="xz"),
            "together": lambda: sm.plot.together({"body": body}, view="xz", legend=False),
        }[draw]()
        width, height = plotter.window_size
        assert 600 <= width <= 1200
        assert 720 <= height <= 1080
        filled = np.ptp(on_screen(plotter.renderer, body.vertices), axis=0)
        assert filled.max() > (0.85 if draw != "heat" else 0.75)
        assert filled.min() > 0.01 if shape[2] < 1 else filled.min() > 0.4

    def test_names_and_windows_of_the_caller_stay_where_they_are(self, ball):
        tall = ball.moved(ball.vertices * [1, 1, 3])
        assert sm.plot.together({"a": tall}).window_size == [1200, 900]
        plotter = sm.plot.surface(tall, plotter=sm.plot.stage(size=(500, 400)))
        assert sm.plot.looked_at(plotter, "xz").window_size == [500, 400]

    def test_panels_in_one_place_share_a_camera_that_shows_all(self, ball):
        plotter = sm.plot.panels({"part": ball, "whole": ball.moved(3 * ball.vertices)})
        first, second = plotter.renderers
        assert first.camera is second.camera
        assert (np.abs(on_screen(first, 3 * ball.vertices) - 0.5) < 0.5).all()

    def test_panels_in_different_places_are_each_fitted(self, ball):
        plotter = sm.plot.panels({"here": ball, "there": ball.moved(0.01 * ball.vertices + 50)})
        there = on_screen(plotter.renderers[1], 0.01 * ball.vertices + 50)
        assert np.ptp(there[:, 1]) > 0.8

    @pytest.mark.parametrize("view", ["xy", "xz", "yz", "yx", "zx", "zy"])
    def test_a_side_has_its_first_axis_right_and_its_second_up(self, view):
        toward, up = camera._directions(view, "z")
        right = np.cross(up, toward)
        assert (right["xyz".index(view[0])], up["xyz".index(view[1])]) == (1, 1)

    @pytest.mark.parametrize("axis", ["x", "y", "z"])
    def test_a_minus_turns_upside_down_and_keeps_the_front(self, axis):
        toward, up = camera._directions(None, axis)
        down_toward, down = camera._directions(None, f"-{axis}")
        k = "xyz".index(axis)
        assert up[k] > 0.7
        assert down[k] == pytest.approx(-up[k])
        front = {"x": 2, "y": 2, "z": 1}[axis]
        assert down_toward[front] == pytest.approx(toward[front])
        assert down_toward == pytest.approx(np.where(np.arange(3) == front, toward, -toward))

    def test_up_by_default(self, ball):
        tall = ball.vertices * [1, 2, 1]
        assert camera.upright(sm.PointCloud(tall)) == "y"
        assert camera.upright(sm.PointCloud(ball.vertices)) == "z"
        assert camera.upright(ball.moved(tall)) == "z"
        assert camera.upright(sm.PointCloud(tall), "x") == "x"
        plotter = sm.plot.surface(tall)
        assert np.asarray(plotter.camera.up)[1] > 0.7


class TestPicture:
    def test_shows_the_surface_and_its_polygons(self, ball, tmp_path):
        plotter = sm.plot.surface(ball)
        empty = sm.plot.picture(tmp_path / "empty.png", sm.plot.stage(size=tuple(plotter.window_size)))
        drawn = sm.plot.picture(tmp_path / "drawn.png", plotter)
        bare = sm.plot.picture(tmp_path / "bare.png", sm.plot.surface(ball, edges=False))
        bare, drawn, empty = (np.asarray(pv.read(p).active_scalars, dtype=float) for p in (bare, drawn, empty))
        assert (np.abs(bare - empty).max(axis=1) > 20).mean() > 0.1
        assert (np.abs(drawn - bare).max(axis=1) > 20).mean() > 0.005

    def test_draws_contours_in_colors_of_their_own(self, ball, tmp_path):
        x, y, z = ball.vertices.T
        ring = sm.Contour.through(ball, [x.argmax(), y.argmax(), x.argmin(), y.argmin()])
        arc = sm.Contour.through(ball, [z.argmax(), (z + 0.5 * x).argmax()], closed=False)
        named = ball.with_contours(ring=ring, arc=arc)
        plotter = sm.plot.surface(named, contours=True, edges=False)
        drawn = [actor for actor in plotter.actors.values() if hasattr(actor, "prop")]
        assert len(drawn) == 3
        assert len({tuple(actor.prop.color.float_rgb) for actor in drawn}) == 3
        for actor, contour in zip(drawn[1:], (ring, arc), strict=True):
            assert np.allclose(
                actor.bounds[::2], ball.vertices[contour.vertices].min(axis=0), atol=0.01 * ball.diagonal
            )
        plotter.close()
        plotter = sm.plot.surface(ball, contours=True, edges=False)
        assert len([actor for actor in plotter.actors.values() if hasattr(actor, "prop")]) == 1
        plotter.close()
        with pytest.raises(ValueError, match="contours are those of a SimplexMesh; a TriangleMesh has none"):
            sm.plot.surface(ball.triangulated(), contours=True)

    def test_has_every_kind_of_object(self, ball, tmp_path):
        things = {
            "points": ball.vertices,
            "triangles": ball.triangulated(),
            "volume": ball_volume(),
            "mesh": ball,
            "open": sm.cylinder(),
        }
        plotter = sm.plot.panels(things, level=0.0)
        assert plotter.shape == (1, 5)
        assert sm.plot.picture(tmp_path / "all.png", plotter).stat().st_size > 10_000

    def test_panels_use_the_level_for_volumes_only(self, ball):
        plotter = sm.plot.panels({"volume": ball_volume(), "mesh": ball}, level=0.0, scalars="mean_curvature")
        assert list(plotter.scalar_bars.keys()) == ["mean curvature, 1.9% beyond\n"]

    def test_beside_colors_the_model_only(self, ball):
        plotter = sm.plot.beside(ball.vertices * 1.1, ball, scalars="distance", unit="mm")
        assert plotter.shape == (1, 2)
        (title,) = plotter.scalar_bars.keys()
        assert re.fullmatch(r"distance to the data \(mm\), [34]\.\d% beyond\n", title)  # many distances are alike

    @pytest.mark.parametrize(("function", "name"), [("panels", "things"), ("together", "things")])
    def test_several_objects_have_names(self, ball, function, name):
        with pytest.raises(TypeError, match=f"{name} must be a mapping of titles to objects, not list"):
            getattr(sm.plot, function)([ball, ball])
        with pytest.raises(ValueError, match=f"{name} must hold at least one object, not none"):
            getattr(sm.plot, function)({})

    def test_together_keeps_colors_and_opacities(self, ball):
        plotter = sm.plot.together({"a": ball, "b": sm.torus()}, colors=["red", "blue"], opacity={"b": 0.5})
        found = [
            (actor.prop.color.name, actor.prop.opacity) for actor in plotter.actors.values() if hasattr(actor, "mapper")
        ]
        assert found == [("red", 1.0), ("blue", 0.5)]

    def test_colors_are_those_of_the_scale(self, tmp_path):
        for value in (-0.9, 0.0, 0.5):
            ball = sm.sphere(12)
            plotter = sm.plot.surface(
                ball, scalars=np.full(ball.n_vertices, value), limits=(-1, 1), edges=False, view="xz"
            )
            wanted = 255 * np.array(pv.LookupTable("viridis", scalar_range=(-1, 1))(value)[:3], dtype=float)
            picture = sm.plot.picture(tmp_path / "ball.png", plotter)
            image = pv.read(picture)
            width, height, _ = image.dimensions
            seen = np.asarray(image.active_scalars, dtype=float).reshape(height, width, 3)
            seen = seen[height // 2 : height // 2 + 100, width // 2 - 50 : width // 2 + 50]
            assert np.abs(seen - wanted).max() < 25

    def test_is_lit_by_the_normals_of_the_mesh(self, ball):
        plotter = sm.plot.surface(ball, edges=False)
        (actor,) = [actor for actor in plotter.actors.values() if hasattr(actor, "mapper")]
        np.testing.assert_allclose(
            actor.mapper.dataset.point_data["Normals"][: ball.n_vertices], ball.normals, atol=1e-6
        )

    def test_points_in_front_of_a_surface_are_all_seen(self):
        """VTK's depth offset for coincident primitives hid those left of the middle."""
        ball = sm.sphere(12).triangulated()
        plotter = sm.plot.stage(size=(300, 300))
        sm.plot.surface(ball, edges=False, color="white", plotter=plotter)
        plotter.add_mesh(1.01 * ball.vertices, color="red", point_size=5, render_points_as_spheres=True)
        pixels = np.asarray(sm.plot.looked_at(plotter, "xy").screenshot(return_img=True)).astype(int)
        red = pixels[..., 0] - pixels[..., 1] > 60
        assert red[:, :150].sum() == pytest.approx(red[:, 150:].sum(), rel=0.1)

    def test_replaces_an_older_one_and_leaves_no_drafts(self, ball, tmp_path):
        path = tmp_path / "ball.png"
        path.write_text("old")
        sm.plot.picture(path, sm.plot.surface(ball))
        assert path.read_bytes().startswith(b"\x89PNG")
        assert [p.name for p in tmp_path.iterdir()] == ["ball.png"]

    def test_a_failure_leaves_the_older_one(self, tmp_path):
        class Broken:
            def screenshot(self, path):
                Path(path).write_text("half")
                raise OSError("no graphics")

            def close(self):
                pass

        path = tmp_path / "ball.png"
        path.write_text("old")
        with pytest.raises(OSError, match="no graphics"):
            sm.plot.picture(path, Broken())
        assert path.read_text() == "old"
        assert [p.name for p in tmp_path.iterdir()] == ["ball.png"]

    def test_swapped_arguments_are_reported(self, tmp_path):
        with pytest.raises(TypeError, match=r"^plotter must be a pyvista.Plotter, not NoneType$"):
            sm.plot.picture(tmp_path / "a.png", None)
        with pytest.raises(TypeError, match=r"^path must be a file name, followed by the plotter, not Plotter$"):
            sm.plot.picture(sm.plot.stage(), tmp_path / "ball.png")

    def test_a_failure_names_the_file_asked_for(self, tmp_path):
        class Full:
            def screenshot(self, path):
                raise OSError(28, "No space left on device", path)

            def close(self):
                pass

        with pytest.raises(OSError, match=r"ball\.png") as caught:
            sm.plot.picture(tmp_path / "ball.png", Full())
        assert caught.value.filename == str(tmp_path / "ball.png")

    def test_refuses_a_level_without_a_volume(self, ball):
        with pytest.raises(ValueError, match=r"^level and label are for volumes, not for PointCloud$"):
            sm.plot.surface(ball.vertices, level=5)
        with pytest.raises(ValueError, match=r"^level and label are for volumes, not for PointCloud$"):
            sm.plot.beside(ball.vertices, ball, label=5)

    def test_together_takes_a_level_for_the_volumes(self, ball):
        x = np.linalg.norm(np.mgrid[-4:5, -4:5, -4:5], axis=0)
        sm.plot.together({"mesh": ball, "volume": sm.Volume(x)}, level=3.0, inside="below").close()
        with pytest.raises(ValueError, match=r"^give level or label, not both$"):
            sm.plot.surface(sm.Volume(x), level=3.0, label=1)

    def test_refuses_inside_without_a_level(self, ball):
        labels = sm.Volume(np.pad(np.ones((4, 4, 4), int), 2))
        for shown, of in ((ball, "SimplexMesh"), (ball.vertices, "PointCloud"), (labels, "labels")):
            with pytest.raises(ValueError, match=f"^inside is for a level of a volume, not for {of}$"):
                sm.plot.surface(shown, inside="below")
        with pytest.raises(ValueError, match=r"^inside must be one of 'above', 'below', not 'beneath'"):
            sm.plot.surface(ball, inside="beneath")

    def test_needs_a_known_ending_and_a_folder(self, tmp_path):
        with pytest.raises(ValueError, match=r"one of '\.png'.* not '\.doc'$"):
            sm.plot.picture(tmp_path / "ball.doc", None)
        with pytest.raises(FileNotFoundError, match="path must be in an existing folder"):
            sm.plot.picture(tmp_path / "nowhere" / "ball.png", None)
