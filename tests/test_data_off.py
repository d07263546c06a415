"""OFF files whose items are separated by any white space, with and without colors."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import simplexmesh as sm

VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.5]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
ROWS = "0 0 0\n1 0 0\n0 1 0\n0 0 1.5\n"
LISTS = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"
COLORED = "3 0 2 1 255 0 0\n3 0 1 3\n3 1 2 3 7\n3 2 0 3 0.5 0.5 0.5 1\n"


def spaced(text):
    return text.replace("\n", " ")


@pytest.mark.parametrize(
    "text",
    [
        spaced("OFF 4 4 6 " + ROWS + LISTS),
        spaced("OFF 4 4 6 " + ROWS + LISTS) + "\n",
        "OFF\n4 4 0\n" + spaced(ROWS) + "\n" + spaced(LISTS),
        "OFF\n4 4 0\n" + spaced(ROWS) + "\n" + LISTS,
        "OFF\n4 4 0\n" + spaced(ROWS) + "\n" + COLORED,
        "OFF\n4 4 0\n0 0 0 1 0 0 # two\n0 1 0 0 0 1.5\n" + COLORED,
        "OFF\n4 4 0\n" + ROWS.replace(" ", "\n") + COLORED,
        "OFF\n4 4 0\n" + ROWS.replace(" ", "\n") + LISTS.replace(" ", "\n"),
        "OFF\n4 4 0\n" + ROWS + LISTS.replace(" ", "\n"),
        "OFF\n4 4 0\n" + ROWS + spaced(LISTS),
        "NOFF 4 4 0 " + spaced(ROWS.replace("\n", " 0 0 1\n") + LISTS),
        "COFF 4 4 0 " + spaced(ROWS.replace("\n", " 0.5 0 0 1\n") + LISTS),
        "COFF 4 4 0 " + spaced(ROWS.replace("\n", " 255 0 0\n") + LISTS),
        "STCNOFF 4 4 0 " + spaced(ROWS.replace("\n", " 0 0 1 255 0 0 255 0.5 0.5\n") + LISTS),
        "COFF\n4 4 0\n" + spaced(ROWS.replace("\n", " 255 0 0 255\n")) + "\n" + COLORED,
    ],
)
def test_any_white_space_separates_items(text, tmp_path):
    (tmp_path / "a.off").write_text(text)
    mesh = sm.read(tmp_path / "a.off")
    assert_array_equal(mesh.vertices, VERTICES)
    assert_array_equal(mesh.faces, FACES)


def test_points_on_one_line(tmp_path):
    (tmp_path / "a.off").write_text(spaced("OFF 4 0 0 " + ROWS))
    assert_array_equal(sm.read(tmp_path / "a.off").points, VERTICES)


def test_polygons_of_several_sizes_on_one_line(tmp_path):
    (tmp_path / "a.off").write_text("OFF 5 2 0 0 0 0 2 0 0 2 2 0 0 2 0 1 3 0 4 0 1 2 3 3 3 2 4")
    assert sm.read(tmp_path / "a.off").area == pytest.approx(5.0)


@pytest.mark.parametrize("n", range(1, 12))
def test_truncated(n, tmp_path):
    numbers = spaced("OFF 4 4 6 " + ROWS + LISTS).split()
    (tmp_path / "a.off").write_text(" ".join(numbers[:-n]))
    with pytest.raises(OSError, match=r"a.off must have 4 vertices and 4 faces, .*: truncated"):
        sm.read(tmp_path / "a.off")


@pytest.mark.parametrize(
    ("old", "new"),
    [("3 2 0 3", "3 2 0 2.5"), ("3 2 0 3", "-3 2 0 3"), ("3 2 0 3", "3 2 x 3"), ("3 1 2 3", "0.5 1 2 3"), ("1.5", "")],
)
def test_damaged(old, new, tmp_path):
    (tmp_path / "a.off").write_text(spaced("OFF 4 4 6 " + (ROWS + LISTS).replace(old, new)))
    with pytest.raises(OSError, match=r"a.off (is not an OFF file|must have 4 vertices)"):
        sm.read(tmp_path / "a.off")


def test_large_counts_of_a_damaged_header_take_no_memory(tmp_path):
    (tmp_path / "a.off").write_text(f"OFF 4 {10**15} 0 " + spaced(ROWS + LISTS))
    with pytest.raises(OSError, match="truncated"):
        sm.read(tmp_path / "a.off")


def test_normals_are_no_coordinates(tmp_path):
    rng = np.random.default_rng(0)
    rows = np.round(np.hstack([rng.normal(size=(6, 3)), np.tile([0, 0, 1], (6, 1))]), 3)
    text = " ".join(map(str, rows.reshape(-1).tolist()))
    (tmp_path / "a.off").write_text(f"NOFF 6 2 0 {text} 3 0 1 2 3 3 4 5")
    assert_array_equal(sm.read(tmp_path / "a.off").vertices, rows[:, :3])
