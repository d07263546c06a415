"""Processes killed while they save files and add to libraries: what is there is whole, and what is left is swept.

Run with `make nightly`; two minutes.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time

import numpy as np
import pytest

import simplexmesh as sm
from tests.nightly.fuzz import ROOT

SAVE = """
import sys, itertools, simplexmesh as sm
balls = [sm.sphere(40), sm.sphere(50)]
balls[0].save(sys.argv[1])
print("ready", flush=True)
for k in itertools.count():
    balls[k % 2].save(sys.argv[1])
"""
ADD = """
import sys, itertools, simplexmesh as sm
library, ball = sm.ModelLibrary(sys.argv[1]), sm.sphere(5).triangulated()
library.add("first", ball, replace=True)
print("ready", flush=True)
for k in itertools.count():
    library.add(f"{sys.argv[2]}-{k}", ball)
"""


def killed(script, *arguments, after):
    """Run a script, and kill its process so many seconds after it began its work."""
    process = subprocess.Popen(
        [sys.executable, "-c", script, *map(str, arguments)],
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    with process:
        try:
            assert process.stdout.readline() == b"ready\n"
            time.sleep(after)
        finally:
            process.kill()


@pytest.mark.nightly
@pytest.mark.parametrize("ending", [".vtp", ".ply", ".obj"])
def test_saving(ending, tmp_path):
    path, rng = tmp_path / f"ball{ending}", np.random.default_rng(0)
    for _ in range(6):
        killed(SAVE, path, after=rng.uniform(0.01, 0.4))
        assert len(sm.read(path).vertices) in (20 * 40**2, 20 * 50**2)
    time.sleep(1.1)
    sm.sphere(3).save(path)
    assert list(tmp_path.iterdir()) == [path]
    assert len(sm.read(path).vertices) == 180


@pytest.mark.nightly
def test_adding(tmp_path):
    path, rng = tmp_path / "models.sml", np.random.default_rng(0)
    before = 0
    for k in range(6):
        killed(ADD, path, k, after=rng.uniform(0.01, 0.6))
        library = sm.ModelLibrary(path)
        names = library.names
        assert len(names) >= before
        assert len(library.points(names[-1])) > 100
        before = len(names)
    assert before > 1
