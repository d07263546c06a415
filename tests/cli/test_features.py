"""`simplexmesh features`: files, table, JSON and picture of sharp edges and zones, and one sentence on bad input."""

from __future__ import annotations

import json
import os
import signal

import numpy as np
import pytest
import pyvista as pv

import simplexmesh as sm
from simplexmesh.cli.report import ROWS
from simplexmesh.surface.features.exporting import KINDS
from tests.nightly.marks import nightly
from tests.plot.test_features import slab

CUBE = sm.divided(pv.Cube().triangulate().clean(), 0.1)
CAN = sm.divided(pv.Cylinder(resolution=60, radius=0.5, height=2.0).triangulate().clean(), 0.1)

COMMAND = "features"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Small inputs, good and bad, by name."""
    folder = tmp_path_factory.mktemp("inputs")
    CUBE.with_data(number=np.arange(CUBE.n_vertices)).save(folder / "cube.vtp")
    CUBE.save(folder / "cube_0.stl")
    CAN.save(folder / "can.stl")
    sm.sphere(8).save(folder / "ball.vtp")
    sm.PointCloud(CUBE.vertices).save(folder / "points.xyz")
    rows = [sm.TriangleMesh(CUBE.vertices + np.array([0, 0, 2.0 * k]), CUBE.faces) for k in range(6)]
    sm.TriangleMesh(
        np.vstack([each.vertices for each in rows]),
        np.vstack([each.faces + k * CUBE.n_vertices for k, each in enumerate(rows)]),
    ).save(folder / "row.ply")
    (folder / "page.off").write_text("OFF\n5 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 -1\n3 0 1 2\n3 0 1 3\n3 0 1 4\n")
    (folder / "nan.off").write_text("OFF\n4 1 0\n0 0 0\n1 0 nan\n0 1 0\n0 0 1\n3 0 1 2\n")
    (folder / "noise.off").write_bytes(bytes(range(256)) * 4)
    return folder


class TestFile:
    def test_has_zones_and_typed_lines(self, command, files, tmp_path):
        code, out, err = command(files / "cube.vtp", "-o", tmp_path / "out.vtp")
        written = pv.read(tmp_path / "out.vtp")
        told = " ".join(out.split())
        assert (code, err) == (0, "")
        assert "lines 12, length 12, 8 nodes" in told
        assert "zones 6 kind rms area triangles 0 plane 0 1 " in told
        is_line = written["line"] >= 0
        assert (is_line.sum(), written.n_lines) == (12, 12)
        assert (written["zone"][is_line] == -1).all()
        assert np.bincount(written["zone"][~is_line]).tolist() == [CUBE.n_faces // 6] * 6
        assert [KINDS[k] for k in written["kind"][is_line]] == ["C0"] * 12
        assert (written["kind"][~is_line] == -1).all()
        assert (written["zones"][is_line, 0] != written["zones"][is_line, 1]).all()
        assert written.field_data["kinds"].tolist() == list(KINDS)
        number = written["number"][: CUBE.n_vertices]
        np.testing.assert_array_equal(number, np.arange(CUBE.n_vertices))

    def test_has_lines_where_the_edges_are(self, command, files, tmp_path):
        command(files / "can.stl", "-o", tmp_path / "out.vtp")
        written = pv.read(tmp_path / "out.vtp")
        for k in range(written.n_lines):
            points = written.get_cell(k).points
            assert np.abs(points[:, 0]) == pytest.approx(1.0)
            assert np.linalg.norm(points[:, 1:], axis=1) == pytest.approx(0.5, rel=0.01)
            np.testing.assert_array_equal(points[0], points[-1])

    def test_of_json_has_everything(self, command, files, tmp_path):
        code, _, err = command(files / "can.stl", "-o", tmp_path / "out.json")
        found = json.loads((tmp_path / "out.json").read_text())
        assert (code, err) == (0, "")
        assert found.keys() == {"nodes", "lines", "zones", "boundaries", "labels"}
        assert [line["closed"] for line in found["lines"]] == [True, True]
        assert [zone["kind"] for zone in found["zones"]] == ["cylinder", "plane", "plane"]
        assert sorted(line["zones"] for line in found["boundaries"]) == [[0, 1], [0, 2]]

    def test_of_stl_is_one_for_each_zone(self, command, files, tmp_path):
        code, _, err = command(files / "cube.vtp", "-o", tmp_path / "out.stl")
        assert code == 0
        assert sorted(path.name for path in tmp_path.iterdir()) == [f"out_{k}.stl" for k in range(6)]
        assert "note: zones were written to out_0.stl and so on, 6 in all\n" in err
        assert sm.read_triangles(tmp_path / "out_3.stl").area == pytest.approx(1.0)

    def test_is_replaced_with_a_note(self, command, files, tmp_path):
        (tmp_path / "out.vtp").write_text("old")
        _, _, err = command(files / "cube.vtp", "-o", tmp_path / "out.vtp")
        assert err == f"note: the file {tmp_path / 'out.vtp'} was replaced\n"

    def test_is_not_needed(self, command, files, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        assert command(files / "ball.vtp")[0] == 0
        assert list(tmp_path.iterdir()) == []


class TestReport:
    def test_as_json(self, command, files, tmp_path):
        code, out, err = command(files / "can.stl", "-o", tmp_path / "out.vtp", "--json")
        facts = json.loads(out)
        assert (code, err) == (0, "")
        names = ("vertices", "triangles", "lines", "nodes", "length", "noise", "zones", "seconds", "output", "notes")
        assert facts.keys() == {*names}
        assert (facts["lines"], facts["nodes"], facts["output"]) == (2, 0, str(tmp_path / "out.vtp"))
        assert facts["length"] == pytest.approx(2 * np.pi, rel=0.01)
        assert facts["zones"][0].keys() == {"kind", "rms", "area", "triangles"}
        assert sum(zone["triangles"] for zone in facts["zones"]) == facts["triangles"] == CAN.n_faces
        assert sum(zone["area"] for zone in facts["zones"]) == pytest.approx(CAN.area)

    def test_of_a_smooth_model_has_one_zone(self, command, files):
        _, out, _ = command(files / "ball.vtp", "--json")
        facts = json.loads(out)
        assert (facts["lines"], [zone["kind"] for zone in facts["zones"]]) == (0, ["sphere"])

    def test_of_many_zones_shows_the_largest(self, command, files):
        out = command(files / "row.ply")[1]
        assert f"and {36 - ROWS} smaller ones" in out
        assert len(out.splitlines()) < ROWS + 10

    def test_angles_are_in_degrees(self, command, files):
        counts = [json.loads(command(files / "can.stl", "--angle", a, "--json")[1])["lines"] for a in (60, 100)]
        assert counts == [2, 0]

    @pytest.mark.filterwarnings("ignore::RuntimeWarning")
    def test_a_tolerance_divides_what_bends_differently(self, command, tmp_path):
        slab().save(tmp_path / "slab.ply")
        kinds = [
            [zone["kind"] for zone in json.loads(command(tmp_path / "slab.ply", "--json", *more)[1])["zones"]]
            for more in ([], ["--tolerance", 1.5])
        ]
        assert len(kinds[0]) == 1
        assert sorted(kinds[1]) == ["cylinder", "cylinder", "plane", "plane"]

    def test_a_picture_is_written(self, command, files, tmp_path):
        code, _, _ = command(files / "cube.vtp", "--picture", tmp_path / "cube.png", "--up", "y")
        assert code == 0
        assert (tmp_path / "cube.png").read_bytes().startswith(b"\x89PNG")


class TestBadInput:
    """One sentence that names the argument or the file, code 2, nothing on the output, nothing written."""

    @pytest.mark.parametrize(
        ("name", "options", "words"),
        [
            ("nowhere.off", [], ["nowhere.off"]),
            ("noise.off", [], ["noise.off"]),
            ("nan.off", [], ["finite"]),
            ("page.off", [], ["page.off: ", "triangles"]),
            ("points.xyz", [], ["INPUT must hold triangles or a model, points.xyz holds a PointCloud"]),
            ("cube.vtp", ["--angle", 0], ["--angle must lie between 0 and 180 degrees, not 0"]),
            ("cube.vtp", ["--angle", 200], ["--angle must lie between 0 and 180 degrees, not 200"]),
            ("cube.vtp", ["--angle", "nan"], ["--angle must lie between 0 and 180 degrees, not nan"]),
            ("cube.vtp", ["--angle", "steep"], ["--angle must be a number, not 'steep'"]),
            ("cube.vtp", ["--tolerance", 0], ["tolerance must be above 0, not 0"]),
            ("cube.vtp", ["--tolerance", "nan"], ["tolerance must be finite, not nan"]),
            ("cube.vtp", ["--view", "up"], ["--view", "'up'"]),
            ("cube.vtp", ["--view", "xz"], ["--view needs --picture"]),
            ("cube.vtp", ["--picture", "a.doc"], ["--picture must end with one of"]),
        ],
    )
    @pytest.mark.parametrize("ending", [".vtp", *nightly(".stl")])
    def test_is_told_in_one_sentence(self, refused, files, tmp_path, name, options, words, ending):
        err = refused(files / name, *options, "-o", tmp_path / f"out{ending}")
        assert all(word in err for word in words)
        assert list(tmp_path.iterdir()) == []

    def test_numbered_files_of_zones_do_not_overwrite_the_input(self, refused, files):
        before = (files / "cube_0.stl").read_bytes()
        assert "the input" in refused(files / "cube_0.stl", "-o", files / "cube.stl")
        assert (files / "cube_0.stl").read_bytes() == before


@pytest.mark.parametrize("during", ["feature_lines.feature_lines", "zones.zones"])
def test_an_interrupt_leaves_nothing_behind(command, files, tmp_path, monkeypatch, during):
    work = {"feature_lines": sm.feature_lines, "zones": sm.zones}[during.rpartition(".")[2]]

    def interrupted(*args, **options):
        os.kill(os.getpid(), signal.SIGINT)
        return work(*args, **options)

    monkeypatch.setattr(f"simplexmesh.surface.features.{during}", interrupted)
    code, out, err = command(files / "cube.vtp", "-o", tmp_path / "b.vtp", "--picture", tmp_path / "b.png")
    assert (code, out) == (130, "")
    assert err.endswith("error: interrupted; nothing was written\n")
    assert list(tmp_path.iterdir()) == []


def test_an_interrupt_while_writing_keeps_the_file_and_says_so(command, files, tmp_path, monkeypatch):
    save = sm.Zones.save

    def interrupted(*args, **options):
        os.kill(os.getpid(), signal.SIGINT)
        return save(*args, **options)

    monkeypatch.setattr(sm.Zones, "save", interrupted)
    path, picture = tmp_path / "b.vtp", tmp_path / "b.png"
    code, _, err = command(files / "cube.vtp", "-o", path, "--picture", picture)
    assert code == 130
    assert f"note: interrupted; {path} was written, {picture} was not\n" in err
    assert [each.name for each in tmp_path.iterdir()] == ["b.vtp"]
