"""Images of VTK with several arrays: which one is read is said."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import pyvista

import simplexmesh as sm
from simplexmesh.data.convert import as_volume
from simplexmesh.errors import SimplexMeshWarning

HEAD = "# vtk DataFile Version 3.0\nimage\nASCII\nDATASET STRUCTURED_POINTS\n"
GRID = "DIMENSIONS 2 2 2\nORIGIN 0 0 0\nSPACING 1 1 1\n"


def image(*, active=None, vectors_first=False):
    grid = pyvista.ImageData(dimensions=(3, 4, 5))
    if vectors_first:
        grid["gradient"] = np.zeros((60, 3))
    grid["ct"] = np.arange(60.0)
    grid["mask"] = np.arange(100.0, 160)
    grid["gradient"] = np.zeros((60, 3))
    grid.cell_data["dose"] = np.zeros(24)
    grid.set_active_scalars(active)
    return grid


@pytest.mark.parametrize("ending", [".vti", ".vtk"])
@pytest.mark.parametrize("vectors_first", [False, True])
@pytest.mark.parametrize(
    ("active", "message"),
    [
        (None, "holds several arrays: 'ct', the first one, was read, not 'mask', 'dose'"),
        ("ct", "holds several arrays: 'ct', the active one, was read, not 'mask', 'dose'"),
        ("mask", "holds several arrays: 'mask', the active one, was read, not 'ct', 'dose'"),
    ],
)
def test_the_array_that_is_read_is_named(ending, vectors_first, active, message, tmp_path):
    grid = image(active=active, vectors_first=vectors_first)
    grid.save(tmp_path / f"a{ending}")
    for found, name in ((lambda: sm.read(tmp_path / f"a{ending}"), f"a{ending}"), (lambda: as_volume(grid), "volume")):
        with pytest.warns(SimplexMeshWarning, match=f"^{name} {message}$"):
            assert found().values.min() == (100 if active == "mask" else 0)


def test_further_scalars_of_old_files_are_named(tmp_path):
    rows = "".join(
        f"SCALARS {name} float 1\nLOOKUP_TABLE default\n1 2 3 4 5 6 7 {last}\n" for name, last in ("a8", "b9")
    )
    (tmp_path / "a.vtk").write_text(f"{HEAD}{GRID}POINT_DATA 8\n{rows}")
    with pytest.warns(
        SimplexMeshWarning, match=r"^a.vtk holds several arrays: 'a', the active one, was read, not 'b'$"
    ):
        assert sm.read(tmp_path / "a.vtk").values.max() == 8


@pytest.mark.parametrize("ending", [".vti", ".vtk"])
def test_one_array_needs_no_word(ending, tmp_path):
    grid = pyvista.ImageData(dimensions=(3, 4, 5))
    grid["gradient"], grid["ct"] = np.zeros((60, 3)), np.arange(60.0)
    grid.set_active_scalars(None)
    grid.save(tmp_path / f"a{ending}")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert sm.read(tmp_path / f"a{ending}").values.max() == 59
