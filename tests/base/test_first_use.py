"""The first compilation is told once, by a bar where one is on, else in a line of the log."""

from __future__ import annotations

import logging
import signal
import subprocess
import sys

import numpy as np
import pytest

from simplexmesh._base import _kernels_compiled
from simplexmesh._base._kernels_compiled import FIRST_USE, announce, compiling
from simplexmesh._base._kernels_njit import njit


@pytest.fixture
def untold(monkeypatch):
    monkeypatch.setattr(_kernels_compiled, "_told", [])
    announce()


def fresh():
    """Return a kernel that has never been compiled."""
    return njit()(lambda x: x + 1)


def test_a_line_of_the_log_tells_once(untold, caplog):
    with caplog.at_level(logging.WARNING, "simplexmesh"):
        assert fresh()(1) == 2
        assert fresh()(2.0) == 3.0
    assert [(record.name, record.message) for record in caplog.records] == [("simplexmesh", FIRST_USE)]


def test_nothing_is_logged_where_a_bar_tells(untold, caplog):
    seen = []
    with compiling(lambda: seen.append("begun"), lambda: seen.append("ended")):
        assert fresh()(np.ones(2)).sum() == 4
    assert seen == ["begun", "ended"]
    assert caplog.records == []


def test_ctrl_c_waits_for_the_compiler():
    kernel = fresh()
    with compiling(lambda: signal.raise_signal(signal.SIGINT), lambda: None), pytest.raises(KeyboardInterrupt):
        kernel(1)
    assert len(kernel.signatures) == 1


def test_ctrl_c_is_not_lost_where_the_compiler_fails():
    with compiling(lambda: signal.raise_signal(signal.SIGINT), lambda: None), pytest.raises(KeyboardInterrupt):
        fresh()("no number")


@pytest.mark.slow
def test_a_function_tells_it_on_standard_error(tmp_path):
    code = "import simplexmesh as sm; sm.sphere(2).connectivity.edge_vertices; sm.parts(sm.sphere(2))"
    out = subprocess.run(
        [sys.executable, "-c", code], env={"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": ":".join(sys.path)},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert out.stderr == f"{FIRST_USE}\n"


def test_warm_up_has_an_example_of_each_door():
    from simplexmesh.cli.warm_up import examples

    assert {"reconstruct points", "decimate", "curvature", "register", "library"} <= examples().keys()


CALLED = """
import importlib, pkgutil, re, sys, warnings
import numpy as np
import simplexmesh
from simplexmesh._base._kernels_njit import Kernel
from simplexmesh._base._kernels_rows import RowKernel
from simplexmesh.cli.warm_up import examples
from simplexmesh.motion.targets._kernels_volume import isosurface_gaps

warnings.simplefilter("ignore")
for module in pkgutil.walk_packages(simplexmesh.__path__, "simplexmesh."):
    importlib.import_module(module.name)
for example in examples().values():
    example()
for name, module in list(sys.modules.items()):
    if not name.startswith("simplexmesh.") or "_kernels" in name:
        continue
    called = list(vars(module).values())
    source = open(module.__file__).read()
    for alias, other in vars(module).items():
        if "._kernels" in getattr(other, "__name__", ""):
            called += [getattr(other, each) for each in re.findall(rf"\\b{alias}[.](\\w+)[(]", source)]
    for one in called:
        kernel = one.kernel if isinstance(one, RowKernel) else one
        if isinstance(kernel, Kernel) and not kernel.signatures:
            print(f"{kernel.py_func.__module__}.{kernel.py_func.__qualname__}")
ball, known = simplexmesh.sphere(10), len(isosurface_gaps.kernel.signatures)
for kind in ("uint8", "int16", "uint16", "float32", "float64"):  # of files
    target = simplexmesh.targets.Isosurface(simplexmesh.Volume(np.eye(9, dtype=kind)[None].repeat(9, 0)), 0.5)
    target.gap(ball.vertices, ball.normals, 1.0)
    if len(isosurface_gaps.kernel.signatures) > known:
        print(kind)
"""
"""A program that prints the kernels that Python calls and no example compiles."""


@pytest.mark.nightly
def test_warm_up_compiles_all_that_python_calls():
    out = subprocess.run([sys.executable, "-c", CALLED], capture_output=True, text=True, check=True)
    seldom = {"sai._kernels_rotations.residuals"}  # of pictures
    missed = {".".join(line.split(".")[-3:]) for line in out.stdout.splitlines()}
    assert missed <= seldom


def test_warm_up_runs_every_example_in_other_processes(command, monkeypatch):
    from simplexmesh.cli import warm_up

    monkeypatch.setattr(warm_up, "examples", lambda: dict.fromkeys(["check", "deviation"]))  # others have them all
    code, out, err = command("warm-up")
    assert (code, err) == (0, "")
    assert out.startswith("kernels are compiled")
    monkeypatch.setattr(warm_up, "examples", lambda: dict.fromkeys(["nothing of the kind"]))
    with pytest.raises(KeyError, match="nothing of the kind"):
        warm_up.command()
