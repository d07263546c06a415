"""`simplexmesh decimate`: fewer vertices from models and triangles, and one sentence on bad input."""

from __future__ import annotations

import json
import os
import signal

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.data.io.writing import to_pyvista, write

BALL, RING = sm.sphere(8, radius=5.0), sm.torus(30, 14, radius=4.0, tube_radius=1.5)

COMMAND = "decimate"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Small inputs, good and bad, by name."""
    folder = tmp_path_factory.mktemp("inputs")
    BALL.with_data(number=np.arange(BALL.n_vertices)).save(folder / "ball.vtp")
    sm.plane(12, 12).save(folder / "sheet.vtp")
    for suffix in ("stl", "obj", "off", "ply"):
        write(folder / f"ring.{suffix}", RING.triangulated("dual"))
    to_pyvista(RING.triangulated("dual")).save(folder / "ring.vtk")
    write(folder / "ball.xyz", sm.PointCloud(BALL.vertices))
    (folder / "noise.vtp").write_bytes(bytes(range(256)) * 4)
    (folder / "page.off").write_text("OFF\n5 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 -1\n3 0 1 2\n3 0 1 3\n3 0 1 4\n")
    return folder


class TestModel:
    def test_has_the_number_asked_for_and_lies_on_the_old_one(self, command, files, tmp_path):
        code, out, err = command(files / "ball.vtp", "--vertices", 300, "-o", tmp_path / "small.vtp")
        small = sm.read_mesh(tmp_path / "small.vtp")
        assert (code, err) == (0, "")  # not a word on what it was made of
        assert (small.n_vertices, small.genus, small.n_holes) == (300, 0, 0)
        assert small.check(self_intersections=True).ok
        assert sm.read(tmp_path / "small.vtp").volume == pytest.approx(BALL.volume, rel=0.02)
        told = " ".join(out.split())
        assert "before 1,280 vertices, 642 faces" in told
        assert "mesh 300 vertices, 152 faces, genus 0, 0 holes" in told
        assert "problems none" in told

    def test_keeps_holes_and_data(self, command, files, tmp_path):
        assert command(files / "sheet.vtp", "--vertices", 100, "-o", tmp_path / "small.vtp")[0] == 0
        assert sm.read_mesh(tmp_path / "small.vtp").n_holes == 1
        assert command(files / "ball.vtp", "--vertices", 100, "-o", tmp_path / "small.vtp")[0] == 0
        assert sm.read_mesh(tmp_path / "small.vtp").data["number"].shape == (100,)

    def test_is_within_the_tolerance(self, command, files, tmp_path):
        sizes = []
        for tolerance in (0.05, 0.2):
            code, out, _ = command(files / "ball.vtp", "--tolerance", tolerance, "-o", tmp_path / "small.vtp", "--json")
            facts = json.loads(out)
            assert code == 0
            assert 0 < facts["rms"] < facts["largest"] <= tolerance
            sizes.append(facts["vertices"])
        assert BALL.n_vertices > sizes[0] > sizes[1]

    def test_says_when_the_tolerance_lets_nothing_go(self, command, files, tmp_path):
        code, _, err = command(files / "ball.vtp", "--tolerance", 1e-9, "-o", tmp_path / "same.vtp")
        assert (code, err) == (
            0,
            "note: no vertex could be removed within a tolerance of 1e-09: the mesh is unchanged\n",
        )
        assert np.array_equal(sm.read_mesh(tmp_path / "same.vtp").vertices, BALL.vertices)

    def test_json_tells_all_there_is_to_know(self, command, files, tmp_path):
        path = tmp_path / "small.vtp"
        _, out, err = command(files / "ball.vtp", "--vertices", 300, "-o", path, "--json")
        facts = json.loads(out)
        small = sm.read_mesh(path)
        sizes = small.connectivity.face_sizes
        assert err == ""
        assert facts["before"] == {
            "vertices": BALL.n_vertices,
            "faces": BALL.n_faces,
            "genus": 0,
            "holes": 0,
            "components": 1,
            "area": pytest.approx(BALL.area),
            "volume": pytest.approx(BALL.volume),
        }
        assert (facts["vertices"], facts["faces"], facts["genus"], facts["holes"]) == (300, 152, 0, 0)
        assert facts["components"] == 1
        assert (facts["area"], facts["volume"]) == pytest.approx((small.area, small.volume))
        ends = small.vertices[small.connectivity.edge_vertices]
        assert facts["mean_edge"] == pytest.approx(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).mean())
        assert facts["diagonal"] == pytest.approx(np.linalg.norm(np.ptp(BALL.bounds, axis=0)))
        assert facts["exceptions"] == ((sizes < 5) | (sizes > 7)).sum()
        assert 0 < facts["rms"] <= facts["largest"] < 0.2
        assert (facts["problems"], facts["notes"]) == ([], [])
        assert facts["output"] == str(path)
        assert facts["seconds"] > 0

    def test_says_what_is_wrong_with_it(self, command, files, tmp_path):
        vertices = BALL.vertices.copy()
        vertices[0] *= -1.5
        bad = BALL.moved(vertices)
        bad.save(tmp_path / "bad.vtp")
        arguments = (tmp_path / "bad.vtp", "--vertices", BALL.n_vertices, "-o", tmp_path / "same.vtp")
        code, out, err = command(*arguments)
        problems = bad.check(self_intersections=True).problems
        assert (code, len(problems) > 0) == (0, True)
        assert all(f"note: the model has a defect: {problem}" in err for problem in problems)
        assert f"note: so had the input: {'; '.join(problems)}\n" in err
        code, out, err = command(*arguments, "--json")
        assert json.loads(out)["problems"] == list(problems)
        assert f"note: the model {tmp_path / 'same.vtp'} was replaced" in err


class TestTriangles:
    @pytest.mark.parametrize("suffix", ["stl", "obj", "off", "ply", "vtk"])
    def test_are_decimated_by_their_dual(self, command, files, tmp_path, suffix):
        code, out, err = command(files / f"ring.{suffix}", "--vertices", 200, "-o", tmp_path / "ring.vtp", "--json")
        facts = json.loads(out)
        count = len(RING.triangulated("dual").faces)
        assert (code, facts["vertices"], facts["genus"]) == (0, 200, 1)
        assert facts["before"]["vertices"] == count == RING.n_vertices
        said = f"ring.{suffix} holds {count} triangles; their dual, {count} vertices, is decimated"
        assert err == f"note: {said}\n"
        assert facts["notes"] == [said]
        assert sm.read_mesh(tmp_path / "ring.vtp").n_vertices == 200

    @pytest.mark.parametrize("suffix", ["ply", "obj", "off", "stl"])
    def test_are_written_too(self, command, files, tmp_path, suffix):
        code, _, _ = command(files / "ring.stl", "--vertices", 200, "-o", tmp_path / f"ring.{suffix}")
        assert code == 0
        assert sm.read_triangles(tmp_path / f"ring.{suffix}").is_closed


class TestBadInput:
    """One sentence that names the argument or the file, code 2, nothing on the output, nothing written."""

    @pytest.mark.parametrize(
        ("name", "options", "words"),
        [
            ("nowhere.vtp", ["--vertices", 100], ["nowhere.vtp"]),
            ("noise.vtp", ["--vertices", 100], ["noise.vtp"]),
            ("ball.xyz", ["--vertices", 100], ["INPUT must hold a model or triangles", "ball.xyz holds a PointCloud"]),
            ("page.off", ["--vertices", 100], ["page.off: at most two triangles may share an edge"]),
            ("ball.vtp", ["--vertices", 101], ["vertices must be even", "101"]),
            ("ball.vtp", ["--vertices", 2], ["vertices must be at least 4", "genus 0", "2"]),
            ("ring.stl", ["--vertices", 12], ["vertices must be at least 14", "genus 1", "12"]),
            ("ball.vtp", ["--vertices", 2000], ["vertices must be at most 1280", "2000"]),
            ("ball.vtp", ["--vertices", 0], ["vertices must be at least", "0"]),
            ("ball.vtp", ["--vertices", "few"], ["--vertices must be a whole number, not 'few'"]),
            ("ball.vtp", ["--tolerance", 0], ["tolerance must be above 0, not 0"]),
            ("ball.vtp", ["--tolerance", -1], ["tolerance must be above 0, not -1"]),
            ("ball.vtp", ["--tolerance", "nan"], ["tolerance must be finite, not nan"]),
            ("ball.vtp", [], ["give --vertices or --tolerance"]),
            ("ball.vtp", ["--vertices", 100, "--tolerance", 1], ["give --vertices or --tolerance, not both"]),
        ],
    )
    @pytest.mark.filterwarnings("ignore::simplexmesh.SimplexMeshWarning")
    def test_is_told_in_one_sentence(self, refused, files, tmp_path, name, options, words):
        err = refused(files / name, *options, "-o", tmp_path / "out.vtp")
        assert all(word in err for word in words)
        assert list(tmp_path.iterdir()) == []

    def test_the_output_must_be_named(self, refused, files):
        assert "--output" in refused(files / "ball.vtp", "--vertices", 100)


@pytest.mark.parametrize("wanted", [[], ["--json"]])
@pytest.mark.parametrize("during", ["simplexmesh.data.decimate.decimate", "simplexmesh.SimplexMesh.check"])
def test_an_interrupt_leaves_nothing_behind(command, files, tmp_path, monkeypatch, during, wanted):
    work = {"decimate": sm.decimate, "check": sm.SimplexMesh.check}[during.rpartition(".")[2]]

    def interrupted(*args, **options):
        os.kill(os.getpid(), signal.SIGINT)
        return work(*args, **options)

    monkeypatch.setattr(during, interrupted)
    code, out, err = command(files / "ball.vtp", "--vertices", 300, "-o", tmp_path / "b.vtp", *wanted)
    assert (code, err) == (130, "error: interrupted; nothing was written\n")
    assert (json.loads(out) if wanted else out) == ({"error": "interrupted; nothing was written"} if wanted else "")
    assert list(tmp_path.iterdir()) == []
