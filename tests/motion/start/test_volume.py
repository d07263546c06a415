"""Automatic initialization from volumes: topology, vertex budget, position, bad input."""

from contextlib import nullcontext

import numpy as np
import pytest
from scipy import ndimage

from simplexmesh import Volume, read_volume, reconstruct, sphere
from simplexmesh._base.errors import SimplexMeshWarning, TopologyError
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.motion.start import from_volume, solid_mesh
from simplexmesh.motion.start.from_volume import start_from_volume
from tests.nightly.marks import nightly

SPACING, ORIGIN = np.array([0.06, 0.05, 0.09]), np.array([3.0, -2.0, 10.0])
TURN = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]


def torus_field(direction, shape=(72, 84, 40)):
    """Distance into a torus of radii 1 and 0.4 about the middle of the grid, and that middle."""
    volume = Volume(np.zeros(shape), SPACING, ORIGIN, direction)
    middle = volume.to_world((np.array(shape) - 1) / 2)
    at = volume.to_world(np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)) - middle
    return Volume(inside_torus(at), SPACING, ORIGIN, direction), middle


def inside_torus(at):
    return 0.4 - np.hypot(np.hypot(at[..., 0], at[..., 1]) - 1, at[..., 2])


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("masked", [False, True])
def test_a_torus_is_at_its_physical_position_with_normals_outwards(sign, masked):
    direction = np.diag([sign, 1, 1])
    volume, middle = torus_field(direction)
    if masked:
        start = start_from_volume(Volume(volume.values > 0, SPACING, ORIGIN, direction), label=1, vertices=2000)
    else:
        start = start_from_volume(volume, level=0.0, vertices=2000)
    mesh = start.mesh
    assert (mesh.n_vertices, mesh.genus, mesh.n_holes, mesh.n_components) == (2000, 1, 0, 1)
    assert np.abs(inside_torus(mesh.vertices - middle)).max() < start.report.cell
    assert np.abs(inside_torus(mesh.vertices - middle)).mean() < 0.2 * start.report.cell
    assert np.isclose(mesh.volume, 2 * np.pi**2 * 0.4**2, rtol=0.12)  # centroids of triangles lie inside
    assert (np.abs(mesh.bounds - middle - np.array([[-1.4, -1.4, -0.4], [1.4, 1.4, 0.4]])) < start.report.cell).all()
    assert mesh.check(self_intersections=True)
    sizes = mesh.connectivity.face_sizes
    assert np.isin(sizes, (5, 6, 7)).mean() > 0.98


def test_rotated_axes_rotate_the_mesh():
    shape = (40, 44, 48)
    values = 15 - np.sqrt(sum((x - 20 - i) ** 2 for i, x in enumerate(np.indices(shape))))
    straight = start_from_volume(Volume(values), level=0.0, vertices=400).mesh
    turned = start_from_volume(Volume(values, direction=TURN, origin=ORIGIN), level=0.0, vertices=400).mesh
    assert np.isclose(turned.volume, straight.volume, rtol=1e-3)
    assert np.allclose(turned.vertices.mean(axis=0), straight.vertices.mean(axis=0) @ TURN.T + ORIGIN, atol=0.3)


@pytest.mark.parametrize("vertices", [20, 200, 1001, 30_000])
def test_the_budget_is_kept(vertices):
    volume, _ = torus_field(np.eye(3))
    mesh = start_from_volume(volume, level=0.0, vertices=vertices).mesh
    assert abs(mesh.n_vertices - vertices) <= max(1, 0.02 * vertices)
    assert mesh.genus <= 1


def test_bodies_at_the_border_are_closed_there():
    values = np.ones((30, 30, 30))
    values[15:] = 0
    mesh = start_from_volume(Volume(values), level=0.5, vertices=600).mesh
    assert (mesh.genus, mesh.n_holes) == (0, 0)
    assert np.isclose(mesh.volume, 15 * 30 * 30, rtol=0.1)


