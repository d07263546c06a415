"""Models made along the sharp edges of closed triangles: exact on polyhedra, true to thin walls, bores and chamfers."""

import manifold3d
import numpy as np
import pytest
from numpy.testing import assert_allclose

import simplexmesh as sm
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.motion.creases.cut import CutSurface, cut_along
from simplexmesh.motion.creases.opening import OpenedTriangles
from simplexmesh.motion.creases.own import model_along
from simplexmesh.motion.reconstruct import pipeline
from simplexmesh.motion.targets import Triangles
from tests.nightly.marks import nightly


def triangles(solid):
    mesh = solid.to_mesh()
    return sm.TriangleMesh(mesh.vert_properties[:, :3].astype(float), mesh.tri_verts)


def cube(*sides):
    return manifold3d.Manifold.cube(sides)


def random_blocks(seed):
    """Three boxes that overlap, less one that cuts into them."""
    rng = np.random.default_rng(seed)
    first, second, third, less = (
        cube(*rng.uniform(0.6, 1.2, 3)).translate(rng.uniform(-0.4, 0.4, 3)) for _ in range(4)
    )
    return triangles((first + second + third - less.translate([0.5, 0.5, 0])).rotate([20, 30, 40]))


def cut(surface, longest):
    return cut_along(sm.feature_lines(surface), longest)


def area(mesh):
    return mesh.triangulated(method="fan").area


def made(surface, vertices):
    found = model_along(Triangles(surface), surface.sampled(20_000).points, vertices, lambda *done: None)
    assert found is not None
    return found


@pytest.mark.parametrize("seed", [*nightly(1, 2), 3, *nightly(5)])
def test_a_polyhedron_is_modeled_exactly(seed):
    """Each face is in a plane and ends on its edges and corners."""
    surface = random_blocks(seed)
    found, tangled = made(surface, 3000)
    assert tangled == tangled_vertices(found.mesh).sum() == 0
    assert abs(found.mesh.n_vertices / 3000 - 1) < 0.01
    assert found.mesh.genus == surface.genus
    assert found.mesh.volume == pytest.approx(surface.volume, rel=1e-6)
    assert area(found.mesh) == pytest.approx(surface.area, rel=1e-6)
    true = sum(line.length for line in sm.feature_lines(surface).lines)
    assert sum(line.length for line in found.creases()) == pytest.approx(true, rel=1e-3)
    used = np.unique(surface.faces)
    away = np.linalg.norm(found.mesh.vertices[:, None] - surface.vertices[used], axis=2).min(axis=0)
    assert away.max() < 0.01  # corners of four edges and more lean
    assert np.median(away) < 1e-6


@pytest.mark.parametrize("seed", [0, *nightly(11)])
def test_where_steps_are_narrower_than_faces_only_those_leave_the_lines(seed):
    surface = random_blocks(seed)
    found, tangled = made(surface, 1500)
    assert tangled == tangled_vertices(found.mesh).sum() <= 15
    assert found.mesh.volume == pytest.approx(surface.volume, rel=3e-3)
    true = sum(line.length for line in sm.feature_lines(surface).lines)
    kept = sum(line.length for line in found.creases()) / true
    assert 0.7 < kept < 1.001
    assert found.share == pytest.approx(kept)


@pytest.mark.parametrize("vertices", [800, *nightly(500)])
def test_edges_that_a_model_has_no_room_for_are_told(vertices):
    surface = random_blocks(0)
    with pytest.warns(sm.SimplexMeshWarning, match="of the sharp edges of the data") as told:
        model = sm.reconstruct(surface, vertices=vertices)
    assert bool(model.history) == (vertices == 500)  # moved, as it could not be made along them
    true = sum(line.length for line in sm.feature_lines(surface).lines)
    kept = sum(line.length for line in model.creases) / true
    assert 0.2 < kept < 0.9
    assert f"only {kept:.0%} of" in str(told[0].message)


