"""Components, cavities and tunnels of voxel solids, and surfaces of the same topology."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage
from skimage.measure import marching_cubes

from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.manifold import half_edge_mates
from simplexmesh.mesh.shapes import sphere
from simplexmesh.motion.start import _kernels_remesh
from simplexmesh.motion.start.solid_mesh import decimated, isosurface, relaxed, subdivided
from simplexmesh.motion.start.topology import (
    closed,
    euler,
    genus,
    pieces,
    pinched,
    thickened,
    thinned,
    within,
    without_cavities,
    without_tunnels,
)

X, Y, Z = np.indices((40, 40, 30)) - np.array([19.5, 19.5, 14.5]).reshape(3, 1, 1, 1)
BALL = X**2 + Y**2 + Z**2 < 12**2
TORUS = (np.hypot(X, Y) - 11) ** 2 + Z**2 < 5**2
DRILLED = BALL & (np.hypot(X, Y) > 2.5)


@pytest.mark.parametrize(
    ("solid", "tunnels"), [(BALL, 0), (TORUS, 1), (DRILLED, 1), (DRILLED & (np.hypot(X, Z) > 2.5), 3)]
)
def test_tunnels_are_counted(solid, tunnels):
    assert genus(solid) == tunnels


def test_two_bodies_have_the_tunnels_of_both():
    assert genus(np.concatenate([TORUS, BALL, DRILLED])) == 2


def test_cavities_are_filled_and_pits_are_not():
    hollow = BALL & (X**2 + Y**2 + Z**2 > 6**2)
    assert euler(hollow) == 2
    assert np.array_equal(without_cavities(hollow), BALL)
    pitted = hollow & ~((np.hypot(X, Y) < 2) & (Z > 0))
    assert np.array_equal(without_cavities(pitted), pitted)


def test_largest_component_and_all():
    both = np.concatenate([BALL, np.pad(BALL[14:26], ((14, 14), (0, 0), (0, 0)))])
    both[0, 0, 0] = True
    assert np.array_equal(pieces(both)[0][:40], BALL)
    assert pieces(both)[1] == 2
    kept, dropped = pieces(both, "all", 2)
    assert dropped == 1
    assert ndimage.label(kept)[1] == 2


def test_a_narrow_tunnel_is_sealed_and_a_wide_one_kept():
    out, sealed = without_tunnels(DRILLED, 4.0)
    assert (genus(out), sealed) == (0, 1)
    assert DRILLED.sum() < out.sum() < BALL.sum()  # a membrane, not a plug
    out, sealed = without_tunnels(TORUS, 4.0)
    assert (genus(out), sealed) == (1, 0)
    assert np.array_equal(out, TORUS)


@pytest.mark.parametrize("seed", range(3))
def test_closing_never_adds_pieces(seed):
    rng = np.random.default_rng(seed)
    solid = np.pad(pieces(ndimage.gaussian_filter(rng.normal(size=(20, 20, 20)), 0.8) > 0.12)[0], 6)
    assert ndimage.label(closed(solid, 1.5))[1] == 1


def test_thinning_preserves_the_topology_and_the_cells_to_keep():
    out = thinned(BALL, DRILLED)
    assert genus(out) == 0
    assert out[DRILLED].all()
    assert not out[~BALL].any()
    assert np.array_equal(thinned(TORUS, np.zeros_like(TORUS)).sum() > 0, True)
    assert genus(thinned(TORUS, np.zeros_like(TORUS))) == 1  # thinned to a ring


@given(st.integers(0, 2**32 - 1))
def test_the_surface_has_the_topology_of_the_solid_whatever_the_field(seed):
    rng = np.random.default_rng(seed)
    solid = np.pad(ndimage.gaussian_filter(rng.normal(size=(9, 9, 9)), 0.7) > rng.uniform(-0.2, 0.2), 1)
    vertices, faces = isosurface(rng.normal(size=solid.shape), solid)
    assert len(np.unique(faces)) - len(faces) // 2 == 2 * euler(solid)
    if solid.any():
        finer = isosurface(rng.normal(size=solid.shape), solid, 3 * len(faces))[1]
        assert len(finer) >= 3 * len(faces)
        assert len(np.unique(finer)) - len(finer) // 2 == 2 * euler(solid)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        cells = np.argwhere(solid)
        assert (np.abs(low - cells.min(axis=0) + 0.5) <= 0.5).all()
        assert (np.abs(high - cells.max(axis=0) - 0.5) <= 0.5).all()


def test_subdivision_keeps_the_surface():
    vertices, faces = isosurface(np.where(TORUS, 1.0, -1.0), TORUS)
    finer = subdivided(vertices, faces)
    assert len(finer[1]) == 4 * len(faces)
    assert np.isclose(dual(finer).genus, 1)
    volume = [
        np.einsum("ij,ij->", v[f[:, 0]], np.cross(v[f[:, 1]], v[f[:, 2]])) / 6 for v, f in ((vertices, faces), finer)
    ]
    assert np.isclose(*volume)


def test_decimation_and_relaxation_keep_topology_and_even_out_the_triangles():
    field = 5 - np.sqrt((np.hypot(X, Y) - 11) ** 2 + Z**2)
    vertices, faces = isosurface(field, field > 0)
    vertices, faces = decimated(vertices, faces, 1500)
    assert len(faces) == 1500
    before, after = dual((vertices, faces)), dual(relaxed(vertices, faces))
    assert before.genus == after.genus == 1
    regular = [np.isin(mesh.connectivity.face_sizes, (5, 6, 7)).mean() for mesh in (before, after)]
    assert regular[1] > max(regular[0], 0.98)
    assert after.check(self_intersections=True)
    radius = np.hypot(
        np.hypot(after.vertices[:, 0] - 19.5, after.vertices[:, 1] - 19.5) - 11, after.vertices[:, 2] - 14.5
    )
    assert np.abs(radius - 5).max() < 0.7


@pytest.mark.parametrize("triangles", [600, 100, 10])
def test_decimation_leaves_a_tetrahedron_of_a_small_piece(triangles):
    ball = sphere(4).triangulated()
    small = sphere(1, base="tetrahedron", radius=0.01, center=(3, 0, 0)).triangulated()
    vertices = np.concatenate([ball.vertices, small.vertices])
    faces = np.concatenate([ball.faces, small.faces + len(ball.vertices)])
    mesh = dual(decimated(vertices, faces, triangles))
    assert (mesh.genus, mesh.n_holes, mesh.n_components) == (0, 0, 2)
    assert mesh.n_vertices == max(triangles, 8)


def test_decimation_passes_over_triangles_without_area():
    """A level through the samples of a grid gives many; the ball stays a ball."""
    axis = np.arange(-8, 9.0)
    ball = 5.0 - np.abs(axis[:, None, None]) - np.abs(axis[:, None]) - np.abs(axis)
    faces = marching_cubes(ball, 0.0, gradient_direction="ascent", allow_degenerate=True)[:2]
    sides = faces[0][faces[1]]
    flat = np.linalg.norm(np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0]), axis=1) == 0
    assert flat.sum() > 10
    vertices, corners = faces[0].astype(float), faces[1].astype(np.int64).ravel()
    mates = np.array(half_edge_mates(faces[1]), np.int64).ravel()
    assert _kernels_remesh.collapse_shortest(vertices, corners, mates, 200, 0.5) == 200
    left = np.flatnonzero(corners.reshape(-1, 3)[:, 0] >= 0)
    used, left = np.unique(corners.reshape(-1, 3)[left], return_inverse=True)
    assert dual((vertices[used], left.reshape(-1, 3))).volume > 0.9 * 4 / 3 * 5**3


def test_thickening_widens_a_sheet_near_the_places_only_and_adds_no_components():
    sheet = np.zeros((20, 20, 12), bool)
    sheet[3:17, 3:17, 6] = True
    out = thickened(sheet, np.array([[5, 5, 6]]), 2)
    assert out[sheet].all()
    assert out[5, 5].sum() == 3
    assert np.array_equal(out[9:], sheet[9:])
    assert genus(out) == 0


@pytest.mark.parametrize(("inner", "filled"), [(10, False), (4, True)])
def test_thickening_does_not_shut_the_opening_of_a_hollow(inner, filled):
    box = np.zeros((24, 24, 24), bool)
    box[6 : 8 + inner, 6 : 8 + inner, 6 : 8 + inner] = True
    box[7 : 7 + inner, 7 : 7 + inner, 7 : 7 + inner] = False
    box[9, 9, 6] = False
    out = thickened(box, np.array([[9, 9, 6]]), 3)
    assert out[box].all()
    assert out[9, 9, 9] == filled
    assert np.array_equal(without_cavities(out), out)


@given(st.integers(0, 2**32 - 1))
def test_thickening_everywhere_leaves_no_thin_cell_no_new_piece_and_an_empty_border(seed):
    rng = np.random.default_rng(seed)
    solid = np.pad(ndimage.gaussian_filter(rng.normal(size=(9, 9, 9)), 0.7) > 0.2, 3)
    if not solid.any():
        return
    out = thickened(solid, np.argwhere(solid), 3)
    assert out[solid].all()
    assert ndimage.label(out)[1] <= ndimage.label(solid)[1]
    border = np.ones(solid.shape, bool)
    border[1:-1, 1:-1, 1:-1] = False
    assert not out[border].any()
    block = ndimage.binary_opening(out, np.ones((2, 2, 2)))
    assert block[solid].all()


def test_thickening_leaves_the_outermost_cells_of_the_grid_free():
    solid = np.zeros((6, 6, 6), bool)
    solid[1:5, 1:5, 1:5] = True
    assert np.array_equal(thickened(solid, np.argwhere(solid), 1), solid)


def test_where_cells_touch_along_an_edge_they_are_pinched():
    solid = np.zeros((6, 6, 6), bool)
    solid[2, 2, 2] = solid[3, 3, 2] = True
    assert pinched(solid)[2:4, 2:4, 2].all()
    solid[2, 3, 2] = True
    assert not pinched(solid).any()


@given(st.integers(0, 2**32 - 1), st.floats(0.2, 0.98), st.booleans())
def test_cavities_are_the_components_of_the_outside_not_connected_to_what_is_around(seed, share, padded):
    solid = np.pad(np.random.default_rng(seed).random((6, 7, 8)) < share, int(padded))
    label, _ = ndimage.label(~np.pad(solid, 1), np.ones((3, 3, 3)))
    assert np.array_equal(without_cavities(solid), (label != label[0, 0, 0])[1:-1, 1:-1, 1:-1])


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.2), st.floats(0.5, 9.0) | st.integers(1, 80).map(np.sqrt))
def test_within_agrees_with_the_distance_transform(seed, share, radius):
    cells = np.random.default_rng(seed).random((9, 12, 7)) < share
    cells[seed % 9, seed % 12, seed % 7] = True
    assert np.array_equal(within(cells, radius), ndimage.distance_transform_edt(~cells) ** 2 <= radius**2 + 1e-9)
