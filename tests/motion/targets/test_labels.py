"""Boundaries of labeled regions: smooth and unbiased, at any spacing, orientation and thickness."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import simplexmesh as sm
from simplexmesh.data.volume import Volume
from simplexmesh.motion.targets.labels import LabelSurface, _cropped, _crossings
from simplexmesh.motion.targets.points import SurfelTarget
from tests.motion.targets import reference as naive
from tests.nightly.marks import nightly

AXES = np.array([1, np.sqrt(0.5), 0.5])


def torus(x, y, z):
    return np.hypot(np.hypot(x, y) - 1, z) - 0.35


def torus_error(points):
    return torus(*points.T)


def torus_normals(points):
    ring = points * [1, 1, 0]
    out = points - ring / np.linalg.norm(ring, axis=1)[:, None]
    return out / np.linalg.norm(out, axis=1)[:, None]


def ellipsoid(x, y, z):
    return np.sqrt((x / AXES[0]) ** 2 + (y / AXES[1]) ** 2 + (z / AXES[2]) ** 2) - 1


def ellipsoid_error(points):
    """Signed distance along the line to the center, times the cosine there: first order, enough for small ones."""
    scaled = points / AXES
    size = np.linalg.norm(scaled, axis=1)
    return (size - 1) * size / np.linalg.norm(scaled / AXES, axis=1)


def ellipsoid_normals(points):
    out = points / AXES**2
    return out / np.linalg.norm(out, axis=1)[:, None]


SHAPES = {
    "torus": (torus, np.array([1.35, 1.35, 0.35]), torus_error, torus_normals),
    "ellipsoid": (ellipsoid, AXES, ellipsoid_error, ellipsoid_normals),
}
REACHED = {("torus", 64): 0.037, ("torus", 128): 0.0145, ("ellipsoid", 64): 0.037, ("ellipsoid", 128): 0.0145}
ASKED = {("torus", 64): 0.102, ("torus", 128): 0.039, ("ellipsoid", 64): 0.067, ("ellipsoid", 128): 0.030}


def labels_of(name, size, margin=0.1):
    function, half, *_ = SHAPES[name]
    h = 2 * (half + margin).max() / (size - 1)
    shape = np.ceil(2 * (half + margin) / h).astype(int) + 1
    origin = -(shape - 1) * h / 2
    x, y, z = np.meshgrid(*(origin[a] + h * np.arange(shape[a]) for a in range(3)), indexing="ij")
    return Volume((function(x, y, z) < 0).astype(np.uint8), spacing=h, origin=origin), h


def staircase(volume):
    """Marching cubes, whose vertices are near the surface, as (vertices, faces)."""
    from skimage.measure import marching_cubes

    vertices, faces, *_ = marching_cubes(volume.values.astype(np.float32), 0.5)
    return volume.to_world(vertices.astype(float)), faces


def windowed_sinc(volume):
    """The peer: VTK's flying edges and windowed sinc, 30 passes, band 0.02."""
    pv = pytest.importorskip("pyvista")
    image = pv.ImageData(dimensions=volume.shape, spacing=volume.spacing, origin=volume.origin)
    image["labels"] = volume.values.ravel(order="F").astype(np.float32)
    surface = image.contour([0.5], scalars="labels", method="flying_edges").smooth_taubin(n_iter=30, pass_band=0.02)
    return surface.points.astype(float)


@pytest.mark.parametrize(
    ("name", "size"), [("ellipsoid", 64), ("torus", 64), *nightly(("ellipsoid", 128), ("torus", 128))]
)
def test_smooth_and_in_place(name, size):
    """Mean distance below windowed sinc's, here and in the issue; normals within 2 degrees (asked 2.5)."""
    volume, h = labels_of(name, size)
    _, half, error, true_normals = SHAPES[name]
    target = LabelSurface(volume, 1)
    vertices, _ = staircase(volume)
    for _ in range(20):
        normals = true_normals(vertices)
        vertices = vertices + 0.5 * np.nan_to_num(target.gap(vertices, normals, 2 * h))[:, None] * normals
    ours = np.abs(error(vertices)).mean() / (2 * np.linalg.norm(half)) * 100
    peer = np.abs(error(windowed_sinc(volume))).mean() / (2 * np.linalg.norm(half)) * 100
    assert ours <= peer
    assert ours <= REACHED[name, size] < ASKED[name, size]
    points, normals = target.samples()
    cosines = (normals * true_normals(points)).sum(axis=1)
    assert np.degrees(np.arccos(np.clip(cosines, -1, 1))).mean() < 2.0
    assert abs(error(vertices).mean()) < 0.3 * 0.01 * ASKED[name, size] * 2 * np.linalg.norm(half) + 0.01 * h


