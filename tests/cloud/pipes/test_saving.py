"""Files of lines and plants: complete, plain, and as they were if something fails."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

import simplexmesh as sm
from tests.cloud.plants import line, plant


class TestJson:
    def test_has_all_that_is_known(self, tmp_path):
        found = plant()
        found.save(tmp_path / "out.json")
        told = json.loads((tmp_path / "out.json").read_text())
        assert told == json.loads(json.dumps(found.as_dict()).replace("NaN", "null"))
        assert told["unit"] == "m"
        assert told["lines"][0]["stops"] == ["end", "end"]
        assert told["lines"][0]["length"] == found.lines[0].length
        elements = told["lines"][0]["elements"] + told["tees"]
        for given, element in zip(elements, found.elements, strict=True):
            for name in ("kind", "radius", "end_radius", "bend_radius", "bend_angle", "length"):
                assert given[name] == getattr(element, name)
            for name in ("start", "end"):
                np.testing.assert_array_equal(given[name], getattr(element, name))
            assert given["primitive"]["kind"] == element.primitive.kind
            np.testing.assert_array_equal(given["primitive"]["axis"], element.primitive.axis)

    def test_numbers_that_are_none_are_null(self, tmp_path):
        line().save(tmp_path / "out.json")  # no point is on an element: their distances are NaN
        told = json.loads((tmp_path / "out.json").read_text(), parse_constant=pytest.fail)
        assert told["lines"][0]["elements"][0]["rms"] is None


class TestTable:
    def test_has_lines_and_tees(self, tmp_path):
        found = plant()
        found.save(tmp_path / "out.csv")
        rows = list(csv.DictReader((tmp_path / "out.csv").read_text().splitlines()))
        assert [(row["line"], row["kind"]) for row in rows[-2:]] == [("1", "straight"), ("", "tee")]
        for row, element in zip(rows, found.elements, strict=True):
            assert float(row["diameter"]) == pytest.approx(2 * element.radius, rel=1e-8)
            assert float(row["end_diameter"]) == pytest.approx(2 * element.end_radius, rel=1e-8)
            assert float(row["length"]) == pytest.approx(element.length, rel=1e-8)
            if element.kind == "bend":
                assert float(row["bend_radius"]) == pytest.approx(element.bend_radius, rel=1e-8)
                assert float(row["bend_angle_degrees"]) == pytest.approx(np.degrees(element.bend_angle), rel=1e-8)


def test_offsets_of_eccentric_reducers_are_told(tmp_path):
    found = line(offset=0.05)
    for ending in ("json", "csv"):
        found.save(tmp_path / f"out.{ending}")
    told = json.loads((tmp_path / "out.json").read_text())["lines"][0]["elements"]
    rows = list(csv.DictReader((tmp_path / "out.csv").read_text().splitlines()))
    assert [each["kind"] for each in told if each["offset"]] == ["reducer"]
    for given, row in zip(told, rows, strict=True):
        assert given["offset"] == pytest.approx(float(row["offset"] or 0), abs=1e-9)
        assert row["offset_deviation"] == ("" if given["kind"] != "reducer" else "1")
    assert told[3]["offset"] == pytest.approx(0.05, rel=1e-3)
    assert told[3]["primitive"]["kind"] == "oblique cone"


@pytest.mark.parametrize("unit", ["mm", None])
@pytest.mark.parametrize("found", [plant(), line()], ids=["plant", "line"])
def test_files_of_meshes_have_the_tubes_in_their_unit(tmp_path, found, unit):
    bounds = found.triangulated().bounds
    for name, scale in (("out.vtp", 1), ("out.ply", 1), ("out.glb", 1 / 1000 if unit else 1)):
        replace(found, unit=unit).save(tmp_path / name)
        np.testing.assert_allclose(sm.read(tmp_path / name).bounds, scale * bounds, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("ending", [".json", ".csv"])
def test_a_file_that_cannot_be_replaced_is_as_it_was(tmp_path, ending, monkeypatch):
    path = tmp_path / f"out{ending}"
    path.write_text("before")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        plant().save(path)
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert path.read_text() == "before"


@pytest.mark.parametrize("found", [plant(), line()], ids=["plant", "line"])
def test_other_endings_and_folders_are_refused(tmp_path, found):
    with pytest.raises(ValueError, match=r"^path must end in one of .json, .csv, .step, .stp, .vtp, .*not 'out.txt'$"):
        found.save(tmp_path / "out.txt")
    with pytest.raises(FileNotFoundError, match=r"^path must be in an existing folder"):
        found.save(tmp_path / "none" / "out.json")
    assert not list(tmp_path.iterdir())
