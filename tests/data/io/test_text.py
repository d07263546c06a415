"""Text files of points as spreadsheets and other programs export them: names of columns, marks, decimal commas."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import simplexmesh as sm
from simplexmesh._base.errors import SimplexMeshWarning

POINTS = np.array([[0, 0, 0], [1, 0, 0.5], [0, 2, 0], [0, 0, 3], [1, 1, 1.25]])


def rows(*columns, separator=","):
    return "\n".join(separator.join(map(str, row)) for row in np.hstack(columns).tolist()) + "\n"


NUMBER = np.arange(5.0)[:, None]
MIDDLE = rows(POINTS[:, :1], NUMBER, POINTS[:, 1:])


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        ("x,number,y,z\n" + MIDDLE, "utf-8-sig"),
        (rows(POINTS), "utf-8-sig"),
        ('"Point ID","X","Y","Z"\n' + rows(NUMBER, POINTS), "utf-8"),
        ('"k1","Points:0","Points:1","Points:2"\n' + rows(NUMBER, POINTS), "utf-8"),
        ('"Points_0","k1","Points_1","Points_2"\n' + MIDDLE, "utf-8"),
        ("id,x [mm],y [mm],z [mm]\n" + rows(NUMBER, POINTS), "utf-8"),
        ("id;X(m);Y(m);Z(m)\n" + rows(NUMBER, POINTS, separator=";"), "utf-8"),
        ("//X Y Z Intensity\n5\n" + rows(POINTS, NUMBER, separator=" "), "utf-8"),
        ("# id x y z\n" + rows(NUMBER, POINTS, separator=" "), "utf-8"),
        ("# made by hand\n" + rows(POINTS, separator=" "), "utf-8"),
    ],
    ids=[
        "byte order mark",
        "mark only",
        "spaces",
        "colons",
        "indices",
        "units",
        "brackets",
        "count",
        "comment",
        "words",
    ],
)
def test_columns_are_found_by_their_names(text, encoding, tmp_path):
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert_array_equal(sm.read(tmp_path / "a.csv").points, POINTS)


def test_six_columns_without_names_are_points_and_unit_normals_or_colors(tmp_path):
    colors = np.array([[0, 0, 0], [255, 3, 0], [1, 2, 3], [4, 5, 6], [7, 8, 9]])
    for beside in (colors, np.eye(3)[[0, 1, 2, 0, 1]]):
        (tmp_path / "a.xyz").write_text(rows(POINTS, beside, separator=" "))
        cloud = sm.read(tmp_path / "a.xyz")
        assert (cloud.normals is None) == (beside is colors)
        assert_array_equal(cloud.data["colors"] if beside is colors else cloud.normals, beside)


def test_columns_without_known_names_are_reported(tmp_path):
    (tmp_path / "a.csv").write_text("easting,northing,height\n" + rows(POINTS))
    with pytest.warns(SimplexMeshWarning, match=r"a.csv names no columns x, y and z: the first three were read"):
        assert_array_equal(sm.read(tmp_path / "a.csv").points, POINTS)


@pytest.mark.parametrize("header", ["", "x;y;z\n"])
def test_decimal_commas_are_refused(header, tmp_path):
    (tmp_path / "a.csv").write_text(header + rows(POINTS, separator=";").replace(".", ","))
    with pytest.raises(OSError, match=r"a.csv must have decimal points, not commas as in '0,0;0,0;0,0'"):
        sm.read(tmp_path / "a.csv")


def test_semicolons_between_triples_separated_by_commas(tmp_path):
    (tmp_path / "a.txt").write_text(rows(POINTS).replace("\n", ";\n"))
    assert_array_equal(sm.read(tmp_path / "a.txt").points, POINTS)
