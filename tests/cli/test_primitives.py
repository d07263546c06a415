"""`simplexmesh primitives` and `simplexmesh pipes`: files, tables, JSON, pictures, and one sentence on bad input."""

from __future__ import annotations

import csv
import json

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
    sm.PointCloud(pipe_on_a_floor()).save(path)
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
        assert pv.read(files[1]).n_cells > 100
        assert files[2].stat().st_size > 5000

    def test_tells_json(self, command, scan):
        code, out, _ = command("primitives", scan, "--kinds", "plane", "--json")
        told = json.loads(out)
        assert code == 0
        assert {each["kind"] for each in told["primitives"]} == {"plane"}
        assert told["primitives"][0]["normal"][2] ** 2 == pytest.approx(1, abs=1e-4)


class TestPipes:
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
    ],
)
def test_what_is_wrong_is_one_sentence(command, scan, words, said):
    code, out, err = command(*(scan if word == "SCAN" else word for word in words))
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert said in err
