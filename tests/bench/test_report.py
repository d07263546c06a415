"""The report: its page and tables, and a folder that is written whole or not at all."""

from __future__ import annotations

import csv
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from simplexmesh.bench import page, report, run, tables
from simplexmesh.bench.__main__ import main


def test_the_page_shows_the_curves_in_which_methods_differ():
    curves = {f"pointwise_H_{name}_6": f"error on the {name}" for name in ("plane", "cubic")}
    linked, shown = page._images(curves, "pointwise_")
    assert linked == "[error on the plane](pointwise_H_plane_6.png)"
    assert shown == "![error on the cubic](pointwise_H_cubic_6.png)"
    assert page._images(curves, "map_") == []


class TestTables:
    def test_csv_can_be_read_again(self):
        rows = [{"method": "a, b", "error": 0.1 + 0.2}, {"method": 'c"d', "error": float("nan")}]
        read = list(csv.DictReader(tables.as_csv(rows).splitlines()))
        assert [row["method"] for row in read] == ["a, b", 'c"d']
        assert float(read[0]["error"]) == pytest.approx(0.3, rel=1e-9)

    def test_markdown_has_a_cell_for_every_column(self):
        lines = tables.as_markdown([{"a": 1, "b|c": "x|y"}, {"a": None, "b|c": True}]).splitlines()
        assert lines[2:] == ["| 1 | x\\|y |", "|  | yes |"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("bench") / "report"
    assert main(["--quick", "--surfaces", "cubic,sphere", "--methods", "sine,discrete,area", "-o", str(out)]) == 0
    return out


class TestReport:
    def test_has_its_page_tables_and_pictures(self, folder):
        names = {path.name for path in folder.iterdir()}
        assert {"index.md", "pointwise.csv", "meshes.csv", "tori.csv", "spread.csv"} <= names
        text = (folder / "index.md").read_text(encoding="utf-8")
        assert text.startswith("# ")
        linked = set(re.findall(r"\]\((.*?)\)", text))
        assert linked - names == set()
        assert {name for name in names if name.endswith(".png")} <= linked
        assert "nan" not in text
        shown = set(re.findall(r"!\[.*?\]\((.*?)\)", text))
        assert {name for name in names if name.startswith("map_")} <= shown

    def test_pictures_are_small_and_not_empty(self, folder):
        for path in folder.glob("*.png"):
            assert 5_000 < path.stat().st_size < 200_000

    def test_nothing_is_left_beside_it(self, folder):
        assert [path.name for path in folder.parent.iterdir()] == ["report"]

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["--methods", "cosine"], "--methods must be all or among"),
            (["--surfaces", "cubic,potato"], "--surfaces must be all or among"),
            (["--methods", ","], "--methods must name some of"),
            (["-o", "nowhere/report"], "--output must be in an existing folder"),
            (["-o", "full"], "--output must be a new folder, 'full' is there already"),
            (["-o", "file"], "--output must be a new folder, 'file' is there already"),
        ],
    )
    def test_bad_input_is_one_sentence(self, arguments, message, tmp_path, monkeypatch, capsys):
        monkeypatch.chdir(tmp_path)
        (tmp_path / "full").mkdir()
        (tmp_path / "file").write_text("")
        before = sorted(tmp_path.rglob("*"))
        assert main(["-o", "report", *arguments]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(f"error: {message}")
        assert sorted(tmp_path.rglob("*")) == before

    def test_ctrl_c_right_after_the_draft_is_made_leaves_nothing(self, tmp_path, monkeypatch):
        plain = Path.mkdir

        def interrupted(path, *arguments):
            plain(path, *arguments)
            raise KeyboardInterrupt

        monkeypatch.setattr(report.Path, "mkdir", interrupted)
        with pytest.raises(KeyboardInterrupt), report.draft_of(tmp_path / "report"):
            pass
        assert list(tmp_path.iterdir()) == []

    def test_ctrl_c_while_drawing_waits_for_the_picture(self, tmp_path, monkeypatch):
        """VTK ended the process, or crashed, on an exception in one of its callbacks; the draft was left."""
        drawn = []

        def save(path, _):
            signal.raise_signal(signal.SIGINT)
            drawn.append(path)

        monkeypatch.setattr(run, "picture", save)
        found = run.Results({}, curves={"curvature": [], "normals": []})
        monkeypatch.setattr(run.pictures, "of_surfaces", lambda *_, **__: [("one", "", list), ("two", "", list)])
        monkeypatch.setattr(run, "measured", lambda *_, **__: found)
        assert main(["-o", str(tmp_path / "report")]) == 130
        assert [path.name for path in drawn] == ["one.png"]
        assert list(tmp_path.iterdir()) == []

    def test_ctrl_c_while_it_loads_is_told_like_any_other(self, tmp_path, monkeypatch, capsys):
        class Interrupting:
            def find_spec(self, name, *_):
                if name == run.__name__:
                    raise KeyboardInterrupt

        monkeypatch.setattr(sys, "meta_path", [Interrupting(), *sys.meta_path])
        monkeypatch.delitem(sys.modules, run.__name__)
        monkeypatch.delattr("simplexmesh.bench.run")
        assert main(["-o", str(tmp_path / "report")]) == 130
        assert capsys.readouterr().err == "interrupted, nothing was written\n"

    @pytest.mark.nightly
    @pytest.mark.slow
    def test_ctrl_c_leaves_nothing(self, tmp_path):
        command = [
            sys.executable,
            "-m",
            "simplexmesh.bench",
            "--methods",
            "sine",
            "-o",
            str(tmp_path / "report"),
        ]
        running = subprocess.Popen(
            command, stderr=subprocess.PIPE, text=True, env={**os.environ, "PYVISTA_OFF_SCREEN": "1"}
        )
        until = time.monotonic() + 60
        while not list(tmp_path.iterdir()) and time.monotonic() < until:
            time.sleep(0.05)
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=60)
        assert running.returncode == 130
        assert said.splitlines()[-1] == "interrupted, nothing was written"
        assert list(tmp_path.iterdir()) == []