def test_vertices_on_lines_are_joined_along_them_and_three_meet_at_corners():
    surface = triangles(cube(1, 1, 1))
    opened = OpenedTriangles(*cut(surface, 0.3).coarsened(300, np.ones(cut(surface, 0.3).surface.n_vertices)))
    mesh = opened.mesh()
    assert (mesh.genus, mesh.n_holes, len(opened.paths)) == (0, 0, 12)
    at_sides = (np.isclose(mesh.vertices, 0) | np.isclose(mesh.vertices, 1)).sum(axis=1)
    ends = np.concatenate([path.vertices[[0, -1]] for path in opened.paths])
    assert sorted(np.bincount(ends)[np.unique(ends)]) == [3] * 8
    assert (at_sides[np.unique(ends)] == 3).all()
    for path in opened.paths:
        assert (at_sides[path.vertices] >= 2).all()
        for one, other in path.steps:
            assert other in mesh.neighbors[one]


def test_a_rim_is_closed_and_a_line_that_ends_in_a_face_is_open():
    can = triangles(manifold3d.Manifold.cylinder(2, 1, circular_segments=60))
    assert [line.closed for line in made(can, 1000)[0].creases()] == [True, True]
    surface = sm.divided(triangles(cube(1, 1, 1)), 0.4)
    faces = surface.faces.astype(np.int64)
    sharp = np.zeros(faces.shape, bool)
    start, end = faces[0, 0], faces[0, 1]
    sharp |= (faces == start) & (np.roll(faces, -1, axis=1) == end)
    sharp |= (faces == end) & (np.roll(faces, -1, axis=1) == start)
    after = next(v for v in faces[(faces == end).any(axis=1)].ravel() if v not in {start, end, *faces[0]})
    sharp |= (faces == end) & (np.roll(faces, -1, axis=1) == after)
    sharp |= (faces == after) & (np.roll(faces, -1, axis=1) == end)
    middles = 0.5 * (surface.vertices[faces] + surface.vertices[np.roll(faces, -1, axis=1)])
    opened = OpenedTriangles(CutSurface(surface, sharp), middles)
    assert opened.mesh().n_vertices == surface.n_faces + 2  # two for each edge, but one at each end
    assert [path.closed for path in opened.paths] == [False]


def test_parts_are_separated_by_lines_and_narrow_ones_joined():
    block = triangles(cube(1, 1, 1).trim_by_plane([-1, -1, 0], -1.397))  # a strip 0.034 wide
    whole = cut(block, 0.2)
    assert whole.parts.max() + 1 == 7
    everywhere = np.ones(whole.surface.n_vertices, bool)
    assert whole.without_strips(everywhere, 0.02).parts.max() + 1 == 7
    assert whole.without_strips(everywhere, 0.1).parts.max() + 1 == 6
    assert whole.without_strips(~everywhere, 0.1).parts.max() + 1 == 7


def gear(teeth):
    """A gear whose ends are fans of slivers about their middles, as files of CAD have."""
    n = 4 * teeth
    i, turn, radius = np.arange(n), 2 * np.pi * np.arange(n) / n, np.tile([1, 1.1, 1.1, 1], teeth)
    rim = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn], axis=1)
    j, up = (i + 1) % n, np.array([0, 0, 0.3])
    sides = [[i, j, j + n], [i, j + n, i + n], [j, i, 0 * i + 2 * n], [i + n, j + n, 0 * i + 2 * n + 1]]
    return sm.TriangleMesh(np.vstack([rim, rim + up, 0 * up, up]), np.concatenate([np.stack(t, axis=1) for t in sides]))


@pytest.mark.parametrize("teeth", [30, *nightly(150)])
def test_a_gear_of_many_teeth_is_cut_and_opened_along_all_its_edges(monkeypatch, teeth):
    """Each part of a sliver was looked for among all slivers, and each line copied all places: minutes."""
    monkeypatch.setattr(Triangles, "closest", None)
    network = sm.feature_lines(gear(teeth))
    assert len(network.lines) == 12 * teeth
    fine = cut_along(network, 0.05)
    steps = np.diff(fine.surface.vertices[fine.ends[fine.sharp.ravel()]], axis=1)
    assert np.linalg.norm(steps, axis=2).sum() == pytest.approx(2 * sum(line.length for line in network.lines))
    whole = cut_along(network, 3.0)
    opened = OpenedTriangles(whole, whole.surface.vertices[whole.ends].mean(axis=1).reshape(-1, 3, 3))
    assert len(opened.paths) == 12 * teeth
    assert (
        opened.mesh().n_vertices == opened.count == whole.surface.n_faces + (2 * 12 + 8) * teeth
    )  # two an edge, and one a corner


