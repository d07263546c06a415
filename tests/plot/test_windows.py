"""Pages are looked at in a browser, windows on a screen; without a screen nothing is said of it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

import simplexmesh as sm
from simplexmesh._base._kernels_compiled import FIRST_USE
from simplexmesh.plot.stage import SCREEN, fit_screen

Image = pytest.importorskip("PIL.Image")

RED = "#c2502e"
NOWHERE = ":9876"  # no X server is here
WINDOW = """
import simplexmesh as sm
from simplexmesh.plot.stage import fit_screen
plotter = sm.plot.surface(sm.ellipsoid((9, 1, 1), 6))
fit_screen(plotter)
plotter.show(auto_close=False, interactive=False)
window = plotter.render_window
print(sm.plot.has_display(), plotter.off_screen, *window.GetActualSize(), *window.GetScreenSize())
"""


@pytest.fixture(autouse=True)
def _closed():
    yield
    pv.close_all()


def seen_by_a_browser(page: Path, size: tuple[int, int]):
    """Return the pixels (h, w, 3) that headless Chromium shows of a page."""
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if browser is None:
        pytest.skip("needs Chromium")
    out = page.with_suffix(".seen.png")
    options = ["--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    options += ["--hide-scrollbars", "--virtual-time-budget=20000", "--window-size={},{}".format(*size)]
    options += [f"--user-data-dir={page.parent / 'profile'}", f"--screenshot={out}"]
    subprocess.run([browser, *options, page.as_uri()], check=True, capture_output=True, timeout=300)
    return np.asarray(Image.open(out).convert("RGB")).astype(int)


def is_body(pixels):
    """Where pixels have color: neither background nor ink."""
    return np.ptp(pixels, axis=-1) > 40


def assert_shows_the_same(pixels, expected):
    """The two silhouettes agree nearly everywhere, and so does the color of what is in both."""
    body, wanted = is_body(pixels), is_body(expected)
    assert wanted.mean() > 0.2
    assert (body & wanted).sum() > 0.95 * (body | wanted).sum()
    both = body & wanted
    assert np.abs(np.median(pixels[both], axis=0) - np.median(expected[both], axis=0)).max() < 25


def drawn(folder, plotter):
    """Return the picture of a plotter, and that of its page in a browser."""
    size = tuple(plotter.window_size)
    path = sm.plot.picture(folder / "scene.png", plotter, close=False)
    sm.plot.picture(folder / "scene.html", plotter)
    return np.asarray(Image.open(path).convert("RGB")).astype(int), seen_by_a_browser(folder / "scene.html", size)


@pytest.mark.slow
class TestPage:
    def test_shows_what_the_window_shows(self, tmp_path):
        pytest.importorskip("trame_vtk")
        expected, pixels = drawn(tmp_path, sm.plot.surface(sm.torus(40, 16), color=RED, title="a ring"))
        assert_shows_the_same(pixels, expected)
        height, width = pixels.shape[:2]
        title = slice(0, height // 20), slice(width // 3, 2 * width // 3)
        assert pixels[title].min() < 120 < pixels[: height // 20, : width // 3].min()  # letters, and none beside them

    def test_shows_colors(self, tmp_path):
        pytest.importorskip("trame_vtk")
        ring = sm.torus(40, 16)
        _, pixels = drawn(tmp_path, sm.plot.heat(ring, ring.vertices[:, 0], name="x (mm)"))
        red, blue = ((pixels[..., one] - pixels[..., 2 - one] > 100).nonzero()[1].mean() for one in (0, 2))
        assert 0 < blue < red - 100  # x points to the right

    def test_an_empty_page_is_seen(self, tmp_path):
        (tmp_path / "blank.html").write_text("<html><body></body></html>", encoding="utf-8")
        pixels = seen_by_a_browser(tmp_path / "blank.html", (400, 300))
        with pytest.raises(AssertionError):
            assert_shows_the_same(pixels, np.broadcast_to([194, 80, 46], pixels.shape))

    def test_says_what_it_needs(self, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "trame_vtk.modules.vtk", None)
        with pytest.raises(ImportError, match=r"^a page needs trame-vtk: pip install 'simplexmesh\[notebook\]'$"):
            sm.plot.picture(tmp_path / "ball.html", sm.plot.surface(sm.sphere(4)))
        assert list(tmp_path.iterdir()) == []


def run(*command, display=None, **variables):
    """Run Python with a display of its own, or none, off screen or not as that says."""
    kept = {name: value for name, value in os.environ.items() if name not in {"DISPLAY", "PYVISTA_OFF_SCREEN"}}
    shown = {} if display is None else {"DISPLAY": display}
    environment = kept | shown | variables | {"PYTHONPATH": os.pathsep.join(sys.path)}
    out = subprocess.run([sys.executable, *command], env=environment, capture_output=True, text=True, timeout=300)
    lines = out.stderr.splitlines(keepends=True)
    out.stderr = "".join(line for line in lines if FIRST_USE not in line)  # kernels may not have been compiled yet
    return out


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the others have a display")
@pytest.mark.parametrize("display", [None, NOWHERE])
def test_nothing_is_said_of_x_servers(display, tmp_path):
    sm.sphere(4).save(tmp_path / "ball.vtp")
    command = f"import os; os.chdir({str(tmp_path)!r}); from simplexmesh.cli import main; main(['view', 'ball.vtp'])"
    out = run("-c", command, display=display)
    assert (out.returncode, out.stderr) == (0, "note: there is no display; the picture was written to ball.vtp.png\n")
    assert np.asarray(Image.open(tmp_path / "ball.vtp.png")).std() > 5


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the others have a display")
def test_no_display_is_noticed(monkeypatch):
    monkeypatch.setattr(pv, "OFF_SCREEN", False)
    for display in ("", NOWHERE):
        monkeypatch.setenv("DISPLAY", display)
        assert not sm.plot.has_display()
    monkeypatch.setattr("sys.platform", "darwin")
    assert sm.plot.has_display()
    monkeypatch.setattr(pv, "OFF_SCREEN", True)
    assert not sm.plot.has_display()


@pytest.mark.parametrize("screen", [(800, 600), (3840, 2160), (1080, 1920)])
def test_the_window_follows_the_screen(screen):
    class Window:
        def GetScreenSize(self):
            return screen

    class Plotter:
        window_size, render_window = [1200, 700], Window()

    fit_screen(Plotter)
    shares = np.array(Plotter.window_size) / screen
    assert shares.max() == pytest.approx(SCREEN, abs=0.002)
    assert np.divide(*Plotter.window_size) == pytest.approx(1200 / 700, rel=0.01)


@pytest.mark.nightly
@pytest.mark.slow
def test_a_window_opens_on_a_small_screen():
    if shutil.which("Xvfb") is None:
        pytest.skip("needs Xvfb")
    reading, writing = os.pipe()
    with subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", "640x480x24", "-nolisten", "tcp"],
        pass_fds=[writing], stderr=subprocess.DEVNULL,
    ) as server:  # fmt: skip
        os.close(writing)
        try:
            with os.fdopen(reading) as numbers:
                out = run("-c", WINDOW, display=f":{numbers.readline().strip()}")
        finally:
            server.terminate()
    words = out.stdout.split()
    assert (words[:2], out.stderr) == (["True", "False"], "")
    width, height, *screen = map(int, words[2:])  # on a busy machine VTK may give the server up, and its screen
    assert max(width / screen[0], height / screen[1]) == pytest.approx(SCREEN, abs=0.01)