def test_cavities_are_filled_small_pieces_dropped_and_narrow_tunnels_sealed():
    x, y, z = np.indices((60, 60, 60)) - 29.5
    ball = np.sqrt(x**2 + y**2 + z**2)
    body = (ball < 22) & (ball > 8) & ((np.hypot(x, y) > 2) | (z < 0))
    body[2:6, 2:6, 2:6] = True
    start = start_from_volume(Volume(body), label=1, vertices=1500, tunnels=8.0)
    assert (start.mesh.genus, start.mesh.n_components, start.report.components_dropped) == (0, 1, 1)
    assert np.isclose(start.mesh.volume, 4 / 3 * np.pi * 22**3, rtol=0.1)
    through = (ball < 22) & (np.hypot(x, y) > 3)
    assert start_from_volume(Volume(through), label=1, vertices=1500, tunnels=12.0).report.tunnels_removed == 1
    assert start_from_volume(Volume(through), label=1, vertices=1500, tunnels=0.0).mesh.genus == 1


@pytest.mark.filterwarnings("ignore:filled cavities")
@pytest.mark.parametrize(("wall", "given"), [(1.8, {"label": 1}), (2.5, {"label": 1}), (2.5, {"level": 0.0})])
def test_a_cavity_within_a_thin_wall_is_filled_on_any_cells(wall, given):
    """Smoothed to other cells the wall had holes, so that the cavity stayed and the model got up to 259 tunnels."""
    x, y, z = np.indices((50, 50, 50)) - 24.5
    inside = wall / 2 - np.abs(np.sqrt(x**2 + y**2 + z**2) - 19.6)
    volume = Volume(inside > 0 if "label" in given else inside.clip(-2, 2))
    start = start_from_volume(volume, vertices=3000, **given)
    assert (start.mesh.genus, start.mesh.n_components) == (0, 1)
    assert np.isclose(start.mesh.volume, 4 / 3 * np.pi * (19.6 + wall / 2) ** 3, rtol=0.1)


def test_all_components():
    values = np.concatenate([torus_field(np.eye(3))[0].values] * 2)
    start = start_from_volume(Volume(values, SPACING), level=0.0, vertices=3000, components="all")
    assert (start.mesh.n_components, start.mesh.genus, start.mesh.n_vertices) == (2, 2, 3000)
    assert start_from_volume(Volume(values, SPACING), level=0.0, vertices=3000).mesh.n_components == 1


def test_a_thin_body_is_not_smoothed_away():
    values = np.zeros((40, 40, 40))
    values[5:35, 19:21, 19:21] = 1
    mesh = start_from_volume(Volume(values), label=1, vertices=300).mesh
    assert mesh.genus == 0
    assert np.ptp(mesh.bounds[:, 0]) > 27


def shell(seed):
    """Return the labels of a bowl with a wall of two voxels and ragged pinholes in it."""
    rng = np.random.default_rng(seed)
    x, y, z = np.indices((56, 56, 56)) - 27.5
    far = np.sqrt(x**2 + y**2 + z**2) + 0.5 * ndimage.gaussian_filter(rng.normal(size=x.shape), 1.0)
    wall = (far > 20) & (far < 22) & (z < 12)
    holes = rng.normal(size=(20, 3))
    holes *= 21 / np.linalg.norm(holes, axis=1)[:, None]
    for hole in holes:
        wall &= (x - hole[0]) ** 2 + (y - hole[1]) ** 2 + (z - hole[2]) ** 2 > rng.uniform(1, 6)
    return wall


def rods(seed):
    """Return the labels of a bundle of crossing rods one and a half voxels thick."""
    rng = np.random.default_rng(seed)
    at = np.stack(np.indices((50, 50, 50)), axis=-1) - 24.5
    solid = np.zeros(at.shape[:3], bool)
    for _ in range(12):
        along = rng.normal(size=3)
        along /= np.linalg.norm(along)
        off = at - rng.uniform(-6, 6, 3)
        solid |= np.linalg.norm(off - (off @ along)[..., None] * along, axis=-1) < 1.5
    return solid & (np.linalg.norm(at, axis=-1) < 22)


@pytest.mark.parametrize(("body", "vertices"), [*nightly((shell, 8000)), (rods, 4000)])
@pytest.mark.parametrize("seed", [0, *nightly(1)])
def test_thin_bodies_start_and_end_untangled_and_close_to_their_labels(body, vertices, seed):
    volume = Volume(body(seed).astype(np.uint8))
    out = reconstruct(volume, label=1, vertices=vertices, tunnels=0.0)
    assert out.start.check(self_intersections=True)
    assert out.tangled == 0
    assert out.mesh.n_components == 1
    assert out.distance.mesh_to_data.rms < 0.25


