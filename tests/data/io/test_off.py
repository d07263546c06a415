"""OFF files with one item a line, with and without colors; any other layout is refused."""

from __future__ import annotations

from contextlib import nullcontext

import pytest
from numpy.testing import assert_array_equal

import simplexmesh as sm

VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.5]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
ROWS = "0 0 0\n1 0 0\n0 1 0\n0 0 1.5\n"
LISTS = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"
COLORED = "3 0 2 1 255 0 0\n3 0 1 3\n3 1 2 3 7\n3 2 0 3 0.5 0.5 0.5 1\n"


NORMALS = [[0, 0, 1]] * 4
RED = [[255, 0, 0, 255]] * 4


def read(tmp_path, text):
    (tmp_path / "a.off").write_text(text)
    return sm.read(tmp_path / "a.off")


@pytest.mark.parametrize("head", ["OFF\n4 4 0\n", "OFF 4 4 6 \n", "# a comment\nOFF 4 4 0\n\n"])
def test_of_places_and_faces(head, tmp_path):
    mesh = read(tmp_path, head + ROWS + "# faces\n\n" + LISTS)
    assert_array_equal(mesh.vertices, VERTICES)
    assert_array_equal(mesh.faces, FACES)
    assert dict(mesh.data) == {}


@pytest.mark.parametrize(
    ("keyword", "columns", "held"),
    [
        ("COFF", " 1 0 0 1", {"colors": RED}),
        ("COFF", " 255 0 0 255", {"colors": RED}),
        ("COFF", " 255 0 0", {"colors": [[255, 0, 0]] * 4}),
        ("NOFF", " 0 0 1", {}),
        ("CNOFF", " 0 0 1 255 0 0 255", {"colors": RED}),
        ("STOFF", " 0.5 0.25", {"uv": [[0.5, 0.25]] * 4}),
        ("STCNOFF", " 0 0 1 255 0 0 255 0.5 0.25", {"colors": RED, "uv": [[0.5, 0.25]] * 4}),
    ],
)
def test_colors_normals_and_texture_are_read(keyword, columns, held, tmp_path):
    vertices = ROWS.replace("\n", f"{columns}\n")
    mesh, cloud = read(tmp_path, f"{keyword} 4 4 0\n{vertices}{LISTS}"), read(tmp_path, f"{keyword} 4 0 0\n{vertices}")
    assert_array_equal(mesh.faces, FACES)
    for found, places in ((mesh, mesh.vertices), (cloud, cloud.points)):
        assert_array_equal(places, VERTICES)
        assert {name: values.tolist() for name, values in found.data.items()} == held
    if "N" in keyword:
        assert_array_equal(cloud.normals, NORMALS)
    else:
        assert cloud.normals is None


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("OFF 4 4 0\n" + ROWS + COLORED, "a.off has 3 colors of faces, which were left out"),
        ("OFF 4 3 0\n" + ROWS + LISTS, "a.off has 1 lines after the last face, which were left out"),
        ("OFF 4 0 0\n" + ROWS + LISTS, "a.off has 4 lines after the last face, which were left out"),
        (
            "OFF 4 4 0\n" + ROWS.replace("\n", " 9 9\n") + LISTS,
            "a.off has 2 numbers of a vertex besides those of OFF, which were left out",
        ),
    ],
)
def test_what_is_left_out_is_told(text, told, tmp_path):
    with pytest.warns(sm.SimplexMeshWarning, match=f"^{told}$"):
        read(tmp_path, text)


@pytest.mark.parametrize("columns", ["", " 255", " 255 0"])
def test_colors_that_are_missing_are_damage(columns, tmp_path):
    with pytest.raises(OSError, match="fewer than COFF says") if columns else nullcontext():
        read(tmp_path, "COFF 4 4 0\n" + ROWS.replace("\n", f"{columns}\n") + LISTS)


@pytest.mark.parametrize(
    "text",
    [
        ("OFF 4 4 6 " + ROWS + LISTS).replace("\n", " "),
        "OFF\n4 4 0\n" + ROWS.replace(" ", "\n") + LISTS.replace(" ", "\n"),
        "OFF\n4 4 0\n" + ROWS.replace("\n", " ") + "\n" + LISTS,
        "4OFF 4 4 0\n" + ROWS.replace("\n", " 1\n") + LISTS,
        "OFF BINARY\n4 4 0\n",
    ],
)
def test_other_layouts_are_refused(text, tmp_path):
    (tmp_path / "a.off").write_text(text)
    with pytest.raises(OSError, match=r"a.off (must have 4 vertices|is not an OFF file|is a binary OFF file)"):
        sm.read(tmp_path / "a.off")


def test_polygons_of_several_sizes(tmp_path):
    (tmp_path / "a.off").write_text("OFF 5 2 0\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n1 3 0\n4 0 1 2 3\n3 3 2 4\n")
    assert sm.read(tmp_path / "a.off").area == pytest.approx(5.0)


@pytest.mark.parametrize("n", range(1, 8))
def test_truncated(n, tmp_path):
    lines = ("OFF 4 4 6\n" + ROWS + LISTS).splitlines()
    (tmp_path / "a.off").write_text("\n".join(lines[:-n]))
    with pytest.raises(OSError, match=r"a.off must have 4 vertices and 4 faces, .*: truncated"):
        sm.read(tmp_path / "a.off")


@pytest.mark.parametrize(
    ("old", "new"),
    [("3 2 0 3", "3 2 0 2.5"), ("3 2 0 3", "-3 2 0 3"), ("3 2 0 3", "3 2 x 3"), ("3 1 2 3", "0.5 1 2 3"), ("1.5", "")],
)
def test_damaged(old, new, tmp_path):
    (tmp_path / "a.off").write_text("OFF 4 4 6\n" + (ROWS + LISTS).replace(old, new))
    with pytest.raises(OSError, match=r"a.off is not an OFF file"):
        sm.read(tmp_path / "a.off")


def test_large_counts_of_a_damaged_header_take_no_memory(tmp_path):
    (tmp_path / "a.off").write_text(f"OFF 4 {10**15} 0\n" + ROWS + LISTS)
    with pytest.raises(OSError, match="truncated"):
        sm.read(tmp_path / "a.off")
