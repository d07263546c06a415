"""Pictures: what they show is what was given, and they are written whole or not at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

import simplexmesh as sm
from simplexmesh.plot import scenes, skin


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


class TestSkin:
    def test_has_the_vertices_then_the_centers_of_faces(self, ball):
        coat, lines = skin.geometry(ball, None, None)
        assert coat.n_points == ball.n_vertices + ball.n_faces
        np.testing.assert_array_equal(np.asarray(coat.points)[: ball.n_vertices], ball.vertices)
        assert lines.n_lines == ball.connectivity.n_edges

    def test_keeps_holes_open(self):
        tube = sm.cylinder()
        coat, _ = skin.geometry(tube, None, None)
        assert coat.n_points == tube.n_vertices + tube.n_faces
        assert coat.n_open_edges == sum(tube.connectivity.face_sizes[tube.connectivity.face_is_hole])

    def test_normals_point_outward(self, ball):
        coat, _ = skin.geometry(ball, None, None)
        assert (np.einsum("ij,ij->i", coat.point_data["Normals"], coat.points) > 0).all()

    def test_a_face_takes_the_mean_of_its_vertices(self, ball):
        values = ball.vertices[:, 0]
        expected = [values[face].mean() for face in ball.faces]
        np.testing.assert_allclose(skin.per_point(ball, values)[ball.n_vertices :], expected, atol=1e-12)

    def test_many_points_are_thinned_and_few_kept(self):
        points = np.random.default_rng(0).normal(size=(skin.MOST_POINTS + 1000, 3))
        coat, lines = skin.geometry(sm.PointCloud(points), None, None)
        assert (coat.n_points, lines) == (skin.MOST_POINTS, None)
        assert skin.geometry(sm.PointCloud(points[:10]), None, None)[0].n_points == 10


class TestIsosurface:
    @pytest.mark.parametrize("flip", [1.0, -1.0])
    def test_lies_where_the_volume_says_and_faces_outward(self, flip):
        direction = np.diag([flip, 1.0, 1.0])
        volume = ball_volume(spacing=0.5, radius=3.0, direction=direction)
        center = volume.to_world([10, 10, 10])
        surface = skin.isosurface(volume, 0.0, None)
        np.testing.assert_allclose(np.linalg.norm(surface.vertices - center, axis=1), 3.0, atol=0.05)
        assert surface.volume == pytest.approx(4 / 3 * np.pi * 27, rel=0.02)

    def test_of_a_label_is_closed_even_at_the_border(self):
        labels = np.zeros((6, 6, 6), dtype=np.uint8)
        labels[0:3, 2:4, 2:4] = 3
        surface = skin.isosurface(sm.Volume(labels), None, 3)
        assert surface.is_closed
        assert surface.bounds[0] == pytest.approx([-0.5, 1.5, 1.5])
        assert surface.bounds[1] == pytest.approx([2.5, 3.5, 3.5])

    def test_needs_a_level(self):
        with pytest.raises(ValueError, match=r"^level must be given to show the surface of a volume$"):
            skin.isosurface(ball_volume(), None, None)

    def test_refuses_a_level_outside_the_range(self):
        with pytest.raises(ValueError, match=r"^level must be between .* not 99$"):
            skin.isosurface(ball_volume(), 99, None)


class TestScalars:
    def test_distance_to_a_surface(self, ball):
        far = ball.moved(1.5 * ball.vertices)
        values, _, power, diverging = skin.scalars_of(far, "distance", ball, None, None)
        np.testing.assert_allclose(values, 1.0, atol=0.06)
        assert (power, diverging) == (1, False)

    def test_distance_to_points(self, ball):
        values, *_ = skin.scalars_of(ball, "distance", ball.vertices, None, None)
        np.testing.assert_allclose(values, 0, atol=1e-12)

    def test_distance_to_a_volume(self, ball):
        values, *_ = skin.scalars_of(ball, "distance", ball_volume(), 0.0, None)
        np.testing.assert_allclose(values, 4.0, atol=0.08)

    def test_curvature_is_in_inverse_lengths(self, ball):
        values, name, power, diverging = skin.scalars_of(ball, "mean_curvature", None, None, None)
        np.testing.assert_allclose(values, 0.5)
        assert scenes._named(name, "mm", power) == "mean curvature (1/mm)"
        assert diverging

    def test_named_arrays(self, ball):
        values, name, *_ = skin.scalars_of(ball.with_data(heat=ball.vertices[:, 0]), "heat", None, None, None)
        np.testing.assert_array_equal(values, ball.vertices[:, 0])
        assert scenes._named(name, "mm", 0) == "heat"

    @pytest.mark.parametrize(
        ("wanted", "message"),
        [
            ("heat", "scalars must be one of 'mean_curvature', 'simplex_angle', 'distance', not 'heat'"),
            ("distance", "scalars 'distance' needs the data to measure to, and data is None"),
            (np.zeros(3), "scalars must have shape (320,), not (3,)"),
        ],
    )
    def test_say_what_is_wrong(self, ball, wanted, message):
        with pytest.raises(ValueError, match=r".") as caught:
            sm.plot.surface(ball, scalars=wanted)
        assert str(caught.value) == message

    def test_need_a_simplex_mesh(self):
        with pytest.raises(TypeError, match=r"^scalars need a SimplexMesh to color, not PointCloud$"):
            sm.plot.surface(np.eye(4)[:, :3], scalars="mean_curvature")


class TestScale:
    def limits(self, values, *, diverging):
        return scenes._scale(np.asarray(values, dtype=float), "x", diverging=diverging, limits=None)["clim"]

    def test_a_diverging_scale_has_zero_in_its_middle(self):
        assert self.limits([-1, 0, 3, 3, 3], diverging=True) == (-3, 3)

    def test_one_wild_value_does_not_hide_the_others(self):
        assert self.limits([0.1] * 99 + [1000], diverging=False) == pytest.approx((0, 0.4))
        assert self.limits([-0.1, 0.1] * 500 + [1000], diverging=True) == pytest.approx((-0.1, 0.1))

    @pytest.mark.parametrize("diverging", [True, False])
    @pytest.mark.parametrize("values", [[0.0, 0.0], [np.nan, np.nan], [5.0, 5.0]])
    def test_is_never_empty(self, values, diverging):
        low, high = self.limits(values, diverging=diverging)
        assert low < high


class TestPicture:
    def test_shows_the_surface_and_its_polygons(self, ball, tmp_path):
        bare = sm.plot.picture(tmp_path / "bare.png", sm.plot.surface(ball, edges=False))
        drawn = sm.plot.picture(tmp_path / "drawn.png", sm.plot.surface(ball))
        empty = sm.plot.picture(tmp_path / "empty.png", sm.plot.stage())
        bare, drawn, empty = (np.asarray(pv.read(p).active_scalars, dtype=float) for p in (bare, drawn, empty))
        assert (np.abs(bare - empty).max(axis=1) > 20).mean() > 0.1
        assert (np.abs(drawn - bare).max(axis=1) > 20).mean() > 0.005

    def test_has_every_kind_of_thing(self, ball, tmp_path):
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

    def test_beside_colors_the_model_only(self, ball):
        plotter = sm.plot.beside(ball.vertices * 1.1, ball, scalars="distance", unit="mm")
        assert plotter.shape == (1, 2)
        assert list(plotter.scalar_bars.keys()) == ["distance to the data (mm)\n"]

    def test_together_keeps_colors_and_opacities(self, ball):
        plotter = sm.plot.together({"a": ball, "b": sm.torus()}, colors=["red", "blue"], opacity={"b": 0.5})
        found = [
            (actor.prop.color.name, actor.prop.opacity) for actor in plotter.actors.values() if hasattr(actor, "prop")
        ]
        assert found == [("red", 1.0), ("blue", 0.5)]

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

    def test_needs_a_known_ending_and_a_folder(self, tmp_path):
        with pytest.raises(ValueError, match=r"one of '\.png'.* not '\.doc'$"):
            sm.plot.picture(tmp_path / "ball.doc", None)
        with pytest.raises(FileNotFoundError, match="there is no folder"):
            sm.plot.picture(tmp_path / "nowhere" / "ball.png", None)


def test_no_display_is_noticed(monkeypatch):
    monkeypatch.setattr(pv, "OFF_SCREEN", False)
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert not sm.plot.has_display()
    monkeypatch.setenv("DISPLAY", ":0")
    assert sm.plot.has_display()
    monkeypatch.setattr(pv, "OFF_SCREEN", True)
    assert not sm.plot.has_display()
