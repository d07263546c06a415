"""What all commands that write a file have in common: it is refused before any work, and is never the input."""

from __future__ import annotations

import json
import sys

import pytest

import simplexmesh as sm
from simplexmesh.data.io.writing import FORMATS
from tests.nightly.marks import nightly

pytestmark = pytest.mark.usefixtures("coarse_starts")

COMMANDS = {
    "reconstruct": ("--vertices", 40, "--creases", "none"),
    "curvature": (),
    "decimate": ("--vertices", 100),
    "features": (),
}
every = pytest.mark.parametrize("name", COMMANDS)


@pytest.fixture
def ball(tmp_path_factory):
    path = tmp_path_factory.mktemp("input") / "ball.vtp"
    sm.sphere(4).save(path)
    return path


@pytest.fixture
def unread(monkeypatch):
    """Let reading fail the test."""
    monkeypatch.setattr("simplexmesh.data.io.reading.read", lambda *_, **__: pytest.fail("too late"))


@every
@pytest.mark.parametrize(
    ("output", "words"),
    [
        ("out.doc", "--output must end with one of .vtp, "),
        ("out", ", not nothing"),
        ("nowhere/out.vtp", "--output must be in an existing folder"),
    ],
)
@pytest.mark.usefixtures("unread")
def test_an_output_that_cannot_be_is_refused(refused, ball, tmp_path, name, output, words):
    assert words in refused(name, ball, *COMMANDS[name], "-o", tmp_path / output)


@pytest.mark.parametrize(
    ("name", "endings"),
    [("reconstruct", (".vtp", ".stl", ".xyz")), ("decimate", FORMATS), *nightly(("reconstruct", FORMATS))],
)
def test_models_are_written_in_every_format_of_surfaces_and_points(command, ball, tmp_path, name, endings):
    for ending in (each for each in endings if each != ".e57"):  # which has no wheel on every platform
        code, _, err = command(name, ball, *COMMANDS[name], "-o", tmp_path / f"out{ending}")
        assert code == 0, err
        assert len(sm.read_points(tmp_path / f"out{ending}").points) >= 40


@pytest.mark.parametrize(
    ("name", "library", "ending", "extra"),
    [
        ("reconstruct", "trimesh", "glb", "export"),
        ("reconstruct", "lxml", "3mf", "export"),
        ("decimate", "networkx", "3mf", "export"),
        ("reconstruct", "laspy", "laz", "survey"),
        ("reconstruct", "pye57", "e57", "survey"),
    ],
)
@pytest.mark.usefixtures("unread")
def test_a_missing_library_is_told_before_any_work(refused, ball, tmp_path, monkeypatch, name, library, ending, extra):
    monkeypatch.setitem(sys.modules, library, None)
    err = refused(name, ball, *COMMANDS[name], "-o", tmp_path / f"out.{ending}")
    assert err == f"error: this needs the extra {extra}: pip install 'simplexmesh[{extra}]'\n".rstrip()


@pytest.mark.parametrize(
    ("name", "option"),
    [*((name, "-o") for name in COMMANDS), *((name, "--picture") for name in COMMANDS if name != "decimate")],
)
@pytest.mark.usefixtures("unread")
def test_a_folder_that_cannot_be_written_to_is_refused(refused, ball, tmp_path, monkeypatch, name, option):
    locked = tmp_path / "locked"
    locked.mkdir()
    monkeypatch.setattr("os.access", lambda path, mode: path != locked)
    outputs = {"-o": tmp_path / "a.vtp", option: locked / ("a.vtp" if option == "-o" else "a.png")}
    words = (word for pair in outputs.items() for word in pair)
    assert f"must be in a writable folder, '{locked}' is not" in refused(name, ball, *COMMANDS[name], *words)


@every
def test_the_input_is_not_overwritten(refused, ball, name):
    before = ball.read_bytes()
    assert "must not be the input" in refused(name, ball, *COMMANDS[name], "-o", ball)
    assert ball.read_bytes() == before


@every
def test_what_is_wrong_is_told_in_json_too(command, ball, tmp_path, name):
    code, out, err = command(name, ball.with_name("other.vtp"), *COMMANDS[name], "-o", tmp_path / "out.vtp", "--json")
    assert code == 2
    assert f"error: {json.loads(out)['error']}\n" in err


@every
def test_a_failure_to_write_names_the_file_asked_for(refused, ball, tmp_path, monkeypatch, name):
    def full(*_, **__):
        raise OSError(28, "No space left on device", "/somewhere/.b.vtp.123.part")

    for kind in (sm.SimplexMesh, sm.Zones):
        monkeypatch.setattr(kind, "save", full)
    path = tmp_path / "b.vtp"
    assert f"error: {path}: no space left on device" in refused(name, ball, *COMMANDS[name], "-o", path)
