"""The draw of faults: every room with mathematics is drawn from, and what becomes of a fault is told rightly."""

from __future__ import annotations

import ast
import shutil
from pathlib import Path

import pytest

from tests import mutants
from tests.test_architecture import BELOW


def test_faults_are_drawn_in_every_room_but_the_edges():
    assert {*mutants.ROOMS} == {*BELOW} - {"plot", "cli", "bench"}
    for room in mutants.ROOMS:
        assert (mutants.ROOT / "tests" / room.strip("_")).is_dir()


@pytest.mark.parametrize(
    ("codes", "found"),
    [
        ([0, 0, 0], mutants.SURVIVED),
        ([0, 1], mutants.CAUGHT),
        ([2], mutants.CAUGHT),
        ([0, None], mutants.ENDLESS),
        ([None], mutants.ENDLESS),
    ],
)
def test_what_becomes_of_a_fault(codes, found, tmp_path, monkeypatch):
    path = Path("simplexmesh/mesh/quality.py")
    (tmp_path / path.parent).mkdir(parents=True)
    (tmp_path / mutants.KERNELS).mkdir()
    (tmp_path / path).write_text("def f(x):\n    return x + 1\n")
    fault = path, ast.parse("def f(x):\n    return x + 1").body[0].body[0].value, "x - 1"
    left, seen, written = list(codes), [], (tmp_path / path).stat().st_mtime_ns

    def run_tests(copy, tests, kernels, limit):
        seen.append((copy / path).read_text())
        return left.pop(0), ""

    monkeypatch.setattr(mutants, "circles", lambda *_: [["one"], ["two"], ["three"]])
    monkeypatch.setattr(mutants, "run_tests", run_tests)
    assert mutants.outcome(tmp_path, fault, 1.0) == found
    assert {*seen} == {"def f(x):\n    return (x - 1)\n"}
    assert left == []
    assert (tmp_path / path).read_text() == "def f(x):\n    return x + 1\n"
    assert (tmp_path / path).stat().st_mtime_ns == written


def test_what_does_not_end_in_time_has_no_exit_code(tmp_path):
    shutil.copy(mutants.ROOT / "pyproject.toml", tmp_path)
    (tmp_path / "test_endless.py").write_text("def test_endless():\n    while True: pass\n")
    assert mutants.run_tests(tmp_path, ["test_endless.py"], tmp_path, 1.0) == (None, "they take over 1 s")
    (tmp_path / "test_ends.py").write_text("def test_ends():\n    raise ValueError\n")
    code, said = mutants.run_tests(tmp_path, ["test_ends.py"], tmp_path, 60.0)
    assert code == 1
    assert "FAILED test_ends.py::test_ends - ValueError" in said