@given(seed=st.integers(0, 10_000))
def test_crossings_are_those_between_unlike_neighbors(seed):
    rng = np.random.default_rng(seed)
    mask = rng.uniform(size=tuple(rng.integers(2, 6, 3))) < 0.5
    mask[0, 0, 0] = True
    places, normals = _crossings(_cropped(Volume(mask), 1))
    spread = LabelSurface(Volume(mask), 1).errors(places)
    expected, axes = naive.crossings(mask)
    order, wanted = np.lexsort([*places.T]), np.lexsort([*expected.T])
    np.testing.assert_array_equal(places[order], expected[wanted])
    np.testing.assert_allclose(spread[order], np.eye(3)[axes[wanted]] / np.sqrt(12))
    np.testing.assert_allclose(normals[order], naive.outward(mask, expected, axes)[wanted], atol=1e-12)
    along = np.take_along_axis(normals, np.argmax(spread, axis=1)[:, None], axis=1)[:, 0]
    padded = np.pad(mask, 1)
    step = np.eye(3)[np.argmax(spread, axis=1)] * np.sign(along)[:, None]
    assert not padded[tuple(np.rint(places + 0.5 * step + 1).astype(int).T)].any()
    assert padded[tuple(np.rint(places - 0.5 * step + 1).astype(int).T)].all()