@pytest.mark.parametrize("vertices", [800, *nightly(2000)])
def test_a_thin_plate_with_bores_keeps_them_its_corners_and_its_volume(vertices):
    plate = cube(100, 60, 2)
    for x, y in ((20, 20), (50, 30), (80, 40)):
        plate -= manifold3d.Manifold.cylinder(4, 5, circular_segments=48).translate([x, y, -1])
    surface = triangles(plate)
    model = sm.reconstruct(surface, vertices=vertices)
    assert model.mesh.genus == 3
    assert model.tangled == 0
    assert len(model.creases) == 12 + 6
    assert model.mesh.volume == pytest.approx(surface.volume, rel=2e-3)
    assert model.distance.data_to_mesh.max < 0.8  # the bores are polygons of a dozen sides or more
    assert model.distance.mesh_to_data.max < 0.1
    assert (model.history, model.found, model.converged) == ((), None, True)


def test_units_and_places_do_not_matter():
    surface = random_blocks(3)
    moved = sm.TriangleMesh(1e-3 * surface.vertices + [1.0, -2.0, 0.5], surface.faces)
    one, other = made(surface, 1500)[0].mesh, made(moved, 1500)[0].mesh
    assert other.volume * 1e9 == pytest.approx(one.volume, rel=1e-5)


@pytest.mark.usefixtures("coarse_starts")
def test_what_the_motion_is_told_is_not_left_out(monkeypatch):
    surface = triangles(cube(1, 1, 1))
    monkeypatch.setattr(pipeline, "sharpen", lambda run: None)
    assert sm.reconstruct(surface, vertices=300, iterations=20).history
    assert sm.reconstruct(surface, vertices=300, creases="none").creases == ()


@pytest.mark.parametrize("body", ["ball", "noisy"])
def test_smooth_and_noisy_bodies_are_fitted_by_motion(body):
    surface = sm.sphere(16).triangulated("dual")
    if body == "noisy":
        surface = sm.divided(triangles(cube(1, 1, 1)), 0.05)
        noise = np.random.default_rng(0).normal(0, 0.002, surface.vertices.shape)
        surface = sm.TriangleMesh(surface.vertices + noise, surface.faces)
    assert model_along(Triangles(surface), surface.sampled(10_000).points, 400, lambda *done: None) is None


def test_a_vertex_on_the_surface_has_no_gap_whatever_its_normal():
    surface = triangles(cube(1, 1, 1))
    on_edge = np.array([[0.5, 0.0, 0.0], [0.5, 0.5, 0.0]])
    assert_allclose(Triangles(surface).gap(on_edge, np.array([[1.0, 0, 0], [1.0, 0, 0]]), 1.0), 0.0, atol=1e-12)


def test_bodies_that_touch_themselves_and_too_few_vertices_are_fitted_by_motion():
    base = cube(1, 1, 1) + cube(2, 2, 0.5).translate([0, 0, -0.5])
    at_an_edge = triangles(base + cube(1, 1, 1).translate([1, 1, 0]))
    at_a_corner = triangles(cube(4, 4, 4) - cube(1, 1, 1).translate([1, 1, 1]) - cube(1, 1, 3).translate([2, 2, 2]))
    for surface in (at_an_edge, at_a_corner):
        welded = surface.welded(report=False)
        assert model_along(Triangles(welded), welded.sampled(10_000).points, 1000, lambda *done: None) is None
    star = [[np.cos(a) * r, np.sin(a) * r] for a, r in zip(np.linspace(0, 6.2, 48), [1, 0.7] * 24, strict=True)]
    gear = triangles(manifold3d.CrossSection([star]).extrude(0.5))
    assert model_along(Triangles(gear), gear.sampled(10_000).points, 100, lambda *done: None) is None
