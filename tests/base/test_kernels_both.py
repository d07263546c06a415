"""The serial and the parallel variant of a kernel write the same.

In a parallel loop numba loses writes to arrays that are taken from a tuple within the loop; such kernels write in a
function that the loop calls. The source tells; the numbers, of inputs large enough for threads, are compared nightly.
"""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh._base._kernels_both import PARALLEL_FROM, Both
from tests.nightly.marks import nightly

SLOW = ("plane", "quadric", "chen_schmitt", "extended_sine")  # to compile
PACKAGE = Path(sm.__file__).parent


def lost_writes(source: str) -> list[str]:
    """The writes in parallel loops to arrays that are taken from a tuple within the loop."""
    found = []
    for loop in ast.walk(ast.parse(source)):
        if isinstance(loop, ast.For) and ast.unparse(loop.iter).startswith(("prange(", "numba.prange(")):
            inside = list(ast.walk(loop))
            assigned = [part for node in inside if isinstance(node, ast.Assign) for part in pairs(node)]
            taken = {ast.unparse(name) for name, value in assigned if isinstance(value, ast.Attribute)}
            written = [n.value for n in inside if isinstance(n, ast.Subscript) and isinstance(n.ctx, ast.Store)]
            found += [ast.unparse(n) for n in written if not isinstance(n, ast.Name) or n.id in taken]
    return found


def pairs(node: ast.Assign) -> list[tuple[Any, ast.expr]]:
    """What is assigned to which name."""
    target = node.targets[0]
    if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
        return list(zip(target.elts, node.value.elts, strict=True))
    return [(target, node.value)]


def arrays_in(value: Any) -> list[np.ndarray]:
    if isinstance(value, np.ndarray):
        return [value]
    return [array for part in value for array in arrays_in(part)] if isinstance(value, tuple) else []


def copied(value: Any, known: dict[int, np.ndarray]) -> Any:
    """A copy in which arrays that were one are one again."""
    if isinstance(value, np.ndarray):
        return known.setdefault(id(value), value.copy())
    if isinstance(value, tuple):
        parts = [copied(part, known) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


@pytest.fixture
def compared(monkeypatch):
    """Names of the kernels that ran in both variants; each run fails where they wrote different numbers."""
    seen = set()

    def call(self, vertices, *arguments):
        given = (vertices, *arguments)
        other = copied(given, {})
        self.serial(*other)
        self.parallel(*given)
        for mine, theirs in zip(arrays_in(given), arrays_in(other), strict=True):
            np.testing.assert_allclose(mine, theirs, rtol=1e-6, atol=1e-9, err_msg=self.serial.__name__)
        seen.add(self.serial.__name__)

    monkeypatch.setattr(Both, "__call__", call)
    return seen


def test_parallel_loops_write_to_no_array_taken_from_a_tuple():
    sources = {path: path.read_text(encoding="utf-8") for path in PACKAGE.rglob("_kernels*.py")}
    assert sum("in prange(" in source for source in sources.values()) > 20
    assert {path.name: found for path, source in sources.items() if (found := lost_writes(source))} == {}


@pytest.mark.parametrize("write", ["out.area[i] = 1", "area = out.area; area[i] += 1", "a, b = out.a, 1; a[i] = b"])
def test_a_planted_loss_is_seen(write):
    assert len(lost_writes(f"for i in prange(9):\n    {write}")) == 1
    assert lost_writes(f"for i in range(9):\n    {write}") == []


@pytest.mark.nightly
def test_of_motion(compared):
    ring = sm.torus(vertices=2 * PARALLEL_FROM)
    for data in (sm.targets.Points(ring.vertices), sm.targets.Triangles(ring.triangulated())):
        model = sm.DeformableModel(ring, data, reach=0.3, adaptation=0.05)
        for _ in range(11):
            model.step()
    assert {"frames", "curvature_step", "surfel_gaps", "adapted"} <= compared


@pytest.mark.nightly
def test_of_open_meshes_and_volumes(compared):
    sheet = sm.plane(vertices=2 * PARALLEL_FROM)
    x, y, z = np.mgrid[-8:9, -8:9, -8:9] / 8.0
    volume = sm.Volume(0.03 * np.cos(3 * x) - z + 0 * y, spacing=0.125, origin=(-1, -1, -1))
    model = sm.DeformableModel(
        sheet, sm.targets.Isosurface(volume, 0.0), reach=0.3, rigidity=np.full(sheet.n_vertices, 2)
    )
    for _ in range(2):
        model.step()
    assert "isosurface_gaps" in compared


@pytest.mark.nightly
@pytest.mark.parametrize(
    "method", ["adaptive", "chen_schmitt", "discrete", "full_quadric", "langer", "simplex_angle", "sine", "taubin"]
)
def test_of_curvature(compared, method):
    ring = sm.torus(vertices=2 * PARALLEL_FROM)
    sm.curvature(ring if method == "simplex_angle" else ring.triangulated(), method=method)
    assert compared


@pytest.mark.parametrize("method", ["area", *nightly(*SLOW)])
def test_of_normals(compared, method):
    sm.vertex_normals(sm.torus(vertices=2 * PARALLEL_FROM).triangulated(), method=method)
    assert compared