def test_place_and_spacing_are_physical():
    """A ball in an anisotropic, turned volume, labeled 7 among other labels."""
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    spacing, center, radius = np.array([0.5, 0.8, 1.2]), np.array([100.0, -40.0, 7.0]), 9.0
    shape = np.array([50, 32, 22])
    origin = center - turn @ (spacing * (shape - 1) / 2)
    grid = Volume(np.zeros(shape), spacing=spacing, origin=origin, direction=turn)
    world = grid.to_world(np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1))
    values = np.where(np.linalg.norm(world - center, axis=-1) < radius, 7, 3).astype(np.uint8)
    volume = Volume(values, spacing=spacing, origin=origin, direction=turn)
    places, outward = _crossings(_cropped(volume, 7))
    true = (places - center) / np.linalg.norm(places - center, axis=1)[:, None]
    assert (outward * true).sum(axis=1).mean() > 0.93
    target = LabelSurface(volume, 7)
    axis = np.abs((target.errors(places) @ turn) * np.sqrt(12) / spacing)  # a whole step along one
    np.testing.assert_allclose(np.sort(axis, axis=1), np.tile([0, 0, 1], (len(axis), 1)), atol=1e-9)
    out = np.random.default_rng(1).normal(size=(1000, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    gap = target.gap(center + 8.5 * out, out, 3.0)
    assert np.abs(gap - 0.5).mean() < 0.05
    assert np.abs(gap - 0.5).max() < 0.4
    assert np.isnan(target.gap(center + 8.5 * out, -out, 3.0)).all()


def test_sheet_of_one_voxel_has_two_sides():
    values = np.zeros((20, 20, 9), np.uint8)
    values[4:16, 4:16, 4] = 1
    target = LabelSurface(Volume(values), 1)
    middle, up = np.array([[10.0, 10, 4]]), np.array([[0, 0, 1.0]])
    np.testing.assert_allclose(target.gap(middle, up, 3.0), 0.5, atol=0.02)
    np.testing.assert_allclose(target.gap(middle, -up, 3.0), 0.5, atol=0.02)


@pytest.mark.parametrize("size", [(1, 1, 1), (1, 1, 8), (2, 1, 1)])
def test_least_regions_do_not_vanish(size):
    values = np.zeros((12, 12, 12), np.uint8)
    values[tuple(slice(4, 4 + n) for n in size)] = 1
    target = LabelSurface(Volume(values), 1)
    at = np.array([[4.0, 4, 4 + (size[2] - 1) // 2]])
    for side in ([0, 1.0, 0], [0, -1.0, 0]):
        assert 0.3 < target.gap(at, np.array([side]), 3.0)[0] < 1.5


def test_region_cut_by_the_border_is_closed_there():
    target = LabelSurface(Volume(np.ones((12, 12, 12), np.uint8)), 1)
    gap = target.gap(np.array([[5.5, 5.5, 10.5]]), np.array([[0, 0, 1.0]]), 3.0)
    assert gap[0] == pytest.approx(1.0, abs=0.02)


def box_distance(points, half):
    """Signed distance to a box around the origin."""
    beyond = np.abs(points) - half
    return np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)


@pytest.mark.parametrize("turned", [False, True])
def test_faces_end_at_their_rims(turned):
    """Of boxes, whose faces are followed to where they end: no gap ends farther off than the diagonal of a voxel."""
    half, turn = np.array([25, 20, 8]), np.eye(3)
    if turned:
        turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    grid = Volume(np.zeros((72, 72, 72)), origin=np.full(3, -35.5))
    world = grid.to_world(np.moveaxis(np.indices(grid.shape), 0, -1))
    box = Volume((np.abs(world @ turn) < half).all(axis=-1).astype(np.uint8), origin=grid.origin)
    rng = np.random.default_rng(1)
    beside = rng.uniform(-1, 1, (4000, 3)) * half * 1.2
    axis = rng.integers(0, 3, len(beside))
    beside[np.arange(len(beside)), axis] = half[axis]  # on the planes of the faces, also beyond their rims
    normals = np.eye(3)[axis] + rng.normal(scale=0.1, size=beside.shape)
    normals = normals / np.linalg.norm(normals, axis=1)[:, None] @ turn.T
    gap = LabelSurface(box).gap(beside @ turn.T, normals, 3.0)
    ends = beside + (gap[:, None] * normals) @ turn
    assert np.isfinite(gap).mean() > 0.6
    assert np.nanmax(np.abs(box_distance(ends, half))) < np.sqrt(3)


def test_midpoints_between_voxels_along_a_flat_face_are_on_it_whatever_their_normals_are():
    """They have no residuals, so no fit was trusted: near rims normals are those of rounded edges."""
    places = np.pad(np.argwhere(np.ones((40, 40))) - 19.5, ((0, 0), (0, 1)))
    errors = np.tile([0, 0, 1 / np.sqrt(12)], (len(places), 1))
    tilted = np.random.default_rng(0).normal([0, 0, 1], 0.3, places.shape)
    target = SurfelTarget(places, tilted / np.linalg.norm(tilted, axis=1)[:, None], errors)
    np.testing.assert_allclose(target.samples()[1], np.tile([0, 0, 1], (len(target.samples()[1]), 1)), atol=1e-12)


def test_model_of_a_box_has_no_fins():
    values = np.zeros((70, 60, 19), np.uint8)
    values[5:65, 5:55, 5:14] = 1
    mesh = sm.reconstruct(Volume(values, origin=(-34.5, -29.5, -9)), vertices=4000).mesh
    assert np.abs(box_distance(mesh.vertices, np.array([30, 25, 4.5]))).max() < 1.0


def test_model_of_a_noisy_ball_has_no_steps_of_voxels():
    grid = Volume(np.zeros((52, 52, 52)), origin=np.full(3, -25.5))
    far = np.linalg.norm(grid.to_world(np.moveaxis(np.indices(grid.shape), 0, -1)), axis=-1)
    noisy = far + np.random.default_rng(0).normal(scale=0.3, size=far.shape)
    mesh = sm.reconstruct(Volume((noisy < 20).astype(np.uint8), origin=grid.origin), vertices=3000).mesh
    tilts = np.arccos(np.sum(mesh.normals * mesh.vertices, axis=1) / np.linalg.norm(mesh.vertices, axis=1))
    assert np.degrees(tilts).mean() < 3


def test_no_label_means_whatever_is_not_zero():
    values = np.zeros((16, 16, 16), np.uint8)
    values[3:12, 3:12, 3:8], values[3:12, 3:12, 8:12] = 1, 2
    both = LabelSurface(Volume(values))
    one = LabelSurface(Volume((values > 0).astype(np.uint8)), 1)
    np.testing.assert_array_equal(both._surfels.table, one._surfels.table)


def test_absent_label_is_refused():
    values = np.zeros((8, 8, 8), np.uint8)
    values[2:5] = 2
    with pytest.raises(ValueError, match=r"label must be present in the volume, 5 is not; present are \[0, 2\]"):
        LabelSurface(Volume(values), 5)
    with pytest.raises(TypeError, match="label must be a number, not list"):
        LabelSurface(Volume(values), [2])
    with pytest.raises(ValueError, match="volume holds intensities"):
        LabelSurface(Volume(np.arange(512.0).reshape(8, 8, 8)), 5)
    with pytest.raises(ValueError, match="nonzero"):
        LabelSurface(Volume(np.zeros((4, 4, 4))))
