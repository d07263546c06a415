"""Arguments and data that targets accept and refuse, and any reach."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh._base.vectors import normalized
from simplexmesh.motion.start.grid_crossings import outer_crossings
from simplexmesh.motion.targets._kernels_volume import isosurface_gaps
from simplexmesh.motion.targets.protocol import checked_arguments
from simplexmesh.motion.targets.triangles import border_sides

AXIS = np.arange(-8.0, 9.0)
RADII = np.sqrt(AXIS[:, None, None] ** 2 + AXIS[:, None] ** 2 + AXIS**2)
BALL = sm.Volume(6.3 - RADII, origin=(-8, -8, -8))
LABELS = sm.Volume((RADII < 6.3).astype(np.uint8), origin=(-8, -8, -8))
ROUND = sm.sphere(8, radius=6.3)
MAKE = {
    "isosurface": lambda: sm.targets.Isosurface(BALL, 0.0),
    "labels": lambda: sm.targets.LabelSurface(LABELS, 1),
    "points": lambda: sm.targets.Points(ROUND.vertices),
    "triangles": lambda: sm.targets.Triangles(ROUND),
    "union": lambda: sm.targets.Union([sm.targets.Triangles(ROUND)]),
}
OUT = normalized(np.random.default_rng(0).normal(size=(60, 3)))


@pytest.fixture(params=MAKE)
def target(request):
    return MAKE[request.param]()


@pytest.mark.parametrize(
    ("vertices", "normals", "reach", "error", "message"),
    [
        (OUT, OUT[:7], 1.0, ValueError, r"normals must have shape \(60, 3\), as vertices have, not \(7, 3\)"),
        (OUT[:, :2], OUT, 1.0, ValueError, r"vertices must have shape \(\*, 3\), not \(60, 2\)"),
        (OUT, OUT[0], 1.0, ValueError, r"normals must have shape \(\*, 3\), not \(3,\)"),
        ([["a"] * 3], OUT[:1], 1.0, TypeError, r"vertices must be numbers of shape \(\*, 3\), not list of <U1"),
        ([[1, 2, 3], [1]], OUT[:2], 1.0, ValueError, "vertices must be an array .* rows have different lengths"),
        (OUT, OUT, 0.0, ValueError, "reach must be above 0, not 0"),
        (OUT, OUT, np.nan, ValueError, "reach must be finite, not nan"),
        (OUT, OUT, "far", TypeError, "reach must be a number, not str"),
    ],
)
def test_arguments_that_do_not_fit_are_named(target, vertices, normals, reach, error, message):
    with pytest.raises(error, match=message):
        target.gap(vertices, normals, reach)


def test_lists_other_types_layouts_and_read_only_arrays_are_the_same(target):
    v = np.round(64 * 5.5 * OUT) / 64  # exact as float32
    n = np.round(64 * OUT) / 64
    gaps = target.gap(v, n, 3.0)
    assert np.isfinite(gaps).all()
    frozen = v.copy()
    frozen.setflags(write=False)
    for points in (v.tolist(), v.astype(np.float32), np.asfortranarray(v), frozen):
        assert_array_equal(target.gap(points, n, 3.0), gaps)
        assert_array_equal(target.gap(points, n.tolist(), 3), gaps)
    assert target.gap(v[:0], n[:0], 3.0).shape == (0,)


def test_arrays_that_fit_are_not_copied():
    v, n, reach = checked_arguments(OUT, OUT, 2.0)
    assert v is OUT
    assert n is OUT
    assert reach == 2.0


def test_read_only_arrays_need_no_other_kernel():
    target = sm.targets.Isosurface(BALL, 0.0)
    target.gap(OUT.copy(), OUT.copy(), 1.0)
    before = len(isosurface_gaps.kernel.signatures)
    target.gap(ROUND.vertices[:60], ROUND.normals[:60], 1.0)
    assert not ROUND.vertices.flags.writeable
    assert len(isosurface_gaps.kernel.signatures) == before


def test_a_pace_of_zero_is_refused():
    with pytest.raises(ValueError, match="pace must be above 0, not 0"):
        sm.targets.Isosurface(BALL, 0.0).gap(OUT, OUT, 1.0, pace=0)


# ---- any reach


def test_an_infinite_reach_sees_all_there_is(target):
    v = 5.0 * OUT
    gaps = target.gap(v, OUT, np.inf)
    assert_allclose(gaps, 1.3, atol=0.25)
    assert_array_equal(gaps, target.gap(v, OUT, 1e3))
    model = sm.DeformableModel(sm.sphere(6, radius=2.0), target, reach=np.inf)
    assert next(model.run(1)).reached == 1.0


def test_the_search_is_as_far_as_the_reach_and_no_farther_than_the_volume():
    target = sm.targets.Isosurface(BALL, 0.0)
    rng = np.random.default_rng(1)
    v, n = rng.uniform(-12, 12, (400, 3)), normalized(rng.normal(size=(400, 3)))
    v[:20, 0] = 200.0
    n[:10] = [1.0, 0, 0]
    n[10:20] = [0, 1.0, 0]  # along the volume and past it
    everything = target.gap(v, n, np.inf)
    assert 20 < np.isfinite(everything).sum() < 380
    for reach in (0.5, 3.0, 17.0, 60.0, 1e4, 1e9):  # 1e9 would take minutes step by step
        near = np.where(np.abs(everything) <= reach, everything, np.nan)
        assert_allclose(target.gap(v, n, reach), near, atol=1e-6)
    hit = np.isfinite(everything)
    at = v[hit] + everything[hit, None] * n[hit]
    assert_allclose(np.linalg.norm(at, axis=1), 6.3, atol=0.05)
    assert (np.einsum("ij,ij->i", at, n[hit]) > 0).all()
    inside = np.linalg.norm(v, axis=1) < 6
    assert inside.any()
    assert hit[inside].all()


# ---- data of all kinds


def test_points_accept_all_kinds_of_point_data(tmp_path):
    import pyvista
    import trimesh

    file = tmp_path / "round.ply"
    surface = ROUND.triangulated()
    cloud = pyvista.PolyData(np.array(ROUND.vertices))
    cloud.save(file)
    expected = sm.targets.Points(ROUND.vertices).gap(5.5 * OUT, OUT, 3.0)
    for value in (cloud, file, str(file), trimesh.PointCloud(np.array(ROUND.vertices)), ROUND.vertices.tolist()):
        assert_allclose(sm.targets.Points(value).gap(5.5 * OUT, OUT, 3.0), expected, atol=1e-5)
    for value in (surface, ROUND):
        made = sm.targets.Points(value)
        assert made.cloud.normals is not None
        assert_allclose(made.gap(5.5 * OUT, OUT, 3.0), 0.8, atol=0.05)
    with pytest.raises(TypeError, match="cloud must be points, not a Volume"):
        sm.targets.Points(BALL)


def test_label_surfaces_accept_all_kinds_of_volumes(tmp_path):
    import pyvista

    image = pyvista.ImageData(dimensions=LABELS.shape, origin=(-8, -8, -8))
    image.point_data["label"] = LABELS.values.ravel(order="F")
    image.save(tmp_path / "labels.vti")
    expected = sm.targets.LabelSurface(LABELS, 1).gap(5.5 * OUT, OUT, 3.0)
    for value in (image, tmp_path / "labels.vti"):
        assert_allclose(sm.targets.LabelSurface(value, 1).gap(5.5 * OUT, OUT, 3.0), expected, atol=1e-9)
    with pytest.raises(TypeError, match="volume must be a volume, not"):
        sm.targets.LabelSurface(ROUND)


# ---- precision, borders


@pytest.mark.parametrize("offset", [0.0, 1e8, -3e12])
def test_a_large_offset_of_all_values_does_not_matter(offset):
    coarse = np.round(2**6 * BALL.values) / 2**6  # so that nothing is lost in the sum
    shifted = sm.Volume(coarse + offset, origin=BALL.origin)
    plain = outer_crossings(sm.Volume(coarse, origin=BALL.origin), 0.0)
    assert len(plain) > 700
    assert_array_equal(outer_crossings(shifted, offset), plain)
    assert_allclose(sm.targets.Isosurface(shifted, offset).gap(5.0 * OUT, OUT, 3.0), 1.3, atol=0.1)


@pytest.mark.parametrize("crowded", [False, True])
def test_border_sides_belong_to_one_triangle(crowded):
    mesh = sm.sphere(4).triangulated()
    faces = np.array(mesh.faces[5:], dtype=np.int64)
    if crowded:
        faces = np.concatenate([faces, [[faces[0, 0], faces[0, 1], faces[50, 2]]]])
    edges = {}
    for face in faces.tolist():
        for j in range(3):
            key = frozenset((face[j], face[(j + 1) % 3]))
            edges[key] = edges.get(key, 0) + 1
    expected = [[edges[frozenset((f[j], f[(j + 1) % 3]))] == 1 for j in range(3)] for f in faces.tolist()]
    assert_array_equal(border_sides(faces), expected)
    assert border_sides(faces).any()


def test_triangles_give_no_gap_at_vertices_that_are_not_finite():
    ball = sm.sphere(4).triangulated()
    vertices = np.array([[np.nan, 0, 0], [0.9, 0, 0], [np.inf, 0, 0]])
    normals = np.tile([1.0, 0, 0], (3, 1))
    gaps = sm.targets.Triangles(ball).gap(vertices, normals, 1.0)
    assert np.isnan(gaps).tolist() == [True, False, True]


def test_dir_lists_the_public_names():
    assert dir(sm.targets) == ["Border", "Isosurface", "LabelSurface", "Points", "Triangles", "Union"]
    assert {"surface", "heat", "picture"} <= set(dir(sm.plot))
    assert "skin" not in dir(sm.plot)


def test_orientation_is_true_or_false():
    with pytest.raises(TypeError, match=r"^oriented must be true or false, not str 'no'$"):
        sm.targets.Triangles(sm.sphere(2), oriented="no")
