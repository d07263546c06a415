"""`simplexmesh primitives` and `simplexmesh pipes`: files, tables, JSON, pictures, and one sentence on bad input."""

from __future__ import annotations

import csv
import json
import sys

import numpy as np
import pytest
import pyvista as pv

import simplexmesh as sm


def pipe_on_a_floor():
    """Points of an upright pipe and a floor."""
    rng = np.random.default_rng(0)
    turn, along = rng.uniform([0, 0.2], [2 * np.pi, 4], (4000, 2)).T
    pipe = np.stack([0.3 * np.cos(turn), 0.3 * np.sin(turn), along], axis=1)
    floor = np.append(rng.uniform(-1.5, 1.5, (4000, 2)), np.zeros((4000, 1)), axis=1)
    return np.concatenate([pipe, floor]) + rng.normal(0, 0.003, (8000, 3))


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    path = tmp_path_factory.mktemp("inputs") / "scan.ply"
    sm.PointCloud(pipe_on_a_floor(), data={"intensity": np.arange(8000, dtype=np.uint16)}).save(path)
    return path


class TestPrimitives:
    def test_writes_parameters_surfaces_and_a_picture(self, command, scan, tmp_path):
        files = [tmp_path / name for name in ("out.json", "out.vtp", "out.png")]
        code, out, _ = command("primitives", scan, "-o", files[0], "--mesh", files[1], "--picture", files[2])
        assert code == 0
        assert "primitives" in out
        assert "radius 0.3" in " ".join(out.split())
        told = json.loads(files[0].read_text())
        assert sorted(each["kind"] for each in told["primitives"]) == ["cylinder", "plane"]
        assert len(told["labels"]) == 8000
        assert set(pv.read(files[1]).cell_data["primitive"]) == {0, 1}
        assert isinstance(sm.read(files[1]), sm.TriangleMesh)
        assert files[2].stat().st_size > 5000

    def test_tells_json(self, command, scan):
        code, out, _ = command("primitives", scan, "--kinds", "plane", "--json")
        told = json.loads(out)
        assert code == 0
        assert {each["kind"] for each in told["primitives"]} == {"plane"}
        assert told["primitives"][0]["normal"][2] ** 2 == pytest.approx(1, abs=1e-4)

    def test_gives_the_points_back_with_labels(self, command, scan, tmp_path):
        out = tmp_path / "out.laz"
        assert command("primitives", scan, "--labeled", out, "--unit", "m", "-o", tmp_path / "out.json")[0] == 0
        cloud, told = sm.read_points(out), json.loads((tmp_path / "out.json").read_text())
        assert cloud.unit == told["unit"] == "m"
        np.testing.assert_array_equal(cloud.data["intensity"], np.arange(8000))
        np.testing.assert_array_equal(cloud.data["label"], told["labels"])
        np.testing.assert_allclose(cloud.points, sm.read_points(scan).points, atol=1e-6)


class TestPipes:
    def test_gives_the_points_back_with_lines_and_elements(self, command, scan, tmp_path):
        assert command("pipes", scan, "--labelled", tmp_path / "out.vtp")[0] == 0
        data = sm.read_points(tmp_path / "out.vtp").data
        assert set(np.unique(data["line"])) == set(np.unique(data["element"])) == {-1, 0}
        np.testing.assert_array_equal(data["line"] < 0, data["element"] < 0)
        assert (data["line"][:4000] == 0).mean() > 0.95
        np.testing.assert_array_equal(data["intensity"], np.arange(8000))

    def test_writes_elements_and_a_bill(self, command, scan, tmp_path):
        code, out, _ = command("pipes", scan, "-o", tmp_path / "out.json", "--table", tmp_path / "out.csv")
        assert code == 0
        assert "straight" in out
        (line,) = json.loads((tmp_path / "out.json").read_text())["lines"]
        assert line["elements"][0]["radius"] == pytest.approx(0.3, abs=0.002)
        (row,) = csv.DictReader((tmp_path / "out.csv").read_text().splitlines())
        assert float(row["diameter"]) == pytest.approx(0.6, abs=0.004)

    def test_follows_a_pick(self, command, scan):
        code, out, _ = command("pipes", scan, "--pick", "0.3,0,2", "--json")
        assert code == 0
        assert json.loads(out)["lines"][0]["elements"][0]["kind"] == "straight"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["primitives", "SCAN", "--kinds", "prism"], "prism"),
        (["primitives", "SCAN", "--noise", "-1"], "noise"),
        (["primitives", "SCAN", "-o", "out.txt"], "--output must end with"),
        (["pipes", "SCAN", "--pick", "1,2"], "--pick must be three numbers"),
        (["pipes", "SCAN", "--pick", "9,9,9"], "pick"),
        (["pipes", "SCAN", "--table", "out.txt"], "--table must end with"),
        (["pipes", "none.ply"], "does not exist"),
        (["pipes", "SCAN", "--unit", "furlong"], "unit"),
        (["pipes", "SCAN", "--step", "out.txt"], "--step must end with"),
        (["pipes", "SCAN", "--labeled", "out.json"], "--labeled must end with"),
        (
            ["primitives", "SCAN", "--mesh", "out.ply", "--labeled", "out.ply"],
            "--mesh and --labeled must be different",
        ),
    ],
)
def test_what_is_wrong_is_one_sentence(refused, scan, words, said):
    assert said in refused(*(scan if word == "SCAN" else word for word in words))


def test_a_unit_that_contradicts_the_file_is_refused(command, tmp_path):
    sm.PointCloud(pipe_on_a_floor(), unit="mm").save(tmp_path / "scan.ply")
    code, _, err = command("pipes", tmp_path / "scan.ply", "--unit", "m")
    assert code == 2
    assert err == "error: --unit must be mm, as scan.ply says, or left out, not m\n"


def test_a_missing_library_is_told_before_any_work(refused, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "OCP", None)
    monkeypatch.setitem(sys.modules, "OCP.gp", None)
    (tmp_path / "scan.ply").write_text("not read")
    err = refused("pipes", tmp_path / "scan.ply", "--step", tmp_path / "out.step")
    assert err == "error: this needs the extra step: pip install 'simplexmesh[step]'"
