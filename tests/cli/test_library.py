"""`simplexmesh library`: what it adds, lists and recognizes is what the library does."""

from __future__ import annotations

import json
import os
import signal

import numpy as np
import pytest
import SimpleITK

import simplexmesh as sm
from simplexmesh.cli import app
from tests.recognition import reference as reference

T = np.array([[0, -1.0, 0, 5], [1, 0, 0, 0], [0, 0, 1, -2], [0, 0, 0, 1]])

COMMAND = "library"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    mesh = reference.lumpy(12)
    mesh.save(folder / "lumpy.stl")
    sm.torus(radius=1.2, tube_radius=0.4).save(folder / "ring.vtp")
    np.savetxt(folder / "scan.xyz", mesh.vertices @ T[:3, :3].T + T[:3, 3])
    np.savetxt(folder / "few.xyz", mesh.vertices[:20])
    (folder / "broken.sml").write_text("not a library\n" * 100)
    sm.ModelLibrary(folder / "empty.sml").add("ring", sm.torus(radius=1.2, tube_radius=0.4))
    sm.ModelLibrary(folder / "empty.sml").remove("ring")
    return folder


@pytest.fixture(scope="module")
def models(files):
    library = sm.ModelLibrary(files / "models.sml")
    for name in ("lumpy.stl", "ring.vtp"):
        library.add(name.partition(".")[0], files / name)
    return library.path


def test_dark_objects(command, tmp_path, monkeypatch):
    """A cavity is a body whose inside is below the level: in the library, found and drawn as such."""
    drawn, overlay = [], sm.plot.overlay
    monkeypatch.setattr(sm.plot, "overlay", lambda *given, **how: drawn.append(how["inside"]) or overlay(*given, **how))
    image = SimpleITK.GetImageFromArray(egg_distance().astype(np.float32))
    SimpleITK.WriteImage(image, tmp_path / "dark.nrrd")
    code, _, _ = command("add", tmp_path / "models.sml", tmp_path / "dark.nrrd", "--level", 0, "--inside", "below")
    assert code == 0
    cloud = sm.ModelLibrary(tmp_path / "models.sml").points("dark")
    away = cloud.points - cloud.points.mean(axis=0)
    assert ((cloud.normals * away).sum(axis=1) > 0).mean() > 0.99
    options = ("--level", 0, "--inside", "below", "--json", "--picture", tmp_path / "seen.png")
    code, out, _ = command("recognize", tmp_path / "models.sml", tmp_path / "dark.nrrd", *options)
    assert json.loads(out)["models"][0]["score"] > 0.9
    image = ("register", str(tmp_path / "dark.nrrd"), str(tmp_path / "dark.nrrd"), *map(str, options))
    assert app.run(image) == 0
    assert drawn == ["below", "below"]


def egg_distance():
    """Negative within an egg."""
    x, y, z = np.mgrid[-14:15, -14:15, -14:15]
    return np.sqrt((x / 12) ** 2 + (y / (9 + 0.2 * x)) ** 2 + (z / 7) ** 2) - 1


def test_adds_and_lists(command, files, tmp_path):
    where = tmp_path / "models.sml"
    code, out, _ = command("add", where, files / "lumpy.stl", files / "ring.vtp", "--json")
    assert code == 0
    assert json.loads(out)["added"] == ["lumpy", "ring"]
    code, out, _ = command("add", where, files / "ring.vtp", "--name", "another ring")
    assert code == 0
    assert "another ring" in out
    code, out, _ = command("list", where)
    assert out.splitlines() == ["lumpy", "ring", "another ring"]
    code, out, err = command("add", where, files / "ring.vtp")
    assert (code, out) == (2, "")
    assert "names must be new" in err
    assert "(see --replace); it already has ring" in err
    assert command("add", where, files / "ring.vtp", "--replace")[0] == 0
    assert json.loads(command("list", where, "--json")[1])["models"] == ["lumpy", "another ring", "ring"]
    assert "removed  ring, lumpy" in command("remove", where, "ring", "lumpy", "ring")[1]
    assert json.loads(command("remove", where, "another ring", "--json")[1])["removed"] == ["another ring"]
    assert command("list", where)[:2] == (0, "")


def test_a_file_that_cannot_be_used_is_named_and_the_others_are_kept(command, files, tmp_path):
    where = tmp_path / "models.sml"
    code, out, err = command("add", where, files / "ring.vtp", files / "few.xyz", files / "lumpy.stl", "--json")
    assert code == 2
    assert "few.xyz: data must hold at least 50 points" in json.loads(out)["error"]
    assert "models added before are kept: ring" in err
    assert list(sm.ModelLibrary(where)) == ["ring"]


