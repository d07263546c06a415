"""STL files of other programs: capitals, bytes after the triangles."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import simplexmesh as sm
from simplexmesh._base.errors import SimplexMeshWarning

VERTICES = np.array([[0, 0, 0], [1.5, 0, 0], [0, 1, 0], [0, 0, 1e-3]])
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


def lines():
    corners = ["".join("vertex {:g} {:g} {:g}\n".format(*VERTICES[i]) for i in face) for face in FACES]
    facets = "".join(f"facet normal 0 0 0\nouter loop\n{three}endloop\nendfacet\n" for three in corners)
    return f"solid part\n{facets}endsolid part\n"


def binary(header=b"made by hand", count=4):
    rows = np.zeros(len(FACES), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    rows["corners"] = VERTICES[FACES]
    return header.ljust(80, b"\0") + count.to_bytes(4, "little") + rows.tobytes()


def assert_is_the_tetrahedron(mesh):
    assert mesh.is_closed
    assert_array_equal(mesh.vertices[mesh.faces], VERTICES.astype(np.float32)[FACES])


@pytest.mark.parametrize("name", ["a.stl", "a.STL", "a.Stl"])
@pytest.mark.parametrize("form", ["text", "capitals", "mixed", "binary", "binary that begins as text"])
def test_capitals(name, form, tmp_path):
    mixed = lines().replace("solid part", "Solid part").replace("vertex", "VERTEX")
    text = {"text": lines(), "capitals": lines().upper(), "mixed": mixed}
    header = b"solid facet" if form != "binary" else b"COLOR="
    (tmp_path / name).write_bytes(text[form].encode() if form in text else binary(header))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert_is_the_tetrahedron(sm.read(tmp_path / name))


@pytest.mark.parametrize("header", [b"", b"solid facet", b"SOLID FACET"])
@pytest.mark.parametrize("more", [b"\n", b"\0" * 50, b"xyz" * 1000])
def test_bytes_after_the_triangles_are_reported(header, more, tmp_path):
    (tmp_path / "a.stl").write_bytes(binary(header) + more)
    with pytest.warns(SimplexMeshWarning, match=rf"a.stl has {len(more):,} bytes? after its 4 triangles"):
        assert_is_the_tetrahedron(sm.read(tmp_path / "a.stl"))


@pytest.mark.parametrize("count", [0, 5, 10**9])
def test_other_counts_are_refused(count, tmp_path):
    (tmp_path / "a.stl").write_bytes(binary(count=count))
    with pytest.raises(OSError, match=r"a.stl must have [\d,]+ bytes as STL, it has 284"):
        sm.read(tmp_path / "a.stl")
