"""The command: what it prints and writes, and that bad input gets one sentence and leaves nothing behind."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import warnings
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.cli import app, info, report, view
from tests.recognition.scans.test_register_all import views as views_of_a_body

pytestmark = pytest.mark.usefixtures("coarse_starts")

BALL = 5.0


@pytest.fixture(scope="session")
def files(tmp_path_factory):
    """Small inputs, good and bad, by name."""
    folder = tmp_path_factory.mktemp("inputs")
    x, y, z = np.mgrid[-8:9, -8:9, -8:9]
    distance = np.sqrt(x * x + y * y + z * z)
    ball = sm.sphere(8, radius=BALL)
    ball.save(folder / "ball.vtp")
    ball.save(folder / "ball.stl")
    np.savetxt(folder / "ball.xyz", np.hstack([ball.vertices, ball.normals]))
    np.savetxt(folder / "three.xyz", ball.vertices[:3])
    np.savetxt(folder / "nan.xyz", np.where(np.eye(9, 3), np.nan, 1.0))
    write_metaimage(folder / "volume.mha", 100 * (BALL - distance))
    write_metaimage(folder / "labels.mha", (distance < BALL).astype(np.uint8) + 2 * (distance < 2.5).astype(np.uint8))
    (folder / "empty.xyz").write_text("")
    (folder / "broken.stl").write_bytes((folder / "ball.stl").read_bytes()[:-100])
    (folder / "noise.vtp").write_bytes(bytes(range(256)) * 4)
    return folder


def write_off(path, vertices, faces):
    rows = [" ".join(map(str, row)) for row in [*map(list, vertices), *([3, *face] for face in faces)]]
    path.write_text("\n".join(["OFF", f"{len(vertices)} {len(faces)} 0", *rows]) + "\n")


def write_metaimage(path, values):
    types = {"float64": "MET_DOUBLE", "uint8": "MET_UCHAR"}
    header = {
        "NDims": "3",
        "DimSize": " ".join(map(str, values.shape)),
        "ElementSpacing": "1 1 1",
        "Offset": "-8 -8 -8",
        "ElementType": types[str(values.dtype)],
        "BinaryData": "True",
        "BinaryDataByteOrderMSB": "False",
        "ElementDataFile": "LOCAL",
    }
    text = "ObjectType = Image\n" + "".join(f"{name} = {value}\n" for name, value in header.items())
    path.write_bytes(text.encode() + values.tobytes(order="F"))


COMMANDS = ("demo", "reconstruct", "decimate", "register", "curvature", "library", "info", "view")
HEAVY = {"numba", "scipy", "pyvista", "vtkmodules", "numpy", "SimpleITK", "igl"}


class TestHelp:
    @pytest.mark.parametrize("name", COMMANDS)
    def test_shows_an_example_and_switches_without_a_type(self, command, name):
        code, out, _ = command(name, "--help")
        assert code == 0
        assert f"simplexmesh {name} " in " ".join(out.split())
        assert "Example" in out
        assert "bool" not in out

    def test_lists_the_commands(self, command):
        _, out, _ = command("--help")
        assert all(name in out for name in COMMANDS)

    def test_imports_nothing_heavy(self):
        code = (
            "import sys\nfrom simplexmesh.cli.app import run\n"
            "for line in ['--help'], ['curvature', '--help'], ['decimate', '--help']: assert run(line) == 0\n"
            "print('loaded', *{name.partition('.')[0] for name in sys.modules})"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=False)
        assert not HEAVY & set(done.stdout.split("loaded ")[1].split())

    def test_version(self, command):
        assert command("--version") == (0, f"simplexmesh {sm.__version__}\n", "")

    def test_is_installed(self):
        done = subprocess.run(
            [sys.executable, "-m", "simplexmesh", "--version"],
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.startswith("simplexmesh ")


class TestWrongLines:
    @pytest.mark.parametrize(
        ("line", "said"),
        [
            (["saliency", "x"], "No such command 'saliency'. Did you mean 'simplexmesh curvature'?"),
            (["recognize", "x"], "Did you mean 'simplexmesh library recognize'?"),
            (["reconstrct", "x"], "Did you mean 'reconstruct'?"),
            (["info", "ball.vtp", "--jsn"], "--json"),
            (["library", "recognize", "a.sml", "b", "--best", "0"], "--best must be at least 1, not 0"),
            (["view", "ball.vtp", "--view", "-xzz"], "not '-xzz': did you mean '-xz'?"),
        ],
    )
    def test_the_nearest_is_named(self, refused, line, said):
        assert said in refused(*line)

    @pytest.mark.parametrize(("option", "said"), [("--vertices", "abc"), ("--level", "high"), ("--label", "1.5")])
    def test_a_word_for_a_number_is_told(self, refused, option, said):
        err = refused("reconstruct", "x", "-o", "y.vtp", option, said)
        assert option in err
        assert repr(said) in err

    def test_an_output_that_is_full_ends_in_a_sentence(self, files, monkeypatch, capsys):
        def full(_):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(report, "as_json", full)
        monkeypatch.setattr(app, "as_json", full)
        assert app.run(["info", str(files / "ball.vtp"), "--json"]) == 2
        assert capsys.readouterr().err == "error: no space left on device\n"


class TestReconstruct:
    def test_of_a_level(self, command, files, tmp_path):
        code, out, _ = command(
            "reconstruct", files / "volume.mha", "--level", 0, "--vertices", 400, "-o", tmp_path / "b.vtp"
        )
        assert code == 0
        assert "genus 0" in out
        mesh = sm.read_mesh(tmp_path / "b.vtp")
        assert 360 <= mesh.n_vertices <= 440
        np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), BALL, atol=0.1)

    def test_of_a_label_as_json(self, command, files, tmp_path):
        code, out, _ = command(
            "reconstruct", files / "labels.mha", "--label", 3, "--vertices", 200, "-o", tmp_path / "b.ply", "--json"
        )
        facts = json.loads(out)
        assert code == 0
        assert (facts["genus"], facts["holes"], facts["components"]) == (0, 0, 1)
        assert facts["distance"]["mesh_to_data"]["rms"] < 0.5
        assert 180 <= facts["vertices"] <= 220
        assert facts["output"] == str(tmp_path / "b.ply")
        assert sm.read_triangles(tmp_path / "b.ply").is_closed

    def test_of_points_with_a_picture(self, command, files, tmp_path):
        code, _, _ = command(
            "reconstruct",
            files / "ball.xyz",
            "--vertices",
            300,
            "-o",
            tmp_path / "b.vtp",
            "--picture",
            tmp_path / "b.png",
        )
        assert code == 0
        assert (tmp_path / "b.png").read_bytes().startswith(b"\x89PNG")

    def test_of_scans_with_poses(self, command, files, tmp_path):
        ball = sm.sphere(8, radius=BALL)
        halves = {"left": ball.vertices[:, 0] < 1, "right": ball.vertices[:, 0] > -1}
        for name, part in halves.items():
            moved = ball.vertices[part] - (10.0 if name == "right" else 0.0)
            np.savetxt(tmp_path / f"{name}.xyz", np.hstack([moved, ball.normals[part]]))
        (tmp_path / "scans.conf").write_text("bmesh left.xyz 0 0 0 0 0 0 1\nbmesh right.xyz 10 10 10 0 0 0 1\n")
        code, _, err = command(
            "reconstruct", tmp_path / "left.xyz", tmp_path / "right.xyz", "--poses", tmp_path / "scans.conf",
            "--vertices", 300, "-o", tmp_path / "b.vtp", "--json",
        )  # fmt: skip
        assert code == 0, err
        np.testing.assert_allclose(np.linalg.norm(sm.read_mesh(tmp_path / "b.vtp").vertices, axis=1), BALL, atol=0.3)

    def test_of_scans_without_poses(self, command, tmp_path, monkeypatch):
        shares = []

        @contextmanager
        def watched(*_, **__):
            yield lambda fraction, message: shares.append(fraction)

        monkeypatch.setattr(report, "progress", watched)
        scans, _ = views_of_a_body(3, np.random.default_rng(4), samples=1500)
        paths = [tmp_path / f"scan{k}.xyz" for k in range(3)]
        for path, scan in zip(paths, scans, strict=True):
            np.savetxt(path, scan - scan.mean(axis=0))
        usual = ("--vertices", 400, "--creases", "none", "-o", tmp_path / "a.vtp")
        code, out, err = command("reconstruct", *paths, *usual, "--poses", "auto", "--json")
        assert code == 0, err
        found = json.loads(out)
        assert found["distance"]["data_to_mesh"]["rms"] < 0.05  # in frames that were not registered, 0.3
        assert list(found["poses"]) == [path.name for path in paths]
        np.testing.assert_array_equal(found["poses"]["scan0.xyz"], np.eye(4))
        assert found["left_out"] == []
        assert shares == sorted(shares)  # one bar, of the poses and the model
        assert shares[-1] == 1
        code, _, err = command("reconstruct", *paths, *usual, "--iterations", 5, "--poses", "none")
        assert code == 0
        assert "different frames" not in err
        code, _, err = command("reconstruct", paths[0], "--poses", "auto", "-o", tmp_path / "c.vtp")
        assert code == 2
        assert "--poses auto needs several scans" in err

    def test_starts_from_a_file(self, command, files, tmp_path):
        code, out, _ = command(
            "reconstruct",
            files / "volume.mha",
            "--level",
            0,
            "--init",
            files / "ball.vtp",
            "-o",
            tmp_path / "b.vtp",
            "--json",
        )
        assert code == 0
        assert json.loads(out)["vertices"] == sm.sphere(8).n_vertices

    def test_json_tells_all_there_is_to_know(self, command, files, tmp_path):
        _, out, _ = command(
            "reconstruct", files / "volume.mha", "--level", 0, "--vertices", 200, "-o", tmp_path / "b.vtp", "--json",
            "--iterations", 1,
        )  # fmt: skip
        facts = json.loads(out)
        mesh = sm.read_mesh(tmp_path / "b.vtp")
        ends = mesh.vertices[mesh.connectivity.edge_vertices]
        assert facts["mean_edge"] == pytest.approx(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).mean())
        assert (facts["problems"], facts["tangled"]) == ([], 0)
        assert facts["topology"].keys() == {"holes", "handles", "refined", "exchanged", "swapped", "exceptions"}
        assert any("did not converge" in said for said in facts["notes"])

    def test_a_bad_model_is_told(self, command, files, tmp_path, monkeypatch):
        ball = sm.sphere(4, radius=BALL)
        vertices = ball.vertices.copy()
        vertices[0] *= -1.5
        bad = replace(sm.reconstruct(ball.vertices, vertices=200), mesh=ball.moved(vertices))
        monkeypatch.setattr("simplexmesh.motion.reconstruct.pipeline.reconstruct", lambda *_, **__: bad)
        arguments = ["reconstruct", files / "ball.xyz", "-o", tmp_path / "b.vtp"]
        code, out, err = command(*arguments)
        problems = bad.mesh.check(self_intersections=True).problems
        assert code == 0
        assert all(f"note: the model has a defect: {problem}" in err for problem in problems)
        assert "problems" in out
        _, out, err = command(*arguments, "--json")
        assert json.loads(out)["problems"] == list(problems)
        assert f"note: the model {tmp_path / 'b.vtp'} was replaced" in err

    def test_an_interrupt_before_the_motion_says_that_nothing_was_written(self, command, files, tmp_path, monkeypatch):
        def interrupted(*_, **__):
            raise KeyboardInterrupt

        monkeypatch.setattr("simplexmesh.motion.reconstruct.pipeline.reconstruct", interrupted)
        arguments = ["reconstruct", files / "ball.xyz", "-o", tmp_path / "b.vtp"]
        assert command(*arguments) == (130, "", "error: interrupted; nothing was written\n")
        code, out, _ = command(*arguments, "--json")
        assert (code, json.loads(out)) == (130, {"error": "interrupted; nothing was written"})
        assert list(tmp_path.iterdir()) == []

    def test_an_interrupt_keeps_the_last_state(self, command, files, tmp_path, monkeypatch):
        @contextmanager
        def interrupting(*_, **__):
            def report(fraction, message):
                if 0.2 < fraction < 0.9:
                    raise KeyboardInterrupt

            yield report

        monkeypatch.setattr(report, "progress", interrupting)
        code, out, err = command(
            "reconstruct", files / "volume.mha", "--level", 0, "--vertices", 200, "-o", tmp_path / "b.vtp",
            "--picture", tmp_path / "b.png",
        )  # fmt: skip
        assert code == 130
        assert "iterations, interrupted" in out
        assert not (tmp_path / "b.png").exists()
        assert f"note: interrupted; the model reached so far is in {tmp_path / 'b.vtp'}" in err
        assert sm.read_mesh(tmp_path / "b.vtp").genus == 0


class TestBadInput:
    """One sentence that names the argument or the file, code 2, nothing on the output, nothing written."""

    @pytest.mark.parametrize(
        ("name", "options", "words"),
        [
            ("nowhere.mha", [], ["nowhere.mha"]),
            ("empty.xyz", [], ["empty.xyz"]),
            ("three.xyz", [], ["4", "3"]),
            ("broken.stl", [], ["broken.stl"]),
            ("noise.vtp", [], ["noise.vtp"]),
            ("volume.mha", [], ["level must be given"]),
            ("volume.mha", ["--level", 99999], ["level", "99999"]),
            ("volume.mha", ["--level", "nan"], ["level"]),
            ("volume.mha", ["--level", "high"], ["--level", "number"]),
            ("volume.mha", ["--level", 0, "--vertices", 3], ["vertices must be at least 20, not 3"]),
            ("volume.mha", ["--level", 0, "--vertices", "many"], ["--vertices", "'many'"]),
            ("volume.mha", ["--level", 0, "--init", "cube"], ["init must be one of", "'cube'"]),
            ("volume.mha", ["--level", 0, "--init", "nowhere.vtp"], ["nowhere.vtp"]),
            ("volume.mha", ["--level", 0, "--components", "some"], ["components must be one of", "'some'"]),
            ("volume.mha", ["--level", 0, "--inside", "left"], ["inside must be one of", "'left'"]),
            ("volume.mha", ["--level", 0, "--iterations", -1], ["iterations must be at least 0, not -1"]),
            ("volume.mha", ["--level", 0, "--view", "up"], ["--view must be one of 'iso', 'xy'", "'up'"]),
            ("volume.mha", ["--level", 0, "--label", 1], ["level or label, not both"]),
            ("volume.mha", ["--level", 0, "--view", "xz"], ["--view needs --picture"]),
            ("volume.mha", ["--level", 0, "--colour", "red"], ["--colour"]),
            ("labels.mha", [], ["label must be given"]),
            ("labels.mha", ["--label", 7], ["label", "7"]),
            ("ball.xyz", ["--level", 3], ["level", "PointCloud"]),
            ("ball.xyz", ["--poses", "nowhere.conf"], ["nowhere.conf"]),
        ],
    )
    def test_is_told_in_one_sentence(self, refused, files, tmp_path, name, options, words):
        err = refused("reconstruct", files / name, *options, "-o", tmp_path / "out.vtp")
        assert all(word in err for word in words)
        assert list(tmp_path.iterdir()) == []

    def test_points_that_are_not_numbers_are_told(self, refused, files, tmp_path):
        refused("reconstruct", files / "nan.xyz", "-o", tmp_path / "out.vtp")

    def test_a_missing_argument_is_told(self, refused):
        refused("reconstruct")

    def test_an_unknown_command_is_told(self, refused):
        assert "polish" in refused("polish")

    @pytest.mark.parametrize("name", ["info", "view"])
    def test_of_the_other_commands(self, refused, files, name):
        assert "empty.xyz" in refused(name, files / "empty.xyz")

    def test_a_fault_of_our_own_is_not_hidden(self, monkeypatch):
        monkeypatch.setattr(app, "app", lambda **_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            app.run([])


class TestFailures:
    @pytest.mark.parametrize(
        ("problem", "code", "told"),
        [
            (KeyboardInterrupt(), 130, "error: interrupted; nothing was written\n"),
            (sm.DivergedError("the motion left the finite numbers"), 1, "error: the motion left the finite numbers\n"),
            (sm.TopologyError("faces 3 and 4 share two edges"), 2, "error: faces 3 and 4 share two edges\n"),
            (PermissionError(13, "Permission denied", "a.vtp"), 2, "error: a.vtp: permission denied\n"),
            (ValueError("first line\n  second"), 2, "error: first line second\n"),
        ],
    )
    def test_have_their_codes(self, monkeypatch, capsys, problem, code, told):
        def failing(**_):
            raise problem

        monkeypatch.setattr(app, "app", failing)
        assert app.run([]) == code
        assert capsys.readouterr().err == told

    def test_an_interrupt_while_importing_leaves_no_traceback(self):
        code = (
            "import sys, simplexmesh.cli\n"
            "class Interrupting:\n"
            "    def find_spec(self, name, *_):\n"
            "        if name == 'typer': raise KeyboardInterrupt\n"
            "sys.meta_path.insert(0, Interrupting())\n"
            "simplexmesh.cli.main(['--help'])"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=False)
        assert (done.returncode, done.stdout) == (130, "")
        assert done.stderr == "error: interrupted; nothing was written\n"

    def test_warnings_become_notes(self, monkeypatch, capsys):
        monkeypatch.setattr(app, "app", lambda **_: warnings.warn("merged 3\n duplicate points", stacklevel=1))
        assert app.run([]) == 0
        assert capsys.readouterr().err == "note: merged 3 duplicate points\n"

    @pytest.mark.parametrize(
        ("said", "told"),
        [
            ("holes='none' closes it, holes='auto' does not", "--holes none closes it, --holes auto does not"),
            ("(poses=[np.eye(4)] * 12 keep the frames)", "(--poses none keeps the frames)"),
            ("found from init='sphere' or 'ellipsoid'", "found from --init sphere or ellipsoid"),
        ],
    )
    def test_messages_name_options_and_no_arguments(self, monkeypatch, capsys, said, told):
        def failing(**_):
            warnings.warn(said, stacklevel=1)
            raise ValueError(said)

        monkeypatch.setattr(app, "app", failing)
        assert app.run([]) == 2
        assert capsys.readouterr().err == f"note: {told}\nerror: {told}\n"


class TestInfo:
    def test_of_a_model(self, command, files):
        _, out, _ = command("info", files / "ball.vtp", "--json")
        facts = json.loads(out)
        ball = sm.sphere(8, radius=BALL)
        assert facts["kind"] == "simplex mesh"
        assert (facts["vertices"], facts["faces"], facts["genus"]) == (ball.n_vertices, ball.n_faces, 0)
        assert facts["volume"] == pytest.approx(ball.volume)
        assert facts["problems"] == []
        assert facts["extent"] == pytest.approx((ball.bounds[1] - ball.bounds[0]).tolist())

    def test_of_triangles(self, command, files, tmp_path):
        facts = json.loads(command("info", files / "ball.stl", "--json")[1])
        assert (facts["genus"], facts["borders"], facts["components"], facts["problems"]) == (0, 0, 1, [])
        ring = sm.torus().triangulated()
        write_off(tmp_path / "in.off", ring.vertices, ring.faces[:, ::-1])
        facts = json.loads(command("info", tmp_path / "in.off", "--json")[1])
        assert (facts["genus"], facts["problems"]) == (1, ["the faces are oriented inward"])
        write_off(tmp_path / "book.off", [*np.eye(3), [0, 0, 0], [1, 1, 1]], [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
        code, out, _ = command("info", tmp_path / "book.off")
        assert code == 0
        assert "at most two triangles may share an edge" in out

    def test_of_arrays_and_units(self, command, files, tmp_path):
        points = np.random.default_rng(0).random((9, 3))
        sm.PointCloud(points, data={"depth": points[:, 2]}, unit="cm").save(tmp_path / "a.ply")
        facts = json.loads(command("info", tmp_path / "a.ply", "--json")[1])
        assert (facts["arrays"], facts["unit"]) == (["depth"], "cm")
        assert json.loads(command("info", files / "volume.mha", "--json")[1])["unit"] is None
        assert "unknown" in command("info", files / "volume.mha")[1]

    def test_of_a_library(self, command, files, tmp_path):
        sm.ModelLibrary(tmp_path / "two.sml").add("ball", files / "ball.vtp")
        _, out, _ = command("info", tmp_path / "two.sml", "--json")
        assert json.loads(out) == {"file": str(tmp_path / "two.sml"), "kind": "model library", "models": ["ball"]}
        (tmp_path / "cut.sml").write_bytes((tmp_path / "two.sml").read_bytes()[:3000])
        code, _, err = command("info", tmp_path / "cut.sml")
        assert code == 2
        assert "is not a whole model library" in err
        (tmp_path / "two.sml").rename(tmp_path / "two.dat")
        code, _, err = command("info", tmp_path / "two.dat")
        assert code == 2
        assert "two.dat is an SQLite database" in err

    def test_of_a_pipe(self, command, tmp_path):
        os.mkfifo(tmp_path / "pipe.ply")
        code, _, err = command("info", tmp_path / "pipe.ply")
        assert (code, err) == (
            2, "error: pipe.ply must be a regular file, not a pipe or a device\n"
        )  # fmt: skip

    def test_of_a_volume_says_where_it_lies(self, command, files):
        _, out, _ = command("info", files / "volume.mha", "--json")
        facts = json.loads(out)
        assert facts["kind"] == "volume"
        assert facts["shape"] == [17, 17, 17]
        assert facts["origin"] == [-8, -8, -8]
        assert facts["low"] == [-8, -8, -8]
        assert facts["range"][1] == pytest.approx(100 * BALL)

    def test_of_labels_lists_them(self, command, files):
        _, out, _ = command("info", files / "labels.mha", "--json")
        assert json.loads(out)["labels"] == [0, 1, 3]

    def test_for_people(self, command, files):
        code, out, _ = command("info", files / "ball.vtp", files / "ball.xyz", files / "ball.stl")
        assert code == 0
        assert all(word in out for word in ["simplex mesh", "points", "triangles", "genus", "problems", "none"])

    def test_tells_problems(self):
        ball = sm.sphere(3)
        vertices = ball.vertices.copy()
        vertices[0] *= -1.5
        assert info.described(ball.moved(vertices))["problems"] != []


class TestView:
    def test_without_a_display_writes_a_picture_here_and_says_so(self, command, files, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        code, out, err = command("view", files / "ball.vtp")
        assert (code, out) == (0, "ball.vtp.png\n")
        assert err == "note: there is no display; the picture was written to ball.vtp.png\n"
        before = (tmp_path / "ball.vtp.png").read_bytes()
        assert before.startswith(b"\x89PNG")
        _, out, _ = command("view", files / "ball.vtp", "--scalars", "mean_curvature")
        assert out == "ball.vtp-2.png\n"
        assert (tmp_path / "ball.vtp.png").read_bytes() == before

    @pytest.mark.parametrize("name", ["ball.xyz", "ball.vtp", "ball.stl"])
    def test_refuses_a_level_for_what_is_no_volume(self, refused, files, tmp_path, name):
        err = refused("view", files / name, "--level", 5, "--picture", tmp_path / "out.png")
        assert err.startswith("error: level and label are for volumes, not for ")
        assert list(tmp_path.iterdir()) == []

    def test_writes_the_picture_asked_for_and_says_what_was_replaced(self, command, files, tmp_path):
        picture = tmp_path / "volume.png"
        picture.write_text("old")
        code, _, err = command("view", files / "volume.mha", "--level", 0, "--picture", picture)
        assert (code, err) == (0, f"note: the picture {picture} was replaced\n")
        assert picture.read_bytes().startswith(b"\x89PNG")

    def test_turns_what_is_up(self, command, files, tmp_path):
        made = [command("view", files / "ball.vtp", "--up", up, "--picture", tmp_path / f"{up}.png")[0] for up in "yz"]
        assert made == [0, 0]
        assert (tmp_path / "y.png").read_bytes() != (tmp_path / "z.png").read_bytes()
        code, _, err = command("view", files / "ball.vtp", "--up", "y", "--view", "xz")
        assert (code, err) == (2, "error: --up needs the view iso: --view xz defines its own up axis\n")
        assert (
            "--up must be one of 'auto', 'x', 'y', 'z', '-x', '-y', '-z', not 'w'"
            in command("view", files / "ball.vtp", "--up", "w")[2]
        )

    def test_shows_arrays_and_deviations_of_triangles(self, command, files, tmp_path):
        ball = sm.sphere(8, radius=BALL).triangulated()
        replace(ball, data={"intensity": ball.vertices[:, 0]}).save(tmp_path / "in.ply")
        of = ("view", tmp_path / "in.ply", "--picture", tmp_path / "out.png")
        for more in (["intensity"], ["mean_curvature"], ["deviation", "--data", files / "ball.stl"]):
            assert command(*of, "--scalars", *more)[0] == 0
            (tmp_path / "out.png").unlink()

    def test_beside_its_data(self, command, files, tmp_path):
        code, _, err = command(
            "view", files / "ball.vtp", "--data", files / "ball.xyz", "--scalars", "distance",
            "--view", "-xz", "--picture", tmp_path / "both.png",
        )  # fmt: skip
        assert (code, err) == (0, "")

    def test_opens_a_window_where_there_is_a_display(self, command, files, monkeypatch):
        class Window:
            window_size = [1200, 900]

            @property
            def render_window(self):
                return self

            def GetScreenSize(self):
                return 800, 600

            def show(self, title):
                shown.append((title, *self.window_size))

        shown = []
        monkeypatch.setattr("simplexmesh.plot.has_display", lambda: True)
        monkeypatch.setattr("simplexmesh.plot.surface", lambda *_, **__: Window())
        monkeypatch.setattr("simplexmesh.plot.looked_at", lambda plotter, camera: plotter)
        assert command("view", files / "ball.vtp")[0] == 0
        assert shown == [("simplexmesh: ball.vtp", 680, 510)]
        assert view.EXAMPLE