def test_nothing_is_added_where_a_name_cannot_be(command, refused, files, tmp_path):
    where, other = tmp_path / "models.sml", tmp_path / "other"
    other.mkdir()
    (other / "ring.stl").write_bytes((files / "lumpy.stl").read_bytes())
    assert "'ring' is given twice" in refused("add", where, files / "lumpy.stl", files / "ring.vtp", other / "ring.stl")
    assert not where.exists()
    command("add", where, files / "ring.vtp")
    assert command("add", where, files / "lumpy.stl", other / "ring.stl")[0] == 2
    assert list(sm.ModelLibrary(where)) == ["ring"]
    assert command("add", where, files / "lumpy.stl", "--name", "")[0] == 2


def test_names_are_text_whatever_is_in_them(command, files, tmp_path):
    """Brackets mean colors to what prints tables, and a model may be called like a row of one."""
    where = tmp_path / "models.sml"
    for name in ("a[/b]c", "time"):
        code, out, _ = command("add", where, files / "lumpy.stl", "--name", name)
        assert code == 0
        assert name in out
    out = command("recognize", where, files / "scan.xyz")[1]
    assert "a[/b]c" in out
    assert sum("time" in line for line in out.splitlines()) == 2


def test_recognizes_and_draws(command, files, models, tmp_path):
    code, out, _ = command("recognize", models, files / "scan.xyz", "--json", "--picture", tmp_path / "found.png")
    assert code == 0
    found = json.loads(out)["models"]
    assert found[0]["name"] == "lumpy"
    assert found[0]["score"] > 0.9
    assert np.allclose(found[0]["T_target_source"], T, atol=0.05)
    assert (tmp_path / "found.png").stat().st_size > 10_000
    code, out, _ = command("recognize", models, files / "scan.xyz", "--best", 1)
    assert code == 0
    assert "lumpy" in out
    assert "ring" not in out


def test_interrupted_while_adding(command, files, tmp_path, monkeypatch):
    add = sm.ModelLibrary.add

    def stopped(self, name, *rest, **options):
        if name == "ring":
            raise KeyboardInterrupt
        add(self, name, *rest, **options)

    monkeypatch.setattr(sm.ModelLibrary, "add", stopped)
    code, _, err = command("add", tmp_path / "models.sml", files / "lumpy.stl", files / "ring.vtp")
    assert code == 130
    assert "models added before are kept" in err
    assert list(sm.ModelLibrary(tmp_path / "models.sml")) == ["lumpy"]
    monkeypatch.setattr(sm.ModelLibrary, "add", lambda *_, **__: os.kill(os.getpid(), signal.SIGINT))
    code, _, err = command("add", tmp_path / "late.sml", files / "lumpy.stl", files / "ring.vtp", files / "scan.xyz")
    assert code == 130
    assert "models added before are kept" in err  # the file at hand is finished first
    monkeypatch.setattr(sm.ModelLibrary, "add", stopped)
    code, _, err = command("add", tmp_path / "none.sml", files / "ring.vtp")
    assert code == 130
    assert "nothing was written" in err
    assert not (tmp_path / "none.sml").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("recognize", "models.sml", "few.xyz"), "data must hold at least 50 points"),
        (("recognize", "models.sml", "absent.xyz"), "absent.xyz"),
        (("recognize", "absent.sml", "scan.xyz"), "there is no model library"),
        (("recognize", "broken.sml", "scan.xyz"), "broken.sml is not a whole model library"),
        (("recognize", "empty.sml", "scan.xyz"), "it is empty"),
        (("recognize", "models.sml", "scan.xyz", "--picture", "found.doc"), "--picture must end with one of"),
        (("recognize", "absent.sml", "absent.xyz"), "there is no model library"),
        (("remove", "absent.sml", "ring"), "there is no model library"),
        (("remove", "models.sml", "ring", "cow"), "there is none called 'cow'"),
        (("list", "absent.sml"), "there is no model library"),
        (("list", "broken.sml"), "is not a whole model library"),
        (("add", "broken.sml", "ring.vtp"), "is not a whole model library"),
        (("add", "models.sml", "few.xyz"), "data must hold at least 50 points"),
        (("add", "models.sml", "scan.xyz", "--level", "3"), "scan.xyz: level and label are for volumes"),
        (("add", "models.sml", "ring.vtp", "scan.xyz", "--name", "x"), "--name needs a single file, not 2"),
    ],
)
def test_bad_input(refused, files, models, words, said):
    before = models.read_bytes()
    assert said in refused(*(files / word if "." in word else word for word in words))
    assert models.read_bytes() == before


@pytest.mark.parametrize("name", ["add", "list", "remove", "recognize"])
def test_help_shows_an_example(command, name):
    code, out, _ = command(name, "--help")
    assert code == 0
    assert f"simplexmesh library {name} " in " ".join(out.split())
    assert "bool" not in out
