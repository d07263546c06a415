"""Signed distances along normals to isosurfaces, triangles, and unions of targets."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import gaussian_filter

import simplexmesh as sm
from simplexmesh._base.vectors import norm, normalized
from simplexmesh.motion.targets import _kernels_volume
from simplexmesh.motion.targets.triangles import inside_surface
from tests.motion import reference as reference

SEEDS = st.integers(0, 10**6)
TYPES = ("bool", "uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float32", "float64")
COMMON = ("bool", "uint8", "int16", "float64")  # the kernels of the others are compiled first


def rotation(rng):
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    return Q * np.sign(np.diag(R))


def placed(rng, field, shape=(17, 15, 13), spacing=(0.5, 0.8, 1.3)):
    """Return a volume of a function of world coordinates on a grid turned, shifted, and mirrored half of the time."""
    direction = rotation(rng)
    direction[:, 0] *= np.linalg.det(direction) * rng.choice([-1.0, 1.0])
    grid = np.moveaxis(np.indices(shape), 0, -1)
    middle = direction @ (np.array(spacing) * (np.array(shape) - 1) / 2)
    world = grid * spacing @ direction.T - middle
    return sm.Volume(field(world), spacing=spacing, origin=-middle, direction=direction)


def ball(spacing, *, radius=6.3, half=9.0):
    """Return a volume whose values are the squared distance to the sphere's center, above 0 inside."""
    count = round(2 * half / spacing) + 1
    axis = spacing * np.arange(count) - half
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    return sm.Volume(radius**2 - x * x - y * y - z * z, spacing=spacing, origin=(-half, -half, -half))


def directions(count, seed=0):
    return normalized(np.random.default_rng(seed).normal(size=(count, 3)))


# ---- isosurface


@given(seed=SEEDS)
def test_a_plane_is_found_exactly_wherever_the_volume_lies(seed):
    rng = np.random.default_rng(seed)
    slope = rng.normal(size=3)
    volume = placed(rng, lambda x: x @ slope + 0.3)
    n = normalized(-slope + 0.5 * norm(slope) * rng.normal(size=(50, 3)) / 2)
    n = n[n @ slope < -0.1]
    n = np.concatenate([n, normalized(-slope)[None]])
    vertices = rng.uniform(-1.2, 1.2, size=n.shape)
    exact = (0.1 - (vertices @ slope + 0.3)) / (n @ slope)
    gaps = sm.targets.Isosurface(volume, 0.1).gap(vertices, n, 1.0)
    assert_allclose(gaps, np.where(np.abs(exact) <= 1.0, exact, np.nan), atol=1e-9)


def test_a_ball_is_found_from_inside_and_outside():
    n = directions(500)
    radius = np.random.default_rng(1).uniform(4.5, 8.0, 500)
    gaps = sm.targets.Isosurface(ball(0.5), 0.0).gap(n * radius[:, None], n, 3.0)
    assert_allclose(gaps, 6.3 - radius, atol=0.02)
    oblique = normalized(n + 0.4 * directions(500, seed=2))
    b = (n * radius[:, None] * oblique).sum(axis=1)
    exact = -b + np.sqrt(b * b - radius**2 + 6.3**2)  # where the line leaves the ball
    clear = b > 4.0
    gaps = sm.targets.Isosurface(ball(0.5), 0.0).gap(n * radius[:, None], oblique, 8.0)
    assert clear.sum() > 200
    assert_allclose(gaps[clear], exact[clear], atol=0.03)


def test_the_error_falls_by_four_when_the_voxel_is_halved():
    n = directions(400)
    errors = []
    for spacing in (1.0, 0.5, 0.25):
        gaps = sm.targets.Isosurface(ball(spacing), 0.0).gap(6.0 * n, n, 2.0)
        errors.append(np.sqrt(np.mean((gaps - 0.3) ** 2)))
    assert errors[0] < 0.05
    assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2, atol=0.1)


