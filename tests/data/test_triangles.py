"""Triangle meshes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh._base.errors import SimplexMeshWarning
from simplexmesh.data.io.polygons import fans
from simplexmesh.data.triangles import TriangleMesh

CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], float)
BOX = fans(
    np.full(6, 4),
    np.array([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]),
)


@pytest.fixture
def box():
    return TriangleMesh(CORNERS * [1, 2, 3], BOX)


def torn(mesh):
    """The same surface with corners of its own for every triangle, as in STL files."""
    return TriangleMesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * mesh.n_faces).reshape(-1, 3))


class TestMeasures:
    def test_box(self, box):
        assert box.area == pytest.approx(22)
        assert box.volume == pytest.approx(6)
        assert box.is_closed
        assert box.diagonal == pytest.approx(np.sqrt(14))

    def test_turned_inside_out(self, box):
        inside_out = TriangleMesh(box.vertices, box.faces[:, ::-1])
        assert inside_out.volume == pytest.approx(-6)
        assert inside_out.is_closed

    def test_volume_does_not_depend_on_the_place(self, box):
        T = np.eye(4)
        T[:3, :3] = Rotation.from_euler("xyz", [1, 2, 3]).as_matrix()
        T[:3, 3] = 1e6
        assert box.transformed(T).volume == pytest.approx(6, rel=1e-8)

    def test_open(self, box):
        assert not TriangleMesh(box.vertices, box.faces[:-1]).is_closed
        assert not torn(box).is_closed

    def test_a_wrongly_turned_face_is_a_gap(self, box):
        faces = box.faces.copy()
        faces[3] = faces[3][::-1]
        assert not TriangleMesh(box.vertices, faces).is_closed

    def test_vertex_normals_point_outward(self, box):
        outward = box.vertices - box.vertices.mean(axis=0)
        assert (np.einsum("ij,ij->i", box.vertex_normals, outward) > 0).all()
        assert_allclose(np.linalg.norm(box.vertex_normals, axis=1), 1)

    def test_reflections_keep_the_outside_outside(self, box):
        mirrored = box.transformed(np.diag([-1.0, 1, 1, 1]))
        assert mirrored.volume == pytest.approx(6)


class TestWelding:
    def test_puts_a_torn_surface_together(self, box):
        with pytest.warns(SimplexMeshWarning, match="merged 28 duplicate vertices"):
            welded = torn(box).welded()
        assert welded.n_vertices == 8
        assert welded.is_closed
        assert welded.volume == pytest.approx(6)

    def test_is_silent_on_request_and_idle_on_whole_surfaces(self, box):
        assert torn(box).welded(report=False).n_vertices == 8
        assert box.welded() is box

    def test_minus_zero_is_zero(self, box):
        split = torn(box)
        vertices = np.where((split.vertices == 0) & (np.arange(36)[:, None] % 2 == 0), -0.0, split.vertices)
        assert TriangleMesh(vertices, split.faces).welded(report=False).n_vertices == 8

    def test_tolerance_bridges_rounding(self, box):
        split = torn(box)
        noise = np.random.default_rng(4).uniform(-1e-9, 1e-9, split.vertices.shape)
        rough = TriangleMesh(split.vertices + noise, split.faces)
        assert not rough.welded(report=False).is_closed
        welded = rough.welded(tolerance=1e-8, report=False)
        assert welded.n_vertices == 8
        assert welded.is_closed

    def test_drops_what_collapses_and_what_no_face_uses(self):
        vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [5, 5, 5], [1, 1, 0]]
        with pytest.warns(
            SimplexMeshWarning,
            match="^merged 1 duplicate vertex, removed 1 collapsed face, removed 1 vertex without a face$",
        ):
            welded = TriangleMesh(vertices, [[0, 1, 2], [0, 3, 1], [1, 5, 2]]).welded()
        assert welded.n_vertices == 4
        assert_array_equal(welded.faces, [[0, 1, 2], [1, 3, 2]])


class TestSampling:
    def test_points_are_uniform_over_the_area(self, box):
        cloud = box.sampled(22_000, rng=5)
        assert_allclose(np.linalg.norm(cloud.normals, axis=1), 1)
        for axis, area in enumerate([6, 3, 2]):
            on_side = np.abs(cloud.normals[:, axis]) > 0.5
            assert on_side.sum() == pytest.approx(2000 * area, rel=0.06)
            assert_allclose(
                cloud.points[on_side, axis] * (box.bounds[1, axis] - cloud.points[on_side, axis]), 0, atol=1e-12
            )
        top = cloud.points[cloud.normals[:, 2] > 0.5]
        assert_allclose(top[:, :2].mean(axis=0), [0.5, 1.0], atol=0.04)
        assert_allclose(np.cov(top[:, :2].T), np.diag([1 / 12, 4 / 12]), atol=0.02)

    def test_is_repeatable(self, box):
        assert_array_equal(box.sampled(10, rng=1).points, box.sampled(10, rng=1).points)


def test_fans_cut_polygons_of_any_size():
    assert_array_equal(
        fans(np.array([3, 5, 2, 4]), np.arange(14)),
        [[0, 1, 2], [3, 4, 5], [3, 5, 6], [3, 6, 7], [10, 11, 12], [10, 12, 13]],
    )


def test_degenerate_faces_are_removed_and_reported(box):
    with pytest.warns(SimplexMeshWarning, match="removed 2 degenerate faces of 14"):
        mesh = TriangleMesh(box.vertices, [*box.faces.tolist(), [1, 1, 2], [3, 4, 3]])
    assert_array_equal(mesh.faces, box.faces)


@pytest.mark.parametrize(
    ("vertices", "faces", "error", "message"),
    [
        (CORNERS, np.zeros((0, 3), int), ValueError, "faces must be at least one, not none"),
        (CORNERS, [[0, 1, 8]], ValueError, r"faces\[0, 2\] is 8, outside 0..7"),
        (CORNERS, [[0, 1, -1]], ValueError, r"faces\[0, 2\] is -1, outside"),
        (CORNERS, [[0, 1, 2], [0, 1]], ValueError, "faces must be an array, but its rows have different lengths"),
        (CORNERS, [[0, 1, 2, 3]], ValueError, r"faces must have shape \(\*, 3\)"),
        (CORNERS, [[0.0, 1.5, 2.0]], TypeError, "faces must be whole numbers, not float64"),
        (CORNERS[:3], [[0, 1, 2]], ValueError, "vertices must be at least 4, not 3"),
        (CORNERS * np.nan, [[0, 1, 2]], ValueError, "vertices must be finite"),
    ],
)
def test_refusals(vertices, faces, error, message):
    with pytest.raises(error, match=message):
        TriangleMesh(vertices, faces)


@pytest.mark.filterwarnings("ignore::simplexmesh._base.errors.SimplexMeshWarning")
def test_nothing_but_degenerate_faces_is_refused():
    with pytest.raises(ValueError, match="faces must be at least one with three different vertices"):
        TriangleMesh(CORNERS, [[1, 1, 2]])


class TestTopology:
    @pytest.mark.parametrize("method", ["fan", "dual"])
    @pytest.mark.parametrize(
        ("shape", "numbers"),
        [
            (sm.sphere(3), (1, 0, 0)),
            (sm.torus(12, 6), (1, 0, 1)),
            (sm.cylinder(9, 4), (1, 2, 0)),
            (sm.plane(5, 4), (1, 1, 0)),
        ],
    )
    def test_of_shapes(self, shape, numbers, method):
        surface = shape.triangulated(method)
        assert (surface.n_components, surface.n_borders, surface.genus) == numbers
        pieces, borders, genus = numbers
        assert surface.topology.euler == 2 * pieces - 2 * genus - borders

    def test_counts_used_vertices_edges_and_faces(self):
        surface = sm.torus(12, 6).triangulated()
        edges = np.unique(np.sort(surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
        assert surface.topology.euler == surface.n_vertices - len(edges) + surface.n_faces

    def test_does_not_depend_on_which_way_faces_are_turned(self):
        surface = sm.cylinder(9, 4).triangulated()
        faces = surface.faces.copy()
        faces[::3] = faces[::3, ::-1]
        assert TriangleMesh(surface.vertices, faces).topology == surface.topology

    def test_adds_over_pieces_and_splits_sheets_that_touch_in_a_corner(self, box):
        fan = TriangleMesh(np.vstack([CORNERS[:5], CORNERS[:5] + 9]), [[0, 1, 2], [0, 3, 4]])
        assert (fan.n_components, fan.n_borders, fan.genus) == (2, 2, 0)
        ring = sm.torus(12, 6).triangulated()
        both = TriangleMesh(
            np.vstack([box.vertices + 9, ring.vertices]), np.vstack([box.faces[1:], ring.faces + len(box.vertices)])
        )
        assert (both.n_components, both.n_borders, both.genus) == (2, 1, 1)

    def test_loops_of_one_piece_that_meet_in_a_corner_are_two(self):
        sheet = sm.plane(6, 6).triangulated("dual")
        alone = TriangleMesh(sheet.vertices, sheet.faces)
        middle = int(np.argmin(np.linalg.norm(sheet.vertices, axis=1)))
        around = np.flatnonzero((sheet.faces == middle).any(axis=1))
        holed = TriangleMesh(sheet.vertices, np.delete(sheet.faces, around, axis=0))
        assert (alone.n_borders, holed.n_borders, holed.genus) == (1, 2, 0)


class TestOriented:
    def test_what_is_well_is_left_alone(self, box):
        assert box.oriented() is box

    @pytest.mark.parametrize("share", [2, 3, 7])
    def test_faces_are_turned_like_their_neighbors_and_outward(self, box, share):
        faces = box.faces.copy()
        faces[::share] = faces[::share, ::-1]
        with pytest.warns(SimplexMeshWarning, match=f"^flipped {len(faces[::share])} of 12 triangles$"):
            turned = TriangleMesh(box.vertices, faces).oriented()
        assert turned.is_closed
        assert turned.volume == pytest.approx(6)

    def test_inside_out(self, box):
        inside_out = TriangleMesh(box.vertices, box.faces[:, ::-1])
        assert inside_out.oriented(outward=False) is inside_out
        with pytest.warns(SimplexMeshWarning, match="^flipped 12 of 12 triangles$"):
            assert inside_out.oriented().volume == pytest.approx(6)

    def test_the_wall_of_a_cavity_is_no_mistake(self, box):
        cavity = np.concatenate([box.vertices, 0.5 * box.vertices]), np.concatenate([box.faces, box.faces[:, ::-1] + 8])
        walls = "closed components that face inward, as the walls of cavities do"
        with pytest.warns(SimplexMeshWarning, match=f"^turned outward 12 of 24 triangles: {walls}$"):
            assert TriangleMesh(*cavity).oriented().volume == pytest.approx(1.125 * 6)

    def test_an_open_surface_goes_with_the_majority(self):
        surface = sm.cylinder(9, 4).triangulated()
        faces = surface.faces.copy()
        faces[:20] = faces[:20, ::-1]
        with pytest.warns(SimplexMeshWarning, match="flipped 20 of"):
            turned = TriangleMesh(surface.vertices, faces).oriented()
        assert_allclose(turned.face_vectors, surface.face_vectors, atol=1e-14)

    def test_copies_are_dropped(self, box):
        twice = TriangleMesh(box.vertices, np.vstack([box.faces, box.faces[:1]]))
        with pytest.warns(SimplexMeshWarning, match="^dropped 1 duplicate triangle$"):
            assert twice.oriented().n_faces == 12

    def test_a_third_face_on_an_edge_is_refused_by_name(self, box):
        fin = TriangleMesh(np.vstack([box.vertices, [5, 5, 5]]), np.vstack([box.faces, [[0, 1, 8]]]))
        for what in (fin.oriented, lambda: fin.genus):
            with pytest.raises(sm.TopologyError, match="the edge of corners 0 and 1 has 3"):
                what()

    def test_a_surface_with_one_side_is_refused(self):
        n = 7
        strip = np.array([[i, (i + 1) % n, (i + 2) % n] for i in range(n)])  # seven triangles around: a Moebius band
        band = TriangleMesh(np.random.default_rng(0).random((n, 3)), strip)
        for what in (band.oriented, lambda: band.topology):
            with pytest.raises(sm.TopologyError, match="must be orientable"):
                what()
