"""Opening of holes where there is no data, and attraction of their rims to the border of the data."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.cli import app
from simplexmesh.motion.density.face_edits import divided_boundary
from simplexmesh.motion.model.contours import BorderAttraction, rims_of
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.motion.targets.borders import border_of_points, boundary_criteria
from simplexmesh.motion.topology.face_regions import _around, cuttable, face_components, with_holes_beside
from simplexmesh.motion.topology.holes import open_holes
from simplexmesh.numerics.plane_fits import fitted
from tests.motion.targets import reference as reference
from tests.nightly.marks import nightly

pytestmark = pytest.mark.usefixtures("coarse_starts")

FINE = sm.sphere(20).triangulated()


def part(keep):
    """Return the triangles of a fine sphere whose centroids meet a condition."""
    middles = FINE.vertices[FINE.faces].mean(axis=1)
    return sm.TriangleMesh(FINE.vertices, FINE.faces[keep(middles)]).welded(report=False)


def rim_points(mesh):
    c = mesh.connectivity
    return mesh.vertices[c.face_vertices[np.repeat(c.face_is_hole, c.face_sizes)]]


def topologically_sound(mesh):
    c = mesh.connectivity
    n_faces = len(c.face_sizes)
    return mesh.n_vertices - c.n_edges + n_faces == 2 * c.n_components - 2 * mesh.genus and c.face_sizes.min() >= 3


def with_ends(points, normals, reach):
    """The upper half of the unit sphere as a minimal target without a border."""
    gaps = 1 - np.linalg.norm(points, axis=1)
    return np.where((np.abs(gaps) < reach) & (points[:, 2] > 0), gaps, np.nan)


class Dome:
    """A user-defined target."""

    gap = staticmethod(with_ends)


class TestOpening:
    def test_half_a_ball_of_data_leaves_half_a_mesh_with_one_hole(self):
        out = open_holes(sm.sphere(8), sm.targets.Triangles(part(lambda p: p[:, 2] > 0)))
        assert (out.mesh.n_holes, out.mesh.n_components, out.mesh.genus) == (1, 1, 0)
        assert topologically_sound(out.mesh)
        assert out.mesh.vertices[:, 2].min() > -2 * mean_edge(out.mesh)
        assert [proposal.accepted for proposal in out.proposals] == [True]

    def test_a_band_of_data_leaves_two_holes(self):
        out = open_holes(sm.sphere(8), sm.targets.Triangles(part(lambda p: np.abs(p[:, 2]) < 0.5)))
        assert (out.mesh.n_holes, out.mesh.n_components) == (2, 1)

    def test_two_caps_of_data_leave_two_pieces(self):
        out = open_holes(sm.sphere(8), sm.targets.Triangles(part(lambda p: np.abs(p[:, 2]) > 0.5)))
        assert (out.mesh.n_holes, out.mesh.n_components) == (2, 2)
        assert len(out.proposals[0].contours) == 2

    def test_a_closed_ball_of_data_leaves_the_mesh_as_it_is(self):
        ball = sm.sphere(8)
        out = open_holes(ball, sm.targets.Triangles(FINE))
        assert out.mesh is ball
        assert out.proposals == ()

    def test_a_target_that_only_answers_gap_is_enough(self):
        assert open_holes(sm.sphere(8), Dome()).mesh.n_holes == 1

    def test_a_hole_widens_where_its_surroundings_have_no_data(self):
        ball = sm.sphere(8)
        small = open_holes(ball, zones=[np.flatnonzero(centers(ball)[:, 2] < -0.9)]).mesh
        assert small.n_holes == 1
        out = open_holes(small, Dome())
        assert (out.mesh.n_holes, out.mesh.n_components) == (1, 1)
        assert out.mesh.n_vertices < small.n_vertices

    def test_faces_that_only_a_hole_connects_are_zones_apart(self):
        ball = sm.sphere(8)
        mesh = open_holes(ball, zones=[np.flatnonzero(centers(ball)[:, 2] < -0.8)]).mesh
        rim = mesh.connectivity.face_is_hole[mesh.connectivity.vertex_faces].any(axis=1)
        beside = [face for face in mesh.faces if rim[face].sum() > 1]
        narrow = min(beside, key=lambda face: mesh.vertices[face, 0].mean())
        lost = (mesh.vertices[:, 2] < -0.3) & (mesh.vertices[:, 0] > 0.3)
        lost[narrow] = True

        class Data:
            gap = staticmethod(lambda vertices, normals, reach: np.where(lost, np.nan, 0.0))

        out = open_holes(mesh, Data(), fewest=3)
        assert [proposal.reason for proposal in out.proposals] == ["", "1 faces, fewer than 3"]
        assert set(out.proposals[1].vertices) == set(narrow)
        assert (out.mesh.n_holes, out.mesh.n_components) == (1, 1)

    def test_small_zones_stay_and_are_reported(self):
        data = sm.targets.Triangles(part(lambda p: p[:, 2] > -0.9))
        ball = sm.sphere(8)
        assert open_holes(ball, data, fewest=1).mesh.n_holes == 1
        out = open_holes(ball, data, fewest=100)
        assert out.mesh is ball
        assert "fewer than 100" in out.proposals[0].reason

    def test_maps_lead_vertices_and_faces_to_where_they_are(self):
        ball = sm.sphere(6).with_data(height=sm.sphere(6).vertices[:, 2])
        out = open_holes(ball, sm.targets.Triangles(part(lambda p: np.abs(p[:, 2]) > 0.5)))
        kept = np.flatnonzero(out.vertex_map >= 0)
        assert np.array_equal(out.mesh.vertices[out.vertex_map[kept]], ball.vertices[kept])
        assert np.array_equal(out.mesh.data["height"], out.mesh.vertices[:, 2])
        whole = [f for f in np.flatnonzero(out.face_map >= 0) if (out.vertex_map[ball.faces[f]] >= 0).all()]
        for f in whole:
            now = np.asarray(out.mesh.connectivity.face_vertices)
            offsets = out.mesh.connectivity.face_offsets
            g = out.face_map[f]
            assert set(now[offsets[g] : offsets[g + 1]]) <= set(out.vertex_map[ball.faces[f]])


def centers(mesh):
    return np.array([mesh.vertices[face].mean(axis=0) for face in mesh.faces])


class TestChoosing:
    def test_the_user_may_refuse(self):
        ball, asked = sm.sphere(8), []
        data = sm.targets.Triangles(part(lambda p: np.abs(p[:, 2]) < 0.5))

        def accept(proposal):
            asked.append(proposal)
            return ball.vertices[proposal.vertices, 2].mean() > 0

        out = open_holes(ball, data, accept=accept)
        assert out.mesh.n_holes == 1
        assert len(asked) == 2
        assert sorted(proposal.reason for proposal in out.proposals) == ["", "refused by accept"]
        assert asked[0].contour.separates
        assert asked[0].area > 0
        assert len(asked[0].faces) >= 6

    def test_zones_given_are_cut_whatever_the_data(self):
        ball = sm.sphere(8)
        zones = [np.flatnonzero(centers(ball)[:, 2] > 0.8), np.flatnonzero(centers(ball)[:, 2] < -0.8)]
        assert open_holes(ball, zones=zones).mesh.n_holes == 2

    def test_a_zone_that_cannot_be_cut_off_is_reported(self):
        out = open_holes(sm.sphere(6), zones=[[3]])
        assert out.proposals[0].reason == "it has no outline that can be cut along"

    def test_mean_distance_is_that_along_normals(self):
        ball = sm.sphere(8, radius=1.3)
        out = open_holes(ball, sm.targets.Triangles(FINE), reach=0.1, accept=lambda proposal: False)
        assert out.proposals == () or out.proposals[0].reason
        far = open_holes(ball, Dome(), reach=0.1).proposals
        assert far[0].reason == "it is the whole mesh"
        assert far[0].mean_distance == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize(
    "mesh", [sm.cylinder(9, 6), sm.plane(vertices=200), sm.sphere(4)], ids=["tube", "sheet", "ball"]
)
def test_a_zone_takes_in_just_the_holes_that_share_an_edge_with_it(mesh):
    c = mesh.connectivity
    rng = np.random.default_rng(0)
    for _ in range(20):
        zone = rng.random(len(c.face_sizes)) < 0.05
        wanted = {f for f in np.flatnonzero(zone).tolist() if not c.face_is_hole[f]}
        for one, other in c.edge_faces.tolist():
            for mine, hole in ((one, other), (other, one)):
                if zone[mine] and not c.face_is_hole[mine] and c.face_is_hole[hole]:
                    wanted.add(hole)
        assert set(np.flatnonzero(with_holes_beside(c, zone)).tolist()) == wanted


class TestBadInput:
    def test_a_target_needs_gap(self):
        with pytest.raises(TypeError, match="target must have a method gap"):
            open_holes(sm.sphere(4), "face.vtk")

    def test_one_of_target_and_zones_is_needed(self):
        with pytest.raises(TypeError, match="needs a target or zones"):
            open_holes(sm.sphere(4))

    def test_the_mesh_is_a_mesh(self):
        with pytest.raises(TypeError, match="mesh must be a SimplexMesh, not TriangleMesh"):
            open_holes(FINE, Dome())

    @pytest.mark.parametrize(
        ("zones", "error", "said"),
        [
            ([[0, 1000]], ValueError, r"zones\[0\]\[1\] is 1000, outside 0..161"),
            ([[]], ValueError, r"zones\[0\] must hold at least one face"),
            ([[1, 2], [2, 3]], ValueError, r"must not overlap; face 2 is in zones\[1\]"),
            (7, TypeError, "zones must be lists of faces, not int"),
        ],
    )
    def test_zones_are_lists_of_faces(self, zones, error, said):
        with pytest.raises(error, match=said):
            open_holes(sm.sphere(4), zones=zones)

    def test_holes_are_no_zones(self):
        tube = sm.cylinder(9, 6)
        hole = int(np.flatnonzero(tube.connectivity.face_is_hole)[0])
        with pytest.raises(ValueError, match=f"{hole} is a hole"):
            open_holes(tube, zones=[[hole]])

    def test_zones_may_be_masks(self):
        ball = sm.sphere(6)
        cap = np.array([(ball.vertices[corners, 2] > 0.5).all() for corners in ball.faces])
        marked, numbered = open_holes(ball, zones=[cap]), open_holes(ball, zones=[np.flatnonzero(cap)])
        assert marked.mesh.n_holes == 1
        assert_array_equal(marked.face_map, numbered.face_map)
        with pytest.raises(ValueError, match=r"^zones\[0\] must have shape \(362,\), not \(361,\)$"):
            open_holes(ball, zones=[cap[:-1]])

    @pytest.mark.parametrize("answer", [None, 1, np.ones(3, bool), [], b"no"])
    def test_answers_are_yes_or_no_or_a_reason(self, answer):
        ball = sm.sphere(6)
        said = f"^accept must return True, False or a text with the reason, not {type(answer).__name__}$"
        with pytest.raises(TypeError, match=said):
            open_holes(ball, zones=[range(30)], accept=lambda proposal: answer)

    def test_many_holes_are_cut_at_once_and_the_maps_hold(self):
        ball = sm.sphere(12)
        c = ball.connectivity
        corners = [ball.vertices @ axis for axis in np.concatenate([np.eye(3), -np.eye(3)])]
        zones = [np.logical_and.reduceat((far > 0.85)[c.face_vertices], c.face_offsets[:-1]) for far in corners]
        out = open_holes(ball, zones=zones)
        assert (out.mesh.n_holes, out.mesh.n_components, out.mesh.check().ok) == (6, 1, True)
        assert (out.face_map < 0).sum() >= 6 * 20
        now = out.mesh.connectivity
        loops = np.split(now.face_vertices, now.face_offsets[1:-1])  # with holes
        for face in np.flatnonzero(out.face_map >= 0).tolist():
            kept = {int(v) for v in out.vertex_map[ball.faces[face]]} - {-1}
            assert kept == set(loops[out.face_map[face]].tolist())

    @pytest.mark.parametrize(("option", "value"), [("reach", 0.0), ("fewest", 0)])
    def test_numbers_are_positive(self, option, value):
        with pytest.raises(ValueError, match=option):
            open_holes(sm.sphere(4), Dome(), **{option: value})

    def test_accept_is_a_function(self):
        with pytest.raises(TypeError, match="accept must be a function"):
            open_holes(sm.sphere(4), Dome(), accept=True)

    @pytest.mark.parametrize(
        ("option", "value", "error"),
        [
            ("holes", "some", ValueError),
            ("handles", "some", ValueError),
            ("refine", "finest", ValueError),
            ("holes", 3, TypeError),
        ],
    )
    def test_reconstruct_refuses_unknown_options(self, option, value, error):
        with pytest.raises(error, match=option):
            sm.reconstruct(FINE, init="sphere", **{option: value})


MESHES = [sm.sphere(6), sm.torus(20, 10), sm.cylinder(20, 12)]


@given(st.sampled_from(MESHES), st.integers(0, 2**32 - 1))
def test_any_set_of_faces_can_be_cut_off_or_is_refused(mesh, seed):
    """Fields of any roughness, thresholds from few faces to nearly all: results are valid, refusals have reasons."""
    rng = np.random.default_rng(seed)
    field = np.sin(centers(mesh) @ rng.normal(size=(3, 3)) * rng.uniform(1, 6)).sum(axis=1)
    field += rng.normal(size=len(field)) * rng.uniform(0, 1)
    faces = np.flatnonzero(~mesh.connectivity.face_is_hole)[field > np.quantile(field, rng.uniform(0.3, 0.97))]
    try:
        out = open_holes(mesh, zones=[faces])
    except sm.TopologyError:
        assert len(faces) > 0.3 * mesh.n_faces  # nothing remains of it
        return
    assert topologically_sound(out.mesh)
    assert sm.SimplexMesh(
        out.mesh.vertices, sm.Connectivity(out.mesh.connectivity.twin, out.mesh.connectivity.hole_darts)
    )
    sm.EditableMesh(out.mesh)  # raises for incomplete meshes
    assert (out.mesh is mesh) == (not any(proposal.accepted for proposal in out.proposals))


def test_a_zone_is_repaired_at_its_edge_only():
    c = sm.sphere(12).connectivity
    zone = centers(sm.sphere(12))[:, 2] > 0.3
    zone[np.flatnonzero(zone)[0]] = False
    fixed = cuttable(c, zone)
    assert fixed is not None
    assert len(face_components(c, fixed)) == 1
    assert np.count_nonzero(fixed != zone) < 0.1 * zone.sum()


def test_a_zone_grows_by_what_lies_between_it_or_else_all_around():
    ball = sm.sphere(6)
    c = ball.connectivity
    first, second = c.edge_faces[0]
    both = set(c.vertex_faces[c.edge_vertices[0]].ravel().tolist()) - {first, second}
    zone = np.isin(np.arange(ball.n_faces), [first, second])
    assert set(np.flatnonzero(_around(c, zone)).tolist()) == both
    zone[second] = False
    beside = {face for pair in c.edge_faces.tolist() if first in pair for face in pair} - {first}
    assert set(np.flatnonzero(_around(c, zone)).tolist()) == beside


class TestBorders:
    def test_points_on_a_grid_end_at_its_sides(self):
        x, y = np.meshgrid(np.arange(20.0), np.arange(15.0))
        border = border_of_points(np.stack([x.ravel(), y.ravel(), np.sin(0.2 * x.ravel())], axis=1))
        on_side = (border.points[:, 0] % 19 == 0) | (border.points[:, 1] % 14 == 0)
        assert on_side.all()
        assert len(border.points) >= 2 * (18 + 13)

    def test_a_closed_cloud_has_no_border(self):
        assert not len(border_of_points(sm.sphere(20).vertices).points)

    def test_points_nearer_to_each_other_than_their_noise_end_where_they_do(self):
        rng = np.random.default_rng(1)
        points = np.column_stack([rng.uniform(-1, 1, (30000, 2)), np.zeros(30000)]) + rng.normal(0, 0.03, (30000, 3))
        border = border_of_points(points)
        ends = np.abs(border.points[:, :2]).max(axis=1)
        assert len(border.points) > 50
        assert (np.abs(ends - 1) < 0.15).mean() > 0.9
        assert border.width.max() > 0.5

    def test_uneven_sampling_is_no_border(self):
        rng = np.random.default_rng(0)
        points = rng.uniform(-1, 1, (6000, 2))
        keep = (points[:, 0] < 0) | (rng.uniform(size=6000) < 0.1)
        points = np.column_stack([points[keep], np.zeros(keep.sum())])
        border = border_of_points(points)
        inside = (np.abs(border.points[:, :2]) < 0.85).all(axis=1)
        assert inside.mean() < 0.05
        assert len(border.points) > 50

    @given(st.integers(0, 2**32 - 1), st.integers(4, 30), st.booleans())
    def test_boundary_criteria_against_the_reference(self, seed, count, known):
        rng = np.random.default_rng(seed)
        points = rng.normal(size=(60, 3)) * [1.0, 0.7, 0.1]
        rows = np.arange(9)
        near = np.array([rng.choice(np.arange(9, 60), count, replace=False) for _ in rows])
        normals = rng.normal(size=(9, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        plain, *told = reference.boundary_criteria(points, rows, near, normals if known else None)
        normals = normals if known else fitted(points, near)[0]
        free, off = boundary_criteria(points[near] - points[rows, None], normals)
        flat = np.linalg.svd(points[near] - points[near].mean(axis=1, keepdims=True), compute_uv=False)
        clear = np.full(9, True) if known else flat[:, 2] < 0.9 * flat[:, 1]
        assert np.allclose(np.abs((normals * plain).sum(axis=1))[clear], 1, atol=1e-9)
        assert np.allclose(free[clear], told[0][clear], atol=1e-5)
        assert np.allclose(off[clear], told[1][clear], atol=1e-6)

    def test_the_border_of_triangles_is_as_wide_as_their_hole(self):
        target = sm.targets.Triangles(part(lambda p: np.abs(p[:, 2]) < 0.5))
        assert np.allclose(np.abs(target.border.points[:, 2]), 0.5, atol=0.1)
        assert np.allclose(target.border.width, np.sqrt(2) * 2 * np.cos(np.arcsin(0.5)), rtol=0.1)
        assert not len(target.border.wider(10.0))

    def test_closed_triangles_have_none(self):
        assert not len(sm.targets.Triangles(FINE).border.points)


class TestRims:
    def test_a_rim_goes_to_the_border_and_stays_even(self):
        data = sm.targets.Triangles(part(lambda p: p[:, 2] > 0.2))
        mesh = open_holes(sm.sphere(8), sm.targets.Triangles(part(lambda p: p[:, 2] > -0.3))).mesh
        model = sm.DeformableModel(mesh, data, rigidity=2, reach=1.0)
        for _ in model.run(150):
            pass
        rim = rim_points(model.mesh)
        assert cKDTree(data.border.points).query(rim)[0].mean() < 0.1 * mean_edge(mesh)
        side = np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1)
        assert side.max() < 2 * side.min()

    def test_without_seeking_it_stays(self):
        data = sm.targets.Triangles(part(lambda p: p[:, 2] > 0.2))
        mesh = open_holes(sm.sphere(8), sm.targets.Triangles(part(lambda p: p[:, 2] > -0.3))).mesh
        model = sm.DeformableModel(mesh, data, rigidity=2, reach=1.0, seeking=0.0)
        for _ in model.run(150, warnings=False):
            pass
        assert cKDTree(data.border.points).query(rim_points(model.mesh))[0].mean() > mean_edge(mesh)

    def test_the_pull_is_across_the_rim(self):
        tube = sm.cylinder(24, 8)
        rim = rims_of(tube.connectivity)
        turn = np.linspace(0, 2 * np.pi, 500)
        z = tube.vertices[:, 2].max() + 0.3
        ring = np.column_stack([np.cos(turn), np.sin(turn), np.full(500, z)])
        pull = BorderAttraction(ring, 0.5).displacements(tube.vertices, rim, 1.0)
        places = tube.vertices[rim.vertices]
        along = places[rim.after] - places[rim.before]
        assert np.abs((pull * along).sum(axis=1)).max() < 1e-12
        top = places[:, 2] > 0
        assert np.allclose(pull[top, 2], 0.15, atol=0.01)
        assert not pull[~top].any()  # beyond reach

    def test_corners_of_the_border_draw_the_nearest_vertex(self):
        tube = sm.cylinder(6, 8)
        rim = rims_of(tube.connectivity)
        places = tube.vertices[rim.vertices]
        one = int(places[:, 2].argmax())
        up = np.array([0.0, 0.0, 1.0])
        border = np.concatenate([places[places[:, 2] > 0] + 0.1 * up, [places[one] + 0.4 * up] * 3])
        pull = BorderAttraction(border, 1.0).displacements(tube.vertices, rim, 1.0)
        assert pull[one] @ up == pytest.approx((0.1 + 3 * 0.4) / 4)  # the mean of the points it is nearest to
        others = (places[:, 2] > 0) & (np.arange(len(places)) != one)
        assert np.allclose(pull[others] @ up, 0.1)

    def test_long_sides_of_rims_are_divided(self):
        tube = sm.cylinder(9, 30)
        tube = tube.moved(tube.vertices * [8, 8, 1])
        out = divided_boundary(tube, 4).mesh
        assert out.n_vertices == tube.n_vertices + 8
        assert topologically_sound(out)


class TestOutward:
    @pytest.mark.parametrize("turn", [1, -1])
    def test_shells_face_away_from_the_centroid_of_their_border(self, turn):
        dome = part(lambda p: p[:, 2] > 0.2)
        dome = sm.TriangleMesh(dome.vertices, dome.faces[:, ::turn])
        assert as_input(dome).turned_outward().samples().normals.mean(axis=0)[2] > 0

    @pytest.mark.parametrize("normals", [True, False])
    def test_points_too_with_or_without_normals(self, normals):
        ball = sm.sphere(20)
        up = ball.vertices[:, 2] > 0.0
        cloud = sm.PointCloud(ball.vertices[up], -ball.normals[up] if normals else None)
        out = as_input(cloud).turned_outward().samples()
        assert ((out.points * out.normals).sum(axis=1) > 0).mean() > 0.99

    def test_thin_sheets_that_bound_no_body(self):
        x, y = np.random.default_rng(0).uniform(-1, 1, (2, 3000))
        sheet = as_input(np.column_stack([x, y, 0.1 * np.sin(3 * x)]))
        up = sheet.turned_outward().samples().normals[:, 2] > 0
        assert up.all() or not up.any()


class TestReconstruction:
    @pytest.mark.parametrize("kind", ["triangles", *nightly("points")])
    def test_half_a_ball_from_a_sphere(self, kind):
        data = part(lambda p: p[:, 2] > 0)
        given = data if kind == "triangles" else data.vertices
        model = sm.reconstruct(given, init="sphere", vertices=600)
        assert (model.mesh.n_holes, model.mesh.genus, model.mesh.n_components) == (1, 0, 1)
        assert 540 <= model.mesh.n_vertices <= 660
        assert [proposal.accepted for proposal in model.topology.holes] == [True]
        assert model.topology.refined > 0
        assert model.tangled == 0
        assert model.distance.data_to_mesh.mean < 0.004
        ends = sm.targets.Triangles(data).border.points
        assert cKDTree(ends).query(rim_points(model.mesh))[0].mean() < 0.02

    def test_vertices_without_faces_are_no_data(self):
        seen = FINE.faces[(FINE.vertices[FINE.faces][:, :, 2] > -0.3).all(axis=1)]
        subject = as_input((FINE.vertices, seen))
        assert subject.points[:, 2].min() > -0.3 - 1e-9

    def test_a_pipe_open_at_both_ends_from_a_sphere(self):
        pipe = sm.cylinder(60, 80, radius=0.7, height=2.0).triangulated()
        model = sm.reconstruct(pipe, init="sphere", vertices=800)
        assert (model.mesh.n_holes, model.mesh.genus) == (2, 0)
        ends = np.abs(rim_points(model.mesh)[:, 2])
        assert np.abs(ends - np.abs(pipe.vertices[:, 2]).max()).mean() < 0.05

    def test_noise_does_not_hide_the_end_of_the_data(self):
        rng = np.random.default_rng(0)
        points = rng.normal(size=(6000, 3))
        points /= np.linalg.norm(points, axis=1)[:, None]
        points = points[points[:, 2] > 0] + rng.normal(size=(np.count_nonzero(points[:, 2] > 0), 3)) * 0.01
        model = sm.reconstruct(points, init="sphere", vertices=600)
        assert (model.mesh.n_holes, model.mesh.genus, model.tangled) == (1, 0, 0)
        assert np.abs(np.linalg.norm(model.mesh.vertices, axis=1) - 1).mean() < 0.004
        assert np.abs(rim_points(model.mesh)[:, 2]).mean() < 0.05

    @pytest.mark.parametrize(("init", "seed"), [("sphere", 0), *nightly(("sphere", 2)), ("plane", 0)])
    def test_a_flat_ring_has_two_holes_and_all_its_vertices(self, init, seed):
        x, y = np.random.default_rng(seed).uniform(-1, 1, (2, 6000))
        ring = (np.hypot(x, y) < 1) & (np.hypot(x, y) > 0.4)
        model = sm.reconstruct(np.column_stack([x, y, 0 * x])[ring], init=init, vertices=600)
        assert (model.mesh.n_holes, model.mesh.genus, model.tangled) == (2, 0, 0)
        assert abs(model.mesh.n_vertices - 600) <= 60
        reach = np.hypot(*rim_points(model.mesh)[:, :2].T)
        assert np.minimum(np.abs(reach - 1), np.abs(reach - 0.4)).mean() < 0.05  # an edge is 0.06

    def test_a_closed_ball_stays_closed_and_none_leaves_all_closed(self):
        assert sm.reconstruct(FINE, init="sphere", vertices=400, creases="none").mesh.n_holes == 0
        half = part(lambda p: p[:, 2] > 0)
        model = sm.reconstruct(half, init="sphere", vertices=400, holes="none", creases="none")
        assert model.mesh.n_holes == 0
        assert model.topology.holes == ()

    def test_the_user_decides_or_gives_the_zones(self):
        half = part(lambda p: p[:, 2] > 0)
        model = sm.reconstruct(half, init="sphere", vertices=400, holes=lambda proposal: False)
        assert model.mesh.n_holes == 0
        assert {proposal.reason for proposal in model.topology.holes} >= {"refused by accept"}
        model = sm.reconstruct(half, init="sphere", vertices=400, holes=lambda proposal: "not that")
        assert "not that" in {proposal.reason for proposal in model.topology.holes}
        ball = sm.sphere(6, radius=1.2)
        cap = np.flatnonzero(centers(ball)[:, 2] < -0.9)
        with pytest.warns(sm.SimplexMeshWarning, match="of the data is far from the model"):
            model = sm.reconstruct(FINE, init=ball, holes=[cap], creases="none")
        assert model.mesh.n_holes == 1
        assert np.array_equal(model.topology.holes[0].faces, cap)

    def test_the_automatic_start_keeps_its_topology(self):
        model = sm.reconstruct(FINE, vertices=400, creases="none")
        assert (model.topology.holes, model.topology.handles, model.topology.refined) == ((), (), 0)
        assert (model.mesh.genus, model.mesh.n_holes, model.mesh.n_vertices) == (0, 0, model.start.n_vertices)

    @pytest.mark.nightly
    def test_levels_of_refinement_stop_by_themselves(self):
        egg = sm.ellipsoid((1.0, 1.0, 2.0), 20).triangulated()
        counts = [
            sm.reconstruct(
                egg, init="sphere", vertices=1500, refine=level, handles="none", creases="none"
            ).mesh.n_vertices
            for level in ("none", "coarse", "auto")
        ]
        assert counts[1] < counts[2]
        assert abs(counts[2] - 1500) <= 150
        assert abs(counts[0] - 1500) <= 150


class TestCommand:
    def test_it_reports_what_was_opened_and_why_the_rest_was_not(self, tmp_path, capsys):
        half = open_holes(sm.sphere(12), Dome()).mesh
        half.save(tmp_path / "half.ply")
        wanted = ["reconstruct", str(tmp_path / "half.ply"), "--init", "sphere", "--vertices", "400"]
        assert app.run([*wanted, "--holes", "auto", "--refine", "auto", "-o", str(tmp_path / "m.vtp"), "--json"]) == 0
        facts = json.loads(capsys.readouterr().out)
        assert facts["holes"] == 1
        assert [hole["accepted"] for hole in facts["topology"]["holes"]].count(True) == 1
        assert facts["topology"]["refined"] > 0
        assert app.run([*wanted, "-o", str(tmp_path / "m.vtp")]) == 0
        assert "1 hole made" in capsys.readouterr().out

    @pytest.mark.parametrize("option", ["--holes", "--handles", "--refine"])
    def test_unknown_options_are_named(self, option, tmp_path, capsys):
        ball = tmp_path / "ball.ply"
        sm.sphere(4).save(ball)
        assert app.run(["reconstruct", str(ball), option, "some", "-o", str(tmp_path / "m.vtp")]) == 2
        said = capsys.readouterr().err
        assert f"{option[2:]} must be one of" in said
        assert "not 'some'" in said


@pytest.mark.filterwarnings("ignore:merged:simplexmesh._base.errors.SimplexMeshWarning")
@pytest.mark.nightly
@pytest.mark.parametrize("name", ["rabbit_scan.vtk", "part_scan.ply", "lion_head.off", "mannequin.off"])
def test_open_scans_from_a_sphere(data_folder, name):
    scan = sm.read(data_folder / name)
    model = sm.reconstruct(scan, init="sphere", vertices=2000)
    assert (model.mesh.n_holes, model.mesh.genus, model.tangled) == (1, 0, 0)
    assert model.distance.data_to_mesh.mean < 0.004 * scan.diagonal
    ends = sm.targets.Triangles(scan).border.wider(0.05 * scan.diagonal)
    assert cKDTree(ends).query(rim_points(model.mesh))[0].mean() < 0.003 * scan.diagonal


@pytest.mark.nightly
def test_the_scan_of_a_face_from_a_sphere(data_folder):
    """The example of the thesis: a sphere of 720 vertices, 1,700 in the end, one hole at the rim of the scan."""
    scan = sm.read(data_folder / "fran_face.vtk")
    model = sm.reconstruct(scan, init="sphere", vertices=1700)
    assert abs(model.start.n_vertices - 720) < 30
    assert abs(model.mesh.n_vertices - 1700) <= 170
    assert (model.mesh.n_holes, model.mesh.genus, model.tangled) == (1, 0, 0)
    assert model.distance.data_to_mesh.mean < 0.0015 * scan.diagonal
    assert model.mesh.check(self_intersections=True).ok
    ends = sm.targets.Triangles(scan).border.points
    rim = rim_points(model.mesh)
    assert cKDTree(ends).query(rim)[0].mean() < 0.003 * scan.diagonal
    assert cKDTree(rim).query(ends)[0].mean() < 0.01 * scan.diagonal
