"""OFF files with one item a line, with and without colors; any other layout is refused."""

from __future__ import annotations

import pytest
from numpy.testing import assert_array_equal

import simplexmesh as sm

VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.5]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
ROWS = "0 0 0\n1 0 0\n0 1 0\n0 0 1.5\n"
LISTS = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"
COLORED = "3 0 2 1 255 0 0\n3 0 1 3\n3 1 2 3 7\n3 2 0 3 0.5 0.5 0.5 1\n"


@pytest.mark.parametrize(
    "text",
    [
        "OFF\n4 4 0\n" + ROWS + LISTS,
        "OFF 4 4 6 \n" + ROWS + LISTS,
        "OFF\n4 4 0\n" + ROWS + COLORED,
        "NOFF 4 4 0\n" + ROWS.replace("\n", " 0 0 1\n") + LISTS,
        "COFF 4 4 0\n" + ROWS.replace("\n", " 0.5 0 0 1\n") + "# faces\n\n" + LISTS,
        "STCNOFF 4 4 0\n" + ROWS.replace("\n", " 0 0 1 255 0 0 255 0.5 0.5\n") + COLORED,
    ],
)
def test_normals_and_colors_are_skipped(text, tmp_path):
    (tmp_path / "a.off").write_text(text)
    mesh = sm.read(tmp_path / "a.off")
    assert_array_equal(mesh.vertices, VERTICES)
    assert_array_equal(mesh.faces, FACES)


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
