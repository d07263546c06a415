"""`simplexmesh curvature`: what the file, the table and the picture say, and one sentence on bad input."""

from __future__ import annotations

import json
import os
import signal

import numpy as np
import pytest
import pyvista as pv

import simplexmesh as sm
from simplexmesh.cli.curvature import _rows
from simplexmesh.data.io.writing import write
from tests.nightly.marks import nightly

EGG = sm.ellipsoid((3, 2, 1), 10).triangulated("dual")
NAMES = {"k1", "k2", "mean", "gauss", "d1", "d2", "normals", "failed", "saliency", "hk_class"}

COMMAND = "curvature"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Small inputs, good and bad, by name."""
    folder = tmp_path_factory.mktemp("inputs")
    write(folder / "egg.off", EGG)
    sm.ellipsoid((3, 2, 1), 8).save(folder / "model.vtp")
    write(folder / "points.xyz", sm.PointCloud(EGG.vertices, EGG.vertex_normals))
    n = EGG.n_vertices
    spare = [[9.0, 9, 9], [9, 9, 8], [9, 8, 9]]
    write(folder / "spare.off", sm.TriangleMesh(np.vstack([EGG.vertices, spare]), [*EGG.faces, [n, n + 1, n + 2]]))
    (folder / "noise.off").write_bytes(bytes(range(256)) * 4)
    (folder / "empty.off").write_text("OFF\n4 0 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n")
    (folder / "nan.off").write_text("OFF\n4 1 0\n0 0 0\n1 0 nan\n0 1 0\n0 0 1\n3 0 1 2\n")
    pv.ImageData(dimensions=(4, 4, 4)).save(folder / "volume.vti")
    image = pv.ImageData(dimensions=(4, 4, 4))
    image["values"] = np.arange(64.0)
    image.save(folder / "volume.vti")
    return folder


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """The egg with its faces looking inward, half of it, and its points with normals that look inward."""
    folder = tmp_path_factory.mktemp("turned")
    inward = EGG.faces[:, ::-1]
    write(folder / "egg.off", sm.TriangleMesh(EGG.vertices, inward))
    half = inward[(EGG.vertices[inward, 2] > -0.2).all(axis=1)]
    used, faces = np.unique(half, return_inverse=True)
    write(folder / "half.off", sm.TriangleMesh(EGG.vertices[used], faces.reshape(half.shape)))
    write(folder / "points.xyz", sm.PointCloud(EGG.vertices, -EGG.vertex_normals))
    return folder


class TestFile:
    def test_has_what_the_functions_return(self, command, files, tmp_path):
        path = tmp_path / "egg.vtp"
        code, out, err = command(files / "egg.off", "--method", "sine", "--rings", 2, "-o", path)
        found = sm.curvature(EGG, "sine", neighborhood=sm.rings(2))
        written = pv.read(path)
        assert (code, err) == (0, "")
        assert set(written.point_data.keys()) == NAMES
        np.testing.assert_array_equal(written.points, EGG.vertices)
        np.testing.assert_array_equal(written.regular_faces, EGG.faces)
        for name in ("k1", "k2", "mean", "gauss", "d1", "d2", "normals"):
            np.testing.assert_allclose(written[name], getattr(found, name), rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(written["saliency"], sm.saliency(EGG, curvature=found), atol=1e-9)
        np.testing.assert_array_equal(written["hk_class"], sm.hk_classes(EGG, curvature=found).labels)
        assert not written["failed"].any()
        assert f"{EGG.n_vertices:,} vertices, {EGG.n_faces:,} faces" in out
        assert "peak" in out

    @pytest.mark.parametrize("name", ["model.vtp", "points.xyz"])
    def test_of_models_and_points(self, command, files, tmp_path, name):
        code, out, _ = command(files / name, "--method", "sine", "--nearest", 12, "--json", "-o", tmp_path / "out.vtp")
        facts = json.loads(out)
        written = pv.read(tmp_path / "out.vtp")
        assert code == 0
        assert facts["vertices"] == written.n_points
        assert set(written.point_data.keys()) >= NAMES - {"normals"}
        if name == "model.vtp":
            assert set(sm.read_mesh(tmp_path / "out.vtp").data) == NAMES

    def test_says_where_there_is_no_estimate(self, command, files, tmp_path):
        code, out, err = command(files / "spare.off", "--method", "sine", "--json", "-o", tmp_path / "out.vtp")
        written = pv.read(tmp_path / "out.vtp")
        facts = json.loads(out)
        assert code == 0
        assert facts["failed"] == 3
        assert "curvature could not be estimated at 3 of" in err
        assert facts["notes"]
        assert written["failed"].tolist() == [0] * EGG.n_vertices + [1] * 3
        assert np.isnan(written["mean"][-1])

    def test_without_one_there_is_only_the_report(self, command, files, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        assert command(files / "egg.off", "--method", "sine")[0] == 0
        assert list(tmp_path.iterdir()) == []

    def test_the_default_method_needs_no_options(self, command, files):
        code, out, _ = command(files / "egg.off", "--json")
        facts = json.loads(out)
        assert code == 0
        assert facts["mean"]["median"] == pytest.approx(0.5, rel=0.3)

    def test_an_older_one_is_replaced_with_a_note(self, command, files, tmp_path):
        (tmp_path / "egg.vtp").write_text("old")
        _, _, err = command(files / "egg.off", "--method", "sine", "-o", tmp_path / "egg.vtp")
        assert err == f"note: the surface {tmp_path / 'egg.vtp'} was replaced\n"


class TestWhichSideIsOutside:
    @pytest.mark.parametrize("name", ["egg.off", "half.off", "points.xyz"])
    def test_can_be_reversed(self, command, turned, name):
        as_it_is, flipped = (
            json.loads(command(turned / name, "--method", "sine", "--json", *more)[1]) for more in ([], ["--flip"])
        )
        assert as_it_is["mean"]["median"] < 0 < flipped["mean"]["median"]
        assert as_it_is["mean"]["median"] == pytest.approx(-flipped["mean"]["median"], rel=1e-6)

    @pytest.mark.parametrize("name", ["egg.off", "half.off"])
    def test_a_note_where_faces_point_inward(self, command, turned, name):
        said = "the faces are oriented inward, so that a bump has negative curvature: reverse them with "
        said += "TriangleMesh(vertices, faces[:, ::-1]), or with --flip of the command"
        assert command(turned / name, "--method", "sine")[2] == f"note: {said}\n"
        with pytest.warns(sm.SimplexMeshWarning) as caught:
            assert np.median(sm.curvature(turned / name).mean) < 0
        assert [str(each.message) for each in caught] == [said]
        assert command(turned / name, "--method", "sine", "--flip")[2] == ""

    def test_no_note_for_a_sheet_that_bends_both_ways(self, command, tmp_path):
        x, y = np.meshgrid(np.linspace(-1, 1, 15), np.linspace(-1, 1, 15))
        sheet = pv.StructuredGrid(x, y, 0.1 * (x**2 - y**2) - 0.02 * x**2).extract_surface(algorithm="dataset_surface")
        sheet.triangulate().save(tmp_path / "sheet.ply")
        assert command(tmp_path / "sheet.ply", "--method", "sine")[2] == ""

    def test_without_faces_nothing_can_be_reversed(self, refused, files):
        err = refused(files / "model.vtp", "--flip")
        assert err == "error: --flip reverses triangles and the normals of points, INPUT has neither"


class TestReport:
    def test_json_has_everything(self, command, files):
        code, out, err = command(files / "egg.off", "--method", "sine", "--rings", 2, "--json", "--points", 2)
        facts = json.loads(out)
        assert (code, err) == (0, "")
        assert (facts["vertices"], facts["faces"], facts["method"]) == (EGG.n_vertices, EGG.n_faces, "sine")
        assert facts["classes"] == sm.hk_classes(EGG, curvature=self.curved()).counts
        assert facts["mean"]["min"] <= facts["mean"]["p5"] <= facts["mean"]["median"] <= facts["mean"]["max"]
        assert sorted(round(each["point"][0]) for each in facts["salient"]) == [-3, 3]
        assert all(each["persistence"] >= facts["threshold"] for each in facts["salient"])
        assert (facts["failed"], facts["notes"], facts["output"]) == (0, [], None)

    def test_a_model_has_its_number_of_faces(self, command, files):
        _, out, _ = command(files / "model.vtp", "--method", "sine", "--rings", 2, "--json")
        assert json.loads(out)["faces"] == sm.ellipsoid((3, 2, 1), 8).n_faces

    def test_the_table_names_its_numbers(self, command, files):
        _, out, _ = command(files / "egg.off", "--method", "sine", "--rings", 2, "--points", 2, "--unit", "mm")
        lines = out.splitlines()
        head = next(k for k, line in enumerate(lines) if line.startswith("  salient"))
        assert lines[head].split() == ["salient", "x", "y", "z", "mm", "|H|", "1/mm"]
        rows = [[float(x) for x in line.split()] for line in lines[head + 1 : head + 3]]
        found = sm.salient_points(EGG, curvature=self.curved(), count=2)
        assert np.array(rows) == pytest.approx(np.column_stack([found.points, found.values]), rel=1e-3, abs=1e-3)
        ends = {len(line.rstrip()) for line in lines[head + 1 : head + 3]}
        assert len(ends) == 1
        assert any(line.startswith("  mean H") and line.rstrip().endswith("1/mm") for line in lines)
        assert any(line.startswith("  Gauss K") and line.rstrip().endswith("1/mm²") for line in lines)

    def test_the_table_does_not_show_what_rounding_leaves(self):
        spread = {"median": -3.6e-101, "p5": -0.29, "p95": 0.08}
        names = ("mean", "gauss", "saliency")
        facts = {
            "vertices": 8,
            "faces": 12,
            "method": "sine",
            "failed": 0,
            "classes": {},
            "salient": [],
            "seconds": 0.1,
        }
        assert _rows(facts | dict.fromkeys(names, spread), "")["Gauss K"] == "0, 90 % between -0.29 and 0.08"

    def curved(self):
        return sm.curvature(EGG, "sine", neighborhood=sm.rings(2))

    def test_neighborhoods_are_those_asked_for(self, command, files):
        seen = set()
        for option in (["--rings", 1], ["--rings", 3], ["--radius", 0.7], ["--nearest", 20]):
            _, out, _ = command(files / "egg.off", "--method", "sine", *option, "--json")
            seen.add(json.loads(out)["mean"]["p95"])
        assert len(seen) == 4


class TestPicture:
    @pytest.mark.parametrize("show", ["mean", *nightly("gauss", "k1", "saliency", "classes"), "all"])
    def test_is_drawn(self, command, files, tmp_path, show):
        picture = tmp_path / "egg.png"
        code, _, err = command(
            files / "egg.off", "--method", "sine", "--picture", picture, "--show", show, "--unit", "mm"
        )
        assert (code, err) == (0, "")
        assert picture.stat().st_size > 10_000

    def test_has_the_limits_asked_for(self, command, files, tmp_path, monkeypatch):
        seen = {}
        heat = sm.plot.heat
        monkeypatch.setattr("simplexmesh.plot.heat", lambda *a, **k: seen.update(k) or heat(*a, **k))
        arguments = ("--limits", -1, 2, "--up", "y", "--picture", tmp_path / "egg.png", "--unit", "mm")
        assert command(files / "egg.off", "--method", "sine", *arguments)[0] == 0
        assert (seen["limits"], seen["up"], seen["name"]) == ((-1.0, 2.0), "y", "mean curvature (1/mm)")


class TestBadInput:
    """One sentence that names the argument or the file, code 2, nothing on the output, nothing written."""

    @pytest.mark.parametrize(
        ("name", "options", "words"),
        [
            ("nowhere.off", [], ["nowhere.off"]),
            ("noise.off", [], ["noise.off"]),
            ("nan.off", [], ["finite"]),
            ("volume.vti", [], ["INPUT must hold a surface or points, volume.vti holds a volume"]),
            ("egg.off", ["--method", "best"], ["method must be one of", "'sine'", "not 'best'"]),
            ("egg.off", ["--rings", 0], ["rings must be at least 1, not 0"]),
            ("egg.off", ["--radius", -1], ["radius must be above 0, not -1"]),
            ("egg.off", ["--rings", 2, "--radius", 1], ["give one of --rings, --radius and --nearest, not several"]),
            ("egg.off", ["--points", -1], ["--points must be at least 0, not -1"]),
            ("egg.off", ["--show", "heat"], ["--show must be one of 'mean', 'gauss'", "not 'heat'"]),
            ("egg.off", ["--limits", 2, 1, "--picture", "out.png"], ["--limits must increase, not go from 2 to 1"]),
            ("egg.off", ["--limits", 0, "inf", "--picture", "out.png"], ["--limits must be finite, not 0 and inf"]),
            ("egg.off", ["--view", "up"], ["--view must be one of", "not 'up'"]),
            ("egg.off", ["--up", "z"], ["--up needs --picture"]),
            ("egg.off", ["--show", "gauss"], ["--show needs --picture"]),
            ("egg.off", ["--limits", 0, 1], ["--limits need --picture"]),
            (
                "egg.off",
                ["--limits", 0, 1, "--show", "classes", "--picture", "out.png"],
                ["--limits are the ends of one color scale, --show classes has none"],
            ),
            (
                "egg.off",
                ["--limits", 0, 1, "--show", "all", "--picture", "out.png"],
                ["--limits are the ends of one color scale, --show all has several"],
            ),
        ],
    )
    def test_is_one_sentence(self, refused, files, tmp_path, monkeypatch, name, options, words):
        monkeypatch.chdir(tmp_path)
        err = refused(files / name, "--method", "sine", *options)
        assert all(word in err for word in words)
        assert list(tmp_path.iterdir()) == []

    @pytest.mark.parametrize("option", [("--rings", 2), ("--radius", 0.5), ("--nearest", 12)])
    @pytest.mark.parametrize("method", [(), ("--method", "adaptive")])
    def test_neighborhoods_need_a_method_that_takes_them(self, refused, files, option, method):
        err = refused(files / "egg.off", *option, *method)
        wanted = "a --method with a neighborhood, such as sine: adaptive, the default, chooses its own"
        assert err == f"error: {option[0]} needs {wanted}"

    @pytest.mark.parametrize("option", [["-o", "out.stl"], ["--picture", "out.doc"], ["-o", "nowhere/out.vtp"]])
    def test_outputs_are_refused_before_any_work(self, refused, files, monkeypatch, option):
        monkeypatch.setattr("simplexmesh.data.io.reading.read", lambda *_, **__: pytest.fail("too late"))
        err = refused(files / "egg.off", *option)
        assert err.startswith(f"error: {'--picture' if 'doc' in option[1] else '--output'} must ")


def test_an_interrupt_leaves_nothing_behind(command, files, tmp_path, monkeypatch):
    work = sm.saliency

    def interrupted(*args, **options):
        os.kill(os.getpid(), signal.SIGINT)
        return work(*args, **options)

    monkeypatch.setattr("simplexmesh.surface.saliency.saliency.saliency", interrupted)
    code, out, err = command(files / "egg.off", "--method", "sine", "-o", tmp_path / "egg.vtp")
    assert (code, out, err) == (130, "", "error: interrupted; nothing was written\n")
    assert list(tmp_path.iterdir()) == []


def test_an_interrupt_between_the_files_says_which_is_there(command, files, tmp_path, monkeypatch):
    def interrupted(*args, **options):
        write(*args, **options)
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr("simplexmesh.data.io.writing.write", interrupted)
    made, picture = tmp_path / "egg.vtp", tmp_path / "egg.png"
    code, out, err = command(files / "egg.off", "--method", "sine", "-o", made, "--picture", picture)
    assert (code, out, err) == (130, "", f"note: interrupted; {made} was written, {picture} was not\n")
    assert list(tmp_path.iterdir()) == [made]
