"""PLY files of other programs: properties in any order, triangle strips, comments; damaged headers."""

from __future__ import annotations

import warnings

import numpy as np
import plyfile
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

import simplexmesh as sm
from simplexmesh.data.io.ply import read_ply

POINTS = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
FACES = "element face 4\nproperty list uchar int vertex_indices\n"
VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
TRIANGLES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
BODY = "".join(f"{x} {y} {z}\n" for x, y, z in VERTICES)
LISTS = "".join(f"3 {a} {b} {c}\n" for a, b, c in TRIANGLES)
TEXTURES = "element face 4\nproperty list uchar float texcoord\nproperty list uchar int vertex_index\n"
TEXTURED = "".join(f"6 0 0 1 0 1 1 3 {a} {b} {c}\n" for a, b, c in TRIANGLES)


def text(header, body):
    return f"ply\nformat ascii 1.0\n{header}end_header\n{body}"


def read(path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return sm.read(path)


@pytest.mark.parametrize(
    ("header", "body"),
    [
        (POINTS + FACES, BODY + LISTS),
        (POINTS + TEXTURES, BODY + TEXTURED),
        ("comment no end_header yet\n" + POINTS + FACES, BODY + LISTS),
        (POINTS + "element tristrips 1\nproperty list int int vertex_indices\n", BODY + "11 0 2 1 3 -1 2 0 3 -1 1 0\n"),
        (POINTS + "element tristrips 2\nproperty list int int vertex_indices\n", BODY + "4 0 2 1 3\n3 2 0 3\n"),
    ],
    ids=["plain", "texture first", "comment", "strips", "lists of strips"],
)
def test_text(header, body, tmp_path):
    (tmp_path / "a.ply").write_text(text(header, body))
    found = read(tmp_path / "a.ply")
    assert_array_equal(found.vertices, VERTICES)
    if "strips" in header:
        assert found.faces.tolist() == [[0, 2, 1], [1, 2, 3], [2, 0, 3]]
    else:
        assert_array_equal(found.faces, TRIANGLES)


def test_binary_with_texture_coordinates_first(tmp_path):
    header = text(POINTS + TEXTURES, "").replace("ascii", "binary_little_endian").encode()
    rows = [b"\6" + np.zeros(6, "<f4").tobytes() + b"\3" + np.array(face, "<i4").tobytes() for face in TRIANGLES]
    (tmp_path / "a.ply").write_bytes(header + np.array(VERTICES, "<f4").tobytes() + b"".join(rows))
    assert_array_equal(read(tmp_path / "a.ply").faces, TRIANGLES)


def test_binary_strips(tmp_path):
    header = text(POINTS + "element tristrips 1\nproperty list int int vertex_indices\n", "")
    strip = np.array([5, 0, 1, 2, 3, -1], "<i4").tobytes()
    content = header.replace("ascii", "binary_little_endian").encode() + np.array(VERTICES, "<f4").tobytes() + strip
    (tmp_path / "a.ply").write_bytes(content)
    assert read(tmp_path / "a.ply").faces.tolist() == [[0, 1, 2], [2, 1, 3]]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("format ascii 1.0", "format"),
        ("element vertex 4", "element"),
        ("element vertex 4", "element vertex many"),
        ("property float x", "property"),
        ("property float x", "property x"),
        ("3 2 0 3", "-3 2 0 3"),
        ("3 2 0 3", "nan 2 0 3"),
        ("3 2 0 3", "inf 2 0 3"),
        ("3 2 0 3", "3 2 0 2.5"),
    ],
)
def test_damaged(old, new, tmp_path):
    whole = text(POINTS + FACES, BODY + LISTS)
    assert old in whole
    (tmp_path / "a.ply").write_text(whole.replace(old, new))
    with pytest.raises((OSError, ValueError), match=r"a.ply.*(damaged|whole numbers)"):
        read(tmp_path / "a.ply")


@pytest.mark.parametrize("rest", ["written by hand\n", "\0\0\0"])
def test_what_follows_the_last_row_is_ignored(rest, tmp_path):
    (tmp_path / "a.ply").write_text(text(POINTS + FACES, BODY + LISTS + rest))
    assert_array_equal(read(tmp_path / "a.ply").vertices, VERTICES)


@st.composite
def texts(draw):
    """Text files of points and triangles, some with lists at vertices, empty faces, numbers too many or displaced."""
    kind, ending = draw(st.sampled_from(["float", "int", "uchar"])), draw(st.sampled_from(["\n", "\r\n"]))
    number = st.sampled_from(["0", "1", "2", "3", "7"]) | st.sampled_from(["0.5", "256", "-1"])
    tags = draw(st.none() | st.lists(st.sampled_from(["1 5", "0", "2 6 8", "-1", "300"]), min_size=4, max_size=4))
    points = [[*map(str, point)] for point in VERTICES]
    points[draw(st.integers(0, 3))][draw(st.integers(0, 2))] = draw(number)
    rows = [[*point, *tag.split()] for point, tag in zip(points, tags or [""] * 4, strict=True)]
    faces = draw(st.lists(st.sampled_from([*TRIANGLES, []]), max_size=4))
    faces += TRIANGLES[:1] * bool(faces)
    rows += [[str(len(face)), *map(str, face)] for face in faces]
    for _ in range(draw(st.integers(0, 1))):
        rows[draw(st.integers(0, len(rows) - 1))].append(draw(number))
        rows[draw(st.integers(0, len(rows) - 1))].pop(draw(st.sampled_from([0, -1])))
    header = POINTS.replace("float", kind) + "property list uchar int tags\n" * (tags is not None)
    header += f"comment element face 9\nelement face {len(faces)}\nproperty list uchar int vertex_indices\n"
    body = "".join(" ".join(row) + "\n" for row in rows) + draw(st.sampled_from(["", "\n", "9 9\n"]))
    return text(header, body).replace("\n", ending)


@given(texts())
@pytest.mark.filterwarnings("ignore")
def test_text_is_read_as_plyfile_reads_it(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("text") / "a.ply"
    path.write_text(content, newline="")
    try:
        wanted = plyfile.PlyData.read(str(path))
    except (plyfile.PlyParseError, ValueError, OverflowError):
        with pytest.raises(OSError, match="truncated or damaged"):
            read_ply(path)
        return
    found = read_ply(path)
    points = found.vertices if isinstance(found, sm.TriangleMesh) else found.points
    assert_array_equal(points, np.stack([wanted["vertex"][c] for c in "xyz"], axis=1))
    faces = [row.tolist() for row in wanted["face"]["vertex_indices"] if len(row)]
    assert faces == (found.faces.tolist() if isinstance(found, sm.TriangleMesh) else [])
