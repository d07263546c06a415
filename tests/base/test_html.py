"""What notebooks show: tables that say the same as the results, and pictures that are not blank."""

from __future__ import annotations

import base64
import re
from io import BytesIO

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh._base.html import card, grid

BALL = sm.sphere(8, radius=2.0)


def picture(html):
    """Return the pixels of the picture in a page."""
    image = pytest.importorskip("PIL.Image")
    return np.asarray(image.open(BytesIO(base64.b64decode(re.search("base64,([^']+)'", html)[1]))))


def assert_shows_a_body(html):
    """The corner of the picture is white, its middle is not."""
    pixels = picture(html)[..., :3]
    assert (pixels[0, 0] == 255).all()
    assert pixels[pixels.shape[0] // 2, pixels.shape[1] // 2].min() < 235


@pytest.fixture(scope="module")
def model():
    return sm.reconstruct(sm.sphere(16).vertices, vertices=300)


def test_a_mesh_is_a_picture_and_a_table():
    html = BALL._repr_html_()
    for text in (
        "1,280 vertices",
        "<td>642</td>",
        "genus 0, 0 holes",
        " x ".join(f"{side:.4g}" for side in np.ptp(BALL.bounds, axis=0)),
    ):
        assert text in html
    assert_shows_a_body(html)
    assert len(html) < 150_000


@pytest.mark.parametrize("kind", ["triangles", "points"])
def test_data_is_a_picture_and_a_table(kind):
    thing = BALL.triangulated() if kind == "triangles" else sm.PointCloud(BALL.vertices, BALL.normals)
    thing = thing.in_unit("mm", "mm").with_data(heat=thing.bounds[1, 0] * np.ones(len(thing.to_pyvista().points)))
    html = thing._repr_html_()
    for text in (repr(thing), " x ".join(f"{side:.4g}" for side in np.ptp(thing.bounds, axis=0)) + " mm", "heat"):
        assert text in html
    assert_shows_a_body(html)


def test_a_volume_is_a_table():
    html = sm.Volume(np.arange(24.0).reshape(2, 3, 4), spacing=(1, 2, 3), unit="mm")._repr_html_()
    for text in ("2 x 3 x 4", "1 x 4 x 9 mm", "1, 2, 3", "float64, 0 to 23"):
        assert f"<td>{text}</td>" in html


def test_a_reconstruction_tells_its_fit(model):
    html = model._repr_html_()
    assert f"rms {model.distance.mesh_to_data.rms:.4g}" in html
    assert f"{len(model.history)} iterations" in html
    assert picture(html).std() > 5


def test_distances_print_as_a_table(model):
    head, to_data, to_mesh = str(model.distance).splitlines()
    assert head.split() == ["mean", "rms", "95", "%", "max", "points"]
    assert to_data.split()[3:] == [*(f"{x:.4g}" for x in list(vars(model.distance.mesh_to_data).values())[:4]), "300"]
    assert to_mesh.startswith("data to mesh")
    assert model.distance._repr_html_().count("<tr>") == 3


def test_curvatures_tell_how_they_are_distributed():
    found = sm.curvature(BALL, "simplex_angle")
    html = found._repr_html_()
    assert "Curvature(simplex_angle, 1,280 vertices)" in html
    assert html.count("<td>0.5</td>") >= 3  # the mean curvature of a sphere of radius 2
    assert_shows_a_body(html)
    assert "<img" not in sm.curvature(BALL, "simplex_angle", at=[3, 4])._repr_html_()  # of two vertices


def test_registrations_tell_the_motion():
    rng = np.random.default_rng(0)
    egg = sm.sphere(16).vertices * [3, 2, 1] + 0.3 * np.sin(sm.sphere(16).vertices * 2)
    found = sm.register(egg[rng.permutation(len(egg))] + [1, 2, 3], egg[egg[:, 0] < 1])
    html = found._repr_html_()
    assert f"{found.score:.2f}, {found.overlap:.0%}" in html
    assert "degrees" in html
    assert_shows_a_body(html)
    pixels = picture(html)[..., :3].astype(int)
    orange, blue = pixels[..., 0] > pixels[..., 2] + 60, pixels[..., 2] > pixels[..., 0] + 40
    assert min(orange.sum(), blue.sum()) > 100  # the end of the source, and the target


@pytest.mark.nightly
def test_scans_are_shown_together_each_in_its_color():
    egg = sm.ellipsoid((3, 2, 1), 20).vertices
    egg = egg + 0.1 * egg**2
    parts = [egg[egg[:, 0] < 1], egg[egg[:, 0] > -1] + [50, 0, 0], egg[egg[:, 1] < 0.5] - [0, 50, 0]]
    found = sm.register_all(parts)
    html = found._repr_html_()
    for text in ("3 scans", f"{len(found.edges)} agree, 0 contradict", f"{found.residuals.max():.3g}", "none"):
        assert f"<td>{text}</td>" in html
    pixels = picture(html)[..., :3].astype(int)
    red, green, blue = np.moveaxis(pixels, -1, 0)
    for share in (green - blue, blue - red, red - 2 * green + blue):  # orange, blue and red have most of one each
        assert (share > 30).sum() > 100
    inked = np.flatnonzero((pixels < 235).any(axis=2).any(axis=0))
    assert len(inked) == np.ptp(inked) + 1  # no gap: they lie where they belong


def test_signatures_are_gray_where_nothing_was_seen():
    egg = sm.sphere(16).vertices * [3, 2, 1]
    seen = sm.sai(egg, 6)
    half = sm.SAI(6, seen.mesh, seen.mesh.vertices[:, 2] > 0)
    html = half._repr_html_()
    for text in ("sphere, 6", "720", f"{half.visible_fraction:.0%}", f"{half.area:.4g}"):
        assert f"<td>{text}</td>" in html
    assert f"{np.degrees(np.median(half.angles)):.1f}" in html
    gray, none = (
        ((np.ptp(pixels, axis=2) < 8) & (pixels[..., 0] < 235)).sum()
        for pixels in (picture(sai._repr_html_())[..., :3] for sai in (half, seen))
    )
    assert gray > none + 500


def test_text_is_escaped():
    assert card("<b>", {"a": "<script>"}) == (
        "<table><caption><b>&lt;b&gt;</b></caption><tr><th align='left'>a</th><td>&lt;script&gt;</td></tr></table>"
    )
    assert "&amp;" in grid(("x",), {"&": ("1",)})


@pytest.mark.nightly
def test_a_notebook_shows_them(tmp_path):
    nbformat = pytest.importorskip("nbformat")
    execute = pytest.importorskip("nbconvert.preprocessors").ExecutePreprocessor
    pytest.importorskip("ipykernel")
    cells = ["import simplexmesh as sm\nball = sm.sphere(6)\nball", "sm.curvature(ball, 'simplex_angle')"]
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    execute(timeout=300, kernel_name="python3").preprocess(book, {"metadata": {"path": str(tmp_path)}})
    shown = [cell.outputs[-1]["data"]["text/html"] for cell in book.cells]
    assert picture(shown[0]).std() > 5
    assert "Curvature(simplex_angle" in shown[1]
    assert_shows_a_body(shown[1])