def test_only_crossings_from_inside_to_outside_count():
    axis = np.arange(-12, 13.0)
    r = np.sqrt(axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2)
    shell = sm.Volume(2.0 - np.abs(r - 6.0), origin=(-12, -12, -12))  # solid between 4 and 8
    target = sm.targets.Isosurface(shell, 0.0)
    x = np.array([[1.0, 0, 0]])
    for radius, normal, reach, gap in [
        (5.0, x, 4.0, 3.0),  # within the solid, looking out
        (4.5, x, 4.0, 3.5),  # the inner wall is nearer, but the normal enters the solid there
        (5.0, -x, 4.0, 1.0),  # the wall of the cavity, whose outside is the cavity
        (9.0, x, 4.0, -1.0),  # beyond: looks back
        (3.0, -x, 4.0, -1.0),  # in the cavity: looks back
        (3.0, x, 4.0, np.nan),  # in the cavity, turned away: the wall behind is on the far side
        (3.0, x, 8.0, -7.0),
        (10.0, -x, 4.0, np.nan),
    ]:
        assert_allclose(target.gap(radius * x, normal, reach), [gap], atol=0.02)


def test_inside_below_is_inside_above_of_the_negative():
    rng = np.random.default_rng(0)
    values = gaussian_filter(rng.normal(size=(16, 17, 18)), 1.5)
    vertices, n = rng.uniform(-2, 18, size=(300, 3)), directions(300)
    below = sm.targets.Isosurface(sm.Volume(values), 0.02, inside="below").gap(vertices, n, 5.0)
    above = sm.targets.Isosurface(sm.Volume(-values), -0.02).gap(vertices, n, 5.0)
    assert np.isfinite(above).sum() > 100
    assert_allclose(below, above, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("inside", ["above", "below"])
def test_objects_cut_by_the_border_are_closed_there(axis, inside):
    sign = 1 if inside == "above" else -1
    spacing = np.array([0.5, 1.0, 2.0])
    values = sign * (np.indices((11, 11, 11))[axis] - 3.0)  # solid beyond sample 3, up to the border at sample 10
    target = sm.targets.Isosurface(sm.Volume(values, spacing=spacing), 0.0, inside=inside)
    e = np.eye(3)[axis]
    at = np.array([9.0 if k == axis else 5.0 for k in range(3)]) * spacing
    gaps = target.gap(np.stack([at, at + 5 * spacing * e, at]), np.stack([e, e, -e]), 8.0 * spacing[axis])
    border = (10.0 - 9.0) * spacing[axis]
    assert border <= gaps[0] <= border + spacing[axis]
    assert_allclose(gaps[1], gaps[0] - 5 * spacing[axis], atol=1e-3 * spacing[axis])
    assert_allclose(gaps[2], 6 * spacing[axis], atol=1e-9)


@pytest.mark.parametrize(
    ("kind", "order"),
    [
        *(pytest.param(kind, "C", marks=[pytest.mark.nightly] * (kind not in COMMON)) for kind in TYPES),
        ("uint8", "F"),
        ("float64", "F"),
    ],
)
def test_all_types_and_layouts_give_the_same_gaps(kind, order):
    rng = np.random.default_rng(3)
    smooth = gaussian_filter(rng.normal(size=(14, 12, 10)), 1.2)
    whole = (smooth > 0).astype(float) if kind == "bool" else np.round(np.clip(60 + 200 * smooth, 0, 120))
    level = 0.5 if kind == "bool" else 60.5
    vertices, n = rng.uniform(0, 10, size=(200, 3)), directions(200)
    expected = sm.targets.Isosurface(sm.Volume(whole), level).gap(vertices, n, 4.0)
    gaps = sm.targets.Isosurface(sm.Volume(np.array(whole.astype(kind), order=order)), level).gap(vertices, n, 4.0)
    assert np.isfinite(expected).sum() > 80
    assert_allclose(gaps, expected, atol=2e-4 if kind == "float32" else 1e-12)


@given(seed=SEEDS)
def test_the_interpolant_is_the_naive_one(seed):
    rng = np.random.default_rng(seed)
    volume = sm.Volume(rng.normal(size=(4, 5, 6)))
    index = rng.uniform(-2, 8, size=(100, 3))
    index[:20] = np.round(index[:20])
    field = sm.targets.Isosurface(volume, 0.0)._field
    ours = [_kernels_volume.field_value(field, tuple(at), (0.0, 0.0, 0.0), 0.0) for at in index]
    assert_allclose(ours, reference.trilinear(volume.values, index, volume.range[0]), atol=1e-12)


@pytest.mark.parametrize("inside", ["above", "below"])
def test_the_slope_is_that_of_the_interpolant(inside):
    rng = np.random.default_rng(0)
    field = sm.targets.Isosurface(sm.Volume(rng.normal(size=(4, 5, 6))), 0.1, inside=inside)._field
    known = 0
    for place, along in zip(rng.uniform(-0.7, [3.7, 4.7, 5.7], (120, 3)), rng.normal(size=(120, 3)), strict=True):
        at = tuple(place - 0.5 * along), tuple(along)
        value, slope = _kernels_volume._value_and_slope(field, *at, 0.5)
        if (place < 0).any() or (place >= [3, 4, 5]).any():
            assert np.isnan(value)
            assert np.isnan(slope)
        elif (np.abs(place - np.rint(place)) > 1e-4).all():
            known += 1
            before, here, after = (_kernels_volume.field_value(field, *at, 0.5 + step) for step in (-1e-6, 0, 1e-6))
            assert_allclose([value, slope], [here, (after - before) / 2e-6], rtol=1e-6, atol=1e-8)
    assert known > 40


@pytest.mark.parametrize("turned", [False, True])
def test_a_crossing_nearby_is_found_by_newtons_method(turned):
    """Of a field that falls by two a sample from 5 at the first, and so is 1 at the third."""
    values = np.broadcast_to((5 - 2 * np.arange(9.0))[:, None, None], (9, 4, 4)).copy()
    if turned:
        values = np.swapaxes(values, 0, 2).copy()
    field = sm.targets.Isosurface(sm.Volume(values), 1.0)._field

    def found(at, step, most):
        place, along = (at, 1.5, 1.3), (step, 0.1, 0.0)
        return _kernels_volume._nearby(field, place[::-1] if turned else place, along[::-1] if turned else along, most)

    for at in (0.5, 1.9, 2.0, 2.3, 4.0):
        assert found(at, 1.0, 2.1) == pytest.approx(2 - at, abs=1e-12)
        assert found(at, 2.0, 2.1) == pytest.approx((2 - at) / 2, abs=1e-12)
        assert np.isnan(found(at, -1.0, 2.1))  # from outside to inside
    assert np.isnan(found(0.5, 1.0, 1.4))
    assert np.isnan(found(4.0, 1.0, 1.9))
    assert np.isnan(found(8.5, 1.0, 9.0))


def test_a_line_is_within_the_volume_between_its_passages():
    rng = np.random.default_rng(1)
    field = sm.targets.Isosurface(sm.Volume(rng.normal(size=(4, 5, 6))), 0.0)._field
    misses = 0
    for place, along in zip(rng.uniform(-4, 9, (60, 3)), rng.normal(size=(60, 3)), strict=True):
        along[rng.uniform(size=3) < 0.2] = 0.0
        far = np.linspace(-9, 9, 1201)
        at = place + far[:, None] * along
        within = ((at > -1) & (at < [4, 5, 6])).all(axis=1)
        first, last = _kernels_volume._passage(field.ni, field.nj, field.nk, tuple(place), tuple(along))
        expected = (far > first + 1e-9) & (far < last - 1e-9)
        assert (within == expected).mean() > 0.998
        misses += not within.any()
    assert 5 < misses < 55


@given(seed=SEEDS)
@settings(max_examples=10)
def test_the_search_finds_what_fine_sampling_finds(seed):
    rng = np.random.default_rng(seed)
    field = gaussian_filter(rng.normal(size=(17, 15, 13)), 2.0)
    volume = placed(rng, lambda x: field / field.std(), spacing=(0.5, 0.6, 0.7))
    target = sm.targets.Isosurface(volume, 0.2)
    vertices, n = rng.uniform(-5, 5, size=(60, 3)), directions(60, seed)
    gaps = target.gap(vertices, n, 2.0)
    at = vertices + np.where(np.isnan(gaps), 0.0, gaps)[:, None] * n
    residual = reference.trilinear(volume.values, volume.to_index(at), volume.range[0]) - 0.2
    assert np.abs(residual[np.isfinite(gaps)]).max(initial=0) < 5e-3
    naive = np.array(
        [reference.isosurface_gap(volume, 0.2, v, n[k], 2.0, samples=4001) for k, v in enumerate(vertices)]
    )
    both = np.isfinite(gaps) & np.isfinite(naive)
    assert not (np.isfinite(gaps) & np.isnan(naive)).any()
    assert (np.abs(gaps) >= np.abs(naive) - 2e-3)[both].all()  # nothing is nearer than the nearest
    same = (np.abs(gaps - naive) < 5e-3) | (np.isnan(gaps) & np.isnan(naive))
    # what is passed over is thinner than the stride, along the normal
    for k in np.flatnonzero(~same):
        stride = 0.7 / np.abs(volume.to_index(n[k]) - volume.to_index(np.zeros(3))).max()
        depth = np.abs(naive[k]) + np.linspace(0.002, stride, 200)
        beyond = vertices[k] + np.sign(naive[k]) * depth[:, None] * n[k]
        value = reference.trilinear(volume.values, volume.to_index(beyond), volume.range[0]) - 0.2
        here = reference.trilinear(volume.values, volume.to_index(vertices[k : k + 1]), volume.range[0]) - 0.2
        assert ((value > 0) == (here > 0)).any() or np.abs(naive[k]) > 1.5
    assert same.mean() > 0.9


@pytest.mark.parametrize(
    ("level", "options", "error", "message"),
    [
        (200.0, {}, ValueError, "level must be above 0 and below 7, the range of the volume, not 200"),
        (0.0, {}, ValueError, "level must be above 0 and below 7, the range of the volume, not 0"),
        (np.nan, {}, ValueError, "level must be finite, not nan"),
        ("skin", {}, TypeError, "level must be a number, not str"),
        (3.0, {"inside": "left"}, ValueError, "inside must be one of 'above', 'below', not 'left'"),
    ],
)
def test_wrong_levels_are_named(level, options, error, message):
    with pytest.raises(error, match=message):
        sm.targets.Isosurface(sm.Volume(np.arange(8.0).reshape(2, 2, 2)), level, **options)


def test_a_vertex_without_a_normal_has_no_gap():
    gaps = sm.targets.Isosurface(ball(1.0), 0.0).gap(np.array([[6.0, 0, 0]]), np.zeros((1, 3)), 3.0)
    assert np.isnan(gaps).all()


def test_a_mesh_finds_the_ball_in_the_volume():
    volume = ball(0.5)
    start = sm.sphere(8, radius=4.0, center=(0.5, -0.3, 0.2))
    model = sm.DeformableModel(start, sm.targets.Isosurface(volume, 0.0), reach=4.0)
    states = list(model.run(150))
    assert states[-1].reached == 1.0
    assert states[-1].move < 1e-3
    assert_allclose(norm(model.mesh.vertices), 6.3, atol=0.03)


# ---- triangles


def square(height=0.0, *, up=True, size=1.0):
    corners = np.array([[0, 0, height], [size, 0, height], [size, size, height], [0, size, height]], dtype=float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return corners, faces if up else faces[:, ::-1]


def joined(*parts):
    offsets = np.cumsum([0] + [len(v) for v, _ in parts[:-1]])
    return sm.TriangleMesh(
        np.concatenate([v for v, _ in parts]), np.concatenate([f + k for (_, f), k in zip(parts, offsets, strict=True)])
    )


@given(seed=SEEDS)
def test_a_triangulated_plane_is_at_its_distance(seed):
    rng = np.random.default_rng(seed)
    Q, t = rotation(rng), rng.normal(size=3)
    corners, faces = square()
    faces = faces if np.linalg.det(Q) > 0 else faces[:, ::-1]  # the mirror turns the square over
    target = sm.targets.Triangles(sm.TriangleMesh(corners @ Q.T + t, faces))
    z = rng.uniform(-1, 1, 20)
    local = np.c_[rng.uniform(0.05, 0.95, (20, 2)), z]
    tilt = normalized(np.c_[0.3 * rng.normal(size=(20, 2)), np.ones(20)])
    gaps = target.gap(local @ Q.T + t, tilt @ Q.T, 0.5)
    assert_allclose(gaps, np.where(np.abs(z) <= 0.5, -z * tilt[:, 2], np.nan), atol=1e-9)


def test_a_triangulated_ball_is_at_its_distance():
    fine = sm.sphere(20).triangulated()
    n = directions(300)
    radius = np.random.default_rng(0).uniform(0.8, 1.2, 300)
    gaps = sm.targets.Triangles(fine).gap(n * radius[:, None], n, 0.5)
    assert_allclose(gaps, 1 - radius, atol=2e-3)


def test_how_deep_points_are_in_a_body_and_beside_it():
    ball = sm.targets.Triangles(sm.sphere(20).triangulated())
    n = directions(300)
    radius = np.random.default_rng(0).uniform(0.2, 1.5, 300)
    assert_allclose(ball.depths(n * radius[:, None]), (1 - radius) / 2, atol=0.02)
    assert np.isnan(sm.targets.Triangles(sm.TriangleMesh(*square())).depths(np.array([[0.4, 0.3, 0.1]])))


def test_inside_of_an_open_ball_is_what_most_of_it_surrounds():
    """The winding number is the share of all directions that meet the surface: 0.35 or 0.65 at the center."""
    ball = sm.sphere(12).triangulated("dual")
    up = ball.vertices[ball.faces][:, :, 2].mean(axis=1)
    faces = ball.faces[up < 0.3]
    for turned, inside in ((faces, True), (faces[:, ::-1], False)):
        assert inside_surface(np.zeros((1, 3)), ball.vertices, turned).tolist() == [inside]
    assert inside_surface(np.zeros((1, 3)), ball.vertices, ball.faces[up >= 0.3]).tolist() == [False]


def test_the_far_wall_of_a_thin_sheet_does_not_attract():
    sheet = joined(square(0.1), square(0.0, up=False))
    target = sm.targets.Triangles(sheet)
    up = np.array([[0.0, 0, 1.0]])
    at = np.array([[0.4, 0.3, 0.12]])
    assert_allclose(target.gap(at, up, 1.0), -0.02)
    assert_allclose(target.gap(at - [0, 0, 0.05], up, 1.0), 0.03)
    assert np.isnan(target.gap(at - [0, 0, 0.11], up, 1.0)).all()  # nearest to the bottom, which faces down
    assert_allclose(target.gap(at - [0, 0, 0.11], -up, 1.0), 0.01)
    assert_allclose(sm.targets.Triangles(sheet, oriented=False).gap(at - [0, 0, 0.11], up, 1.0), -0.01)


def test_corners_attract_from_all_around():
    cube = sm.sphere(2, base="octahedron")  # 32 vertices; its dual triangles have sharp corners
    target = sm.targets.Triangles(cube.triangulated("dual"))
    corners = target.vertices
    n = normalized(corners)
    assert_allclose(target.gap(1.1 * corners, n, 1.0), -0.1 * norm(corners), atol=1e-9)


def test_reach_is_the_distance_to_the_surface():
    target = sm.targets.Triangles(sm.TriangleMesh(*square()))
    up = np.array([[0.0, 0, 1.0]])
    assert_array_equal(np.isnan(target.gap(np.array([[0.5, 0.2, 0.3]]), up, 0.29)), [True])
    assert_array_equal(np.isnan(target.gap(np.array([[0.5, 0.2, 0.3]]), up, 0.31)), [False])


# ---- several at once


class Fixed:
    def __init__(self, *gaps):
        self.gaps = np.array(gaps, dtype=float)

    def gap(self, vertices, normals, reach):
        return np.where(np.abs(self.gaps) <= reach, self.gaps, np.nan)


def test_of_several_targets_the_nearest_wins():
    nan = np.nan
    targets = [Fixed(0.5, -0.1, nan, nan), Fixed(-0.2, 0.3, -0.7, nan), Fixed(3.0, 3.0, 3.0, 3.0)]
    nothing = np.zeros((4, 3))
    for order in ([0, 1, 2], [2, 0, 1], [1, 2, 0]):
        gaps = sm.targets.Union([targets[k] for k in order]).gap(nothing, nothing, 1.0)
        assert_array_equal(gaps, [-0.2, -0.1, -0.7, nan])
    assert_array_equal(sm.targets.Union(targets).gap(nothing, nothing, 5.0), [-0.2, -0.1, -0.7, 3.0])
    assert_array_equal(sm.targets.Union(targets[:1]).gap(nothing, nothing, 1.0), targets[0].gap(0, 0, 1.0))


def test_a_union_of_a_volume_and_a_scan():
    scan = sm.targets.Triangles(sm.TriangleMesh(*square(7.0, size=1.0)))
    both = sm.targets.Union([sm.targets.Isosurface(ball(0.5), 0.0), scan])
    up = np.array([[0.0, 0.0, 1.0]] * 2)
    gaps = both.gap(np.array([[0.05, 0.02, 6.2], [0.05, 0.02, 6.9]]), up, 2.0)
    assert_allclose(gaps, [0.1, 0.1], atol=0.02)


@pytest.mark.parametrize(
    ("targets", "error", "message"),
    [
        ([], ValueError, "targets must be at least one, not none"),
        ([Fixed(1.0), 3.0], TypeError, r"targets\[1\] must have a method gap\(vertices, normals, reach\), not float"),
    ],
)
def test_wrong_unions_are_named(targets, error, message):
    with pytest.raises(error, match=message):
        sm.targets.Union(targets)
