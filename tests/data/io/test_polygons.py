"""Polygons of PLY and OFF files are triangulated without overlaps, convex ones as fans."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh._base.vectors import triangle_vectors
from simplexmesh.data.io import polygons

NOTCHED = np.array([[0, 0, 0], [2, 0, 0], [0.5, 1, 0], [2, 2, 0], [0, 2, 0]])  # a pentagon of area 2.5
ELL = np.array([[0, 0, 0], [3, 0, 0], [3, 1, 0], [1, 1, 0], [1, 3, 0], [0, 3, 0]])  # a hexagon of area 5


def write(path, points, loops):
    ply = path.suffix == ".ply"
    head = f"OFF\n{len(points)} {len(loops)} 0\n"
    if ply:
        head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
        head += "".join(f"property double {c}\n" for c in "xyz")
        head += f"element face {len(loops)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(repr, row)) for row in np.asarray(points, float).tolist()]
    rows += [" ".join(map(str, [len(loop), *loop])) for loop in loops]
    path.write_text(head + "\n".join(rows) + "\n")


def directed_areas(mesh):
    return mesh.face_vectors / 2


@pytest.mark.parametrize("ending", [".ply", ".off"])
@pytest.mark.parametrize("start", range(6))
@pytest.mark.parametrize(("shape", "area"), [(NOTCHED, 2.5), (ELL, 5.0)], ids=["notched", "ell"])
def test_concave_polygons_keep_their_area(ending, start, shape, area, tmp_path):
    turned = Rotation.from_euler("xyz", [0.3, 1.1, -0.7])
    points = turned.apply(1e-3 * shape) + np.array([40, -7, 12])
    loop = np.roll(np.arange(len(shape)), start).tolist()
    write(tmp_path / f"a{ending}", points, [loop])
    mesh = sm.read(tmp_path / f"a{ending}")
    assert mesh.n_faces == len(shape) - 2
    assert mesh.area == pytest.approx(area * 1e-6)
    assert_allclose(directed_areas(mesh).sum(axis=0), turned.apply([0, 0, area * 1e-6]), atol=1e-12)


@pytest.mark.parametrize("ending", [".ply", ".off"])
def test_a_solid_with_concave_ends_is_closed_and_has_its_volume(ending, tmp_path):
    n = len(ELL)
    loops = [list(range(n))[::-1], list(range(n, 2 * n))]
    loops += [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    for start in range(n):
        turned = [loop[start % len(loop) :] + loop[: start % len(loop)] for loop in loops]
        write(tmp_path / f"a{ending}", np.concatenate([ELL, ELL + np.array([0, 0, 2])]), turned)
        mesh = sm.read(tmp_path / f"a{ending}")
        assert mesh.is_closed
        assert (mesh.volume, mesh.area) == pytest.approx((10.0, 2 * 5 + 2 * 12))


def test_convex_polygons_and_stars_around_their_first_corner_are_cut_into_fans():
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    points = np.concatenate([square, NOTCHED])
    sizes, flat = np.array([4, 3, 5]), np.array([0, 1, 2, 3, 0, 1, 2, 6, 7, 8, 4, 5])
    assert_array_equal(polygons.triangulated(points, sizes, flat), polygons.fans(sizes, flat))


def test_the_order_of_polygons_is_kept():
    sizes, flat = np.array([3, 5, 3]), np.array([0, 1, 2, 0, 1, 2, 3, 4, 2, 3, 4])
    found = polygons.triangulated(NOTCHED, sizes, flat)
    assert_array_equal(found[[0, -1]], [[0, 1, 2], [2, 3, 4]])
    assert len(found) == 5


@pytest.mark.parametrize("scale", [1e-160, 1e-20, 1.0, 1e20, 1e150])
def test_in_every_unit(scale):
    found = polygons.triangulated(scale * NOTCHED, np.array([5]), np.arange(5))
    a, b, c = NOTCHED[found].transpose(1, 0, 2)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(2.5)


@pytest.mark.parametrize(
    ("points", "loop"),
    [
        ([[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0.0]], [0, 1, 2, 3]),  # crosses itself
        ([[0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 3, 0.0]], [0, 1, 2, 3]),
        (np.zeros((4, 3)), [0, 1, 2, 3]),  # a point
        (NOTCHED, [0, 1, 2, 3, 9]),  # refused later, by name
        (np.where(NOTCHED == 0.5, np.nan, NOTCHED), [0, 1, 2, 3, 4]),  # too
    ],
    ids=["crossing", "crossing unevenly", "point", "outside", "nan"],
)
def test_what_cannot_be_cut_well_is_a_fan(points, loop):
    sizes = np.array([len(loop)])
    found = polygons.triangulated(np.asarray(points), sizes, np.array(loop))
    assert len(found) == len(loop) - 2
    assert set(found.reshape(-1)) == set(loop)


def test_repeated_corners_do_no_harm():
    found = polygons.triangulated(NOTCHED, np.array([7]), np.array([0, 1, 1, 2, 3, 4, 4]))
    a, b, c = NOTCHED[found].transpose(1, 0, 2)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(2.5)


@pytest.mark.parametrize("corner", [2.5, np.inf, np.nan])
def test_corners_are_whole_numbers(corner):
    sizes, flat = np.array([3]), np.array([0, 1, 2.0])
    assert_array_equal(polygons.triangulated(NOTCHED, sizes, flat), [[0, 1, 2]])
    with pytest.raises(ValueError, match="whole numbers"):
        polygons.triangulated(NOTCHED, sizes, np.array([0, 1, corner]))


@pytest.mark.parametrize("first", range(5))
def test_corners_on_a_line_give_no_flat_triangles(first):
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], float)
    found = polygons.triangulated(points, np.array([5]), np.roll(np.arange(5), -first))
    twice = triangle_vectors(points, found)[:, 2]
    assert twice.min() > 0.5
    assert twice.sum() == pytest.approx(4)
