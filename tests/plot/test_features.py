"""Plots of sharp edges and zones: colors of neighbors differ, lines are drawn where they are."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

import simplexmesh as sm
from simplexmesh._base.html import card
from simplexmesh.plot.features import PALE, colors

CUBE = sm.divided(pv.Cube().triangulate().clean(), 0.1)
BALL = sm.sphere(8).triangulated("dual")


@pytest.fixture(scope="module")
def network():
    return sm.feature_lines(CUBE)


@pytest.fixture(scope="module")
def zones(network):
    return sm.zones(CUBE, network)


def slab():
    """Return a band around a slab with round ends: two planes and two half cylinders without sharp edges."""
    x, y, _ = np.mgrid[-30:31, -14:15, 0:17] * 0.05
    grid = pv.ImageData(dimensions=x.shape, spacing=(0.05, 0.05, 0.05))
    grid["distance"] = (np.hypot(np.maximum(abs(x) - 0.75, 0), y) - 0.5).ravel(order="F")
    found = grid.contour([0.0])
    return sm.TriangleMesh(found.points, found.regular_faces).welded(report=False)


def pixels(plotter):
    """The picture of a plotter, as (height, width, 3) numbers."""
    out = np.asarray(plotter.screenshot(return_img=True)).astype(int)
    plotter.close()
    return out


class TestColors:
    def test_of_neighbors_differ(self, zones):
        found = colors(zones)
        assert found.shape == (6,)
        for line, (one, other) in zones.boundaries:
            assert line.kind == "C0"
            assert found[one] != found[other]

    def test_are_used_in_turn(self, zones):
        assert len(set(colors(zones).tolist())) == 6  # the palette has enough

    def test_are_there_for_one_zone_without_neighbors(self):
        assert colors(sm.zones(BALL)).tolist() == [0]

    def test_are_there_for_more_neighbors_than_the_palette_has(self):
        comb = pv.PolyData(np.zeros((0, 3)))
        parts = [pv.Cube(center=(2.0 * k, 0, 0)).triangulate() for k in range(3)]
        comb = sm.divided(pv.merge(parts).clean().extract_surface(algorithm=None), 0.2)
        found = colors(sm.zones(comb))
        assert found.max() < len(PALE)
        assert len(set(found.tolist())) == len(PALE)


class TestPicture:
    def test_shows_three_sides_of_a_cube_in_three_colors_and_dark_lines(self, network, zones):
        image = pixels(sm.plot.features(CUBE, network, zones))
        assert (image.max(axis=2) < 90).mean() > 0.005  # the lines
        middle = image[image.shape[0] // 4 : -image.shape[0] // 4, image.shape[1] // 4 : -image.shape[1] // 4]
        flat = middle.reshape(-1, 3)
        counts = np.unique((flat // 8) @ [10000, 100, 1], return_counts=True)[1]
        assert (counts > 0.1 * len(flat)).sum() >= 3

    def test_has_a_line_from_corner_to_corner_where_the_edge_is(self, network, zones):
        image = pixels(sm.plot.features(CUBE, network, zones, view="xz"))
        dark = image.max(axis=2) < 90
        rows, columns = np.nonzero(dark)
        for axis, along in ((0, rows), (1, columns)):
            full = np.flatnonzero(dark.sum(axis=axis) > 0.8 * np.ptp(along))
            assert np.ptp(full) > 0.95 * np.ptp(along)  # two of them, at either side
            assert len(full) < 0.05 * np.ptp(along)

    def test_without_sharp_edges_has_no_lines(self):
        image = pixels(sm.plot.features(BALL))
        assert (image.max(axis=2) < 90).mean() < 1e-4

    def test_finds_lines_and_zones_that_are_not_given(self, network, zones):
        given, found = (sm.plot.features(CUBE, *each) for each in [(network, zones), ()])
        assert np.array_equal(pixels(given), pixels(found))

    def test_shows_lines_between_zones_without_a_sharp_edge(self):
        body = slab()
        whole, divided = (
            pixels(sm.plot.features(body, None, sm.zones(body, tolerance=how), view="xz")) for how in (None, 1.5)
        )
        dark = divided.max(axis=2) < 90
        assert not (whole.max(axis=2) < 90).any()
        assert dark.any(axis=1).sum() > 300  # two upright lines

    def test_has_a_title_and_goes_into_a_panel(self, network):
        plotter = sm.plot.stage(columns=2)
        assert sm.plot.features(CUBE, network, title="cube", plotter=plotter) is plotter
        assert any("cube" in str(getattr(each, "GetText", lambda _: "")(7)) for each in plotter.actors.values())
        plotter.close()

    def test_becomes_a_file(self, network, zones, tmp_path):
        path = sm.plot.picture(tmp_path / "cube.png", sm.plot.features(CUBE, network, zones))
        assert path.stat().st_size > 5_000


class TestRefused:
    def test_are_zones_of_another_surface(self, zones):
        with pytest.raises(ValueError, match=r"^zones must be those of this surface: its triangles are others$"):
            sm.plot.features(BALL, None, zones)

    def test_is_a_network_of_another_surface(self, network):
        with pytest.raises(ValueError, match=r"^network must be one of this surface"):
            sm.plot.features(BALL, network)

    def test_are_other_objects(self, network, zones):
        with pytest.raises(TypeError, match=r"^zones must be a Zones, not FeatureNetwork$"):
            sm.plot.features(CUBE, network, network)
        with pytest.raises(TypeError, match=r"^network must be a FeatureNetwork, not Zones$"):
            sm.plot.features(CUBE, zones)


@pytest.mark.parametrize(
    ("result", "words"), [("network", "12, 0 of them closed"), ("zones", "<th align='left'>plane</th><td>6, area 6")]
)
def test_notebooks_show_a_picture_and_a_table(result, words, request):
    html = request.getfixturevalue(result)._repr_html_()
    assert words in html
    assert "data:image/png;base64," in html


def test_a_notebook_shows_lines_in_the_picture(network, zones):
    assert card("", {}, network) == card("", {}, zones)  # zones by default, and lines
    assert card("", {}, network) != card("", {}, CUBE)