@pytest.mark.parametrize(("body", "seed"), [(shell, 2), (rods, 0), *nightly((shell, 3), (rods, 1))])
def test_a_start_is_thickened_where_it_would_cross_itself_and_has_to_be(body, seed, monkeypatch):
    volume = Volume(body(seed).astype(np.uint8))
    thick = start_from_volume(volume, label=1, vertices=1000, tunnels=0.0).mesh
    monkeypatch.setattr(solid_mesh, "THICKENINGS", 0)
    thin = start_from_volume(volume, label=1, vertices=1000, tunnels=0.0).mesh
    assert tangled_vertices(thin).any()
    assert not tangled_vertices(thick).any()


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "level", "vertices"),
    [("head_ct.mhd", 500, 3000), ("head_ct.mhd", 500, 20_000), ("head_mr.mhd", 10, 4000), ("tooth.nhdr", 600, 4000)],
)
def test_organs_are_balls(data_folder, name, level, vertices):
    """Of the head if the passages of the nose are sealed, which 20,000 vertices resolve."""
    volume = read_volume(data_folder / name)
    tunnels = 40.0 if vertices == 20_000 else None
    mesh = start_from_volume(volume, level=level, vertices=vertices, tunnels=tunnels).mesh
    assert (mesh.n_vertices, mesh.genus, mesh.n_holes, mesh.n_components) == (vertices, 0, 0, 1)
    assert mesh.volume > 0
    assert mesh.check(self_intersections=True)
    margin = 2 * volume.spacing
    assert (mesh.bounds[0] > volume.bounds[0] - margin).all()
    assert (mesh.bounds[1] < volume.bounds[1] + margin).all()


def test_a_large_offset_of_the_values_changes_nothing():
    """Single precision would leave steps of 8 at 1e8, twenty times what the torus is thick."""
    volume, _ = torus_field(None)
    start = start_from_volume(volume, level=0.0, vertices=1000)
    shifted = Volume(volume.values + 1e8, SPACING, ORIGIN)
    moved = start_from_volume(shifted, level=1e8, vertices=1000)
    np.testing.assert_allclose(moved.mesh.vertices, start.mesh.vertices, atol=1e-5)


@pytest.mark.parametrize("label", [1, None])
def test_plates_and_rods_one_voxel_thick_are_not_refused(label):
    solid = np.zeros((40, 24, 24), np.int64)
    solid[4:36, 4:20, 12] = 1
    rod = np.zeros((40, 24, 24), np.int64)
    rod[4:36, 12, 12] = 1
    for values, volume, refined in ((solid, 32 * 16, False), (rod, 32, True)):
        data = Volume(values, spacing=0.1) if label else Volume(values.astype(float), spacing=0.1)
        with pytest.warns(SimplexMeshWarning, match="a voxel or two thick") if label and refined else nullcontext():
            start = start_from_volume(data, None if label else 0.5, label, 1500)
        assert start.mesh.genus == 0
        assert 0.2 * volume < start.mesh.volume / 0.1**3 < 2 * volume
        assert np.ptp(start.mesh.vertices[:, 0]) > 3.0


def test_a_single_voxel_is_refused_without_advice_that_does_not_help():
    values = np.zeros((5, 5, 5), np.int64)
    values[2, 2, 2] = 1
    with pytest.raises(TopologyError, match=r"too thin for a grid of .* the finest possible"):
        start_from_volume(Volume(values), None, 1, 100)


@pytest.mark.parametrize("name", ["level", "label"])
def test_another_piece_at_the_corner_of_the_box_does_not_fill_what_is_around(name, monkeypatch):
    """The surface of a solid that reaches the end of its grid is open, and its decimation would never end."""
    fields = []
    monkeypatch.setattr(from_volume, "solid_mesh", lambda field, *rest: fields.append(field) or (sphere(4), rest[0]))
    at = np.mgrid[-15:16, -15:16, -15:16]
    values = ((at**2).sum(axis=0) < 6.5**2).astype(np.uint8)
    values[5:8, 5:8, 5:8] = 1
    start_from_volume(Volume(values), **{name: 0.5 if name == "level" else 1}, vertices=500)
    assert all(fields[0].take(-1, axis).max() < 0 for axis in range(3))
