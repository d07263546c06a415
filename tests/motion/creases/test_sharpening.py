"""Reconstructions with the sharp edges of their data."""

import dataclasses
from types import SimpleNamespace

import manifold3d
import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.mesh.triangles.self_intersection import self_intersections
from simplexmesh.motion.creases import sharpening
from simplexmesh.motion.creases.evidence import Evidence
from simplexmesh.motion.creases.lines import crease_lines
from tests.motion.creases.test_paths import CORNERS
from tests.nightly.marks import nightly
from tests.recognition import reference

HALF = np.array([1.0, 0.8, 0.5])


def box_points(count=5000, noise=0.0, seed=0):
    """Points on a box, and the same without noise."""
    rng = np.random.default_rng(seed)
    areas = np.repeat(HALF.prod() / HALF, 2)
    side = rng.choice(6, count, p=areas / areas.sum())
    points = rng.uniform(-1, 1, (count, 3))
    points[np.arange(count), side // 2] = 2 * (side % 2) - 1.0
    return points * HALF + rng.normal(size=(count, 3)) * noise


@pytest.fixture(scope="module", params=[*nightly(0.0), 0.004])
def models(request):
    points = box_points(noise=request.param)
    return [sm.reconstruct(points, vertices=800, creases=creases) for creases in ("auto", "none")]


class TestBox:
    def test_it_has_twelve_edges_and_eight_corners(self, models):
        sharp, smooth = models
        assert (len(sharp.creases), len(smooth.creases)) == (12, 0)
        assert "crease" not in smooth.mesh.data
        ends = np.concatenate([line.points[[0, -1]] for line in sharp.creases])
        away = np.linalg.norm(ends[:, None] - CORNERS * HALF, axis=2)
        assert away.min(axis=1).max() < 0.08  # edges of the mesh are about as long
        assert np.bincount(away.argmin(axis=1)).tolist() == [3] * 8

    def test_creases_run_along_edges_of_the_mesh(self, models):
        mesh = models[0].mesh
        linked = {tuple(sorted(edge)) for edge in mesh.connectivity.edge_vertices.tolist()}
        marked = np.zeros(mesh.n_vertices, bool)
        for line in models[0].creases:
            assert all(
                tuple(sorted(pair)) in linked for pair in np.column_stack([line.vertices[:-1], line.vertices[1:]])
            )
            np.testing.assert_array_equal(line.points, mesh.vertices[line.vertices])
            marked[line.vertices] = True
        np.testing.assert_array_equal(marked, mesh.data["crease"] == 1)

    def test_they_are_contours_that_live_on(self, models):
        mesh = models[0].mesh
        for k, line in enumerate(models[0].creases, 1):
            assert mesh.contours[f"crease_{k}"].vertices.tolist() == line.vertices.tolist()
        small = sm.decimate(mesh, vertices=300).mesh
        ends = np.concatenate([small.vertices[contour.vertices[[0, -1]]] for contour in small.contours.values()])
        assert np.bincount(np.linalg.norm(ends[:, None] - CORNERS * HALF, axis=2).argmin(axis=1)).tolist() == [3] * 8
        assert sum(line.length for line in small.contours.values()) == pytest.approx(8 * HALF.sum(), rel=0.02)
        again = sm.reconstruct(box_points(), init=mesh, vertices=800)
        assert len(again.mesh.contours) == len(again.creases)

    def test_it_is_closer_to_the_truth(self, models):
        volume, off = 8 * HALF.prod(), []
        for model in models:
            v = model.mesh.triangulated().vertices
            outside = np.maximum(np.abs(v) - HALF, 0)
            inside = np.minimum((HALF - np.abs(v)).min(axis=1), 10)
            off.append(np.where(outside.any(axis=1), np.linalg.norm(outside, axis=1), np.abs(inside)).mean())
            assert model.tangled == 0
        assert off[0] < 0.5 * off[1]
        assert abs(models[0].mesh.volume - volume) < 0.5 * abs(models[1].mesh.volume - volume)

    def test_angles_are_right(self, models):
        angles = np.concatenate([line.angle[1:-1] for line in models[0].creases])
        assert np.degrees(np.median(angles)) == pytest.approx(90, abs=2)

    def test_nothing_is_folded_where_marks_tell_creases(self, models):
        mesh = models[0].mesh
        assert mesh.check(self_intersections=True)
        assert not sm.SimplexMesh(mesh.vertices, mesh.connectivity).check()  # normals of its corners mean nothing


def test_noise_makes_no_waves_in_creases_of_a_fine_model():
    """Their second differences, in edges, are .005 to .008; of creases that only meet the sides .06 to .08."""
    model = sm.reconstruct(box_points(noise=0.01), vertices=4000)
    bends = [np.diff(line.points, 2, axis=0) / (line.length / len(line.points)) for line in model.creases]
    assert len(bends) == 12
    assert np.sqrt((np.concatenate(bends) ** 2).sum(axis=1).mean()) < 0.025


@pytest.mark.parametrize("shape", [sm.ellipsoid((1.0, 0.7, 0.5), 24), *nightly(sm.torus(60, 40))])
def test_smooth_bodies_have_none(shape):
    points = shape.triangulated("dual").sampled(6000, rng=0).points
    assert sm.reconstruct(points, vertices=900).creases == ()


def label_of(distance, rotation=None, count=48):
    """Return a label (count, count, count) of what is within a distance of 0, and from it, about the middle."""
    places = np.moveaxis(np.mgrid[:count, :count, :count], 0, -1) - (count - 1) / 2
    return (distance(places if rotation is None else places @ rotation) < 0).astype(np.uint8)


def to_block(places, half, radius=0.0):
    """Signed distance, inside about, to a block with rounded edges."""
    outside = np.abs(places) - half + radius
    return np.linalg.norm(np.maximum(outside, 0), axis=-1) + np.minimum(outside.max(axis=-1), 0) - radius


@pytest.mark.parametrize(
    "rotation",
    [
        reference.random_rotation(np.random.default_rng(3)),
        *nightly(None, reference.random_rotation(np.random.default_rng(5))),
    ],
)
def test_labels_of_a_block_have_its_edges(rotation):
    """They were serrated, by up to a voxel, and then wavy by half a voxel: midpoints between voxels are no scan."""
    half = np.array([14.0, 12.0, 10.0])
    model = sm.reconstruct(label_of(lambda places: to_block(places, half), rotation), vertices=2500)
    assert sum(line.length for line in model.creases) == pytest.approx(8 * half.sum(), rel=0.1)
    at = model.mesh.vertices - 23.5
    off = to_block(at if rotation is None else at @ rotation, half)
    assert np.sqrt((off**2).mean()) < 0.08
    assert np.abs(off).max() < 0.5


@pytest.mark.parametrize(
    "distance",
    [
        lambda places: np.linalg.norm(places, axis=-1) - 14.3,
        lambda places: to_block(places, np.array([18.0, 14.0, 11.0]), radius=7.0),  # with flat terraces
    ],
)
def test_labels_of_what_is_round_have_none(distance):
    assert sm.reconstruct(label_of(distance), vertices=2500).creases == ()


@pytest.mark.nightly
def test_triangles_have_them():
    import pyvista as pv

    cube = pv.Cube().triangulate().clean()
    creases = sm.reconstruct(cube, vertices=640).creases
    assert sum(line.length for line in creases) == pytest.approx(12, abs=1)
    points = np.concatenate([line.points for line in creases])
    assert np.sort(0.5 - np.abs(points), axis=1)[:, 1].max() < 0.02  # two coordinates are those of a side


def test_motion_keeps_the_curvature_of_creases_out_of_averages():
    ball = sm.sphere(6)
    spiked = ball.moved(ball.vertices * np.where(np.arange(ball.n_vertices) == 5, 1.3, 1.0)[:, None])
    mark = (np.arange(ball.n_vertices) == 5).astype(np.uint8)
    moved = []
    for start in (spiked, spiked.with_data(crease=mark)):
        model = sm.DeformableModel(start, None, damping=1.0, constraint="mean_curvature")
        for _ in model.run(1, warnings=False):
            pass
        moved.append(((model.mesh.vertices - spiked.vertices) * spiked.normals).sum(axis=1))
    near = ball.neighbors[5]
    assert (moved[0][near] > moved[1][near] + 1e-3).all()  # the spike's curvature pulls its neighbors along
    far = np.setdiff1d(np.arange(ball.n_vertices), np.append(near, 5))
    np.testing.assert_array_equal(moved[0][far], moved[1][far])


@pytest.fixture(scope="module")
def scene(models):
    """What is known of the smooth model before its edges are brought onto the lines."""
    mesh, points = models[1].mesh, box_points(noise=0.004)
    target = sm.targets.Points(points)
    return sharpening.Scene(mesh, crease_lines(mesh, points, 0.004)[0], points, target, 0.008, 0.05)


def test_edges_that_cannot_be_had_are_told(monkeypatch):
    def settled(mesh, *_):
        raise sm.DivergedError("vertex 3 diverged", mesh)

    monkeypatch.setattr(sharpening, "_settled", settled)
    with pytest.warns(sm.SimplexMeshWarning, match="the model stays smooth"):
        model = sm.reconstruct(box_points(), vertices=400)
    assert model.creases == ()
    assert "crease" not in model.mesh.data
    assert model.mesh.check(self_intersections=True)


def released_but_a_quarter(scene, mesh, target, creased):
    return mesh, creased & (mesh.vertices[:, :2] > 0).all(axis=1)


def test_few_edges_are_kept_with_large_faces_only(monkeypatch, scene):
    monkeypatch.setattr(sharpening, "_released", released_but_a_quarter)
    assert 0.05 < scene.edge < 0.2
    found = sharpening._laid(dataclasses.replace(scene, resolution=0.05))
    assert 0.1 < found.share < 0.4
    with pytest.warns(sm.SimplexMeshWarning, match="what looks like sharp edges folds it"):
        assert sharpening._laid(dataclasses.replace(scene, resolution=0.2)) is None


def test_where_all_edges_fold_the_model_is_smooth(monkeypatch, scene):
    monkeypatch.setattr(sharpening, "_released", lambda scene, mesh, target, creased: (mesh, creased & False))
    with pytest.warns(sm.SimplexMeshWarning, match="its faces would fold"):
        assert sharpening._laid(scene) is None


@pytest.mark.parametrize("seed", [6, *nightly(7)])
def test_loops_smaller_than_a_face_are_no_lines(seed):
    """In the triangulation of these points two lines lead from one end of an edge to the other."""
    creases = sm.reconstruct(box_points(seed=seed), vertices=800).creases
    assert len(creases) == 12
    assert sum(line.length for line in creases) == pytest.approx(8 * HALF.sum(), rel=0.01)


@pytest.mark.parametrize(
    ("errors", "left"),
    [
        ([5.0] * 10 + [0.5, -1.0], 11),  # 14 together: all but what speaks against
        ([2.0] * 11 + [-3.0], 0),  # 5 together
        ([11.0] + [3.0] * 3 + [-30.0] * 8, 1),  # alone
        ([6.0] * 4 + [3.0] * 3 + [-6.0] * 5, 4),  # 12 of those that are clear, 1 of all
        ([6.0] * 4 + [3.0] * 3 + [-7.0] * 5, 0),  # the same, against edges on the whole
        ([6.0] * 2 + [3.0] * 5 + [-2.0] * 5, 0),  # 8 of those
    ],
)
def test_lines_go_out_that_do_not_speak_for_edges(monkeypatch, errors, left):
    lines = [SimpleNamespace(angle=1.0)] * 12
    monkeypatch.setattr(sharpening, "crease_lines", lambda *given: (lines, None))
    monkeypatch.setattr(sharpening, "evidence", lambda *given: Evidence(np.array(errors), np.ones(12)))
    monkeypatch.setattr(sharpening, "_laid", lambda scene: scene.lines)
    ball = sm.sphere(2)
    assert len(sharpening.sharpened(ball, ball.vertices, np.ones(ball.n_vertices), None) or []) == left


def test_lines_of_less_than_an_angle_go_out(monkeypatch):
    lines = [SimpleNamespace(angle=angle) for angle in (0.5, 1.0, 0.7, 2.0)]
    monkeypatch.setattr(sharpening, "crease_lines", lambda *given: (lines, None))
    monkeypatch.setattr(
        sharpening, "evidence", lambda told, *given: Evidence(20 * np.ones(len(told)), np.ones(len(told)))
    )
    monkeypatch.setattr(sharpening, "_laid", lambda scene: scene.lines)
    ball = sm.sphere(2)
    for least, left in ((0.0, lines), (0.7, lines[1:]), (0.8, lines[1::2]), (3.0, None)):
        assert sharpening.sharpened(ball, ball.vertices, np.ones(ball.n_vertices), None, least_angle=least) == left


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [0, 1])
def test_sharp_rims_among_many_rounds_are_creases(seed):
    """A boss on a block with round edges, which speak against edges more than both rims of the boss for them."""
    ball = manifold3d.Manifold.sphere(0.08, 48)
    corners = [ball.translate([x, y, z]) for x in (-0.9, 0.9) for y in (-0.5, 0.5) for z in (0.0, 0.4)]
    block = manifold3d.Manifold.batch_hull(corners)
    part = (block + manifold3d.Manifold.cylinder(0.5, 0.3, 0.3, 96).translate([0, 0, 0.3])).to_mesh()
    points = sm.TriangleMesh(part.vert_properties[:, :3], part.tri_verts).sampled(25_000, rng=seed).points
    rims = sorted(sm.reconstruct(points, vertices=2000).creases, key=lambda line: line.points[0, 2])
    assert [line.closed for line in rims] == [True, True]
    for rim, height in zip(rims, (0.48, 0.8), strict=True):
        assert np.median(np.abs(rim.points[:, 2] - height)) < 0.002
        assert np.median(np.abs(np.linalg.norm(rim.points[:, :2], axis=1) - 0.3)) < 0.002


def test_where_edges_fail_the_model_is_smooth(scene):
    mesh = scene.mesh
    row = int(mesh.vertices[:, 2].argmax())
    vertices = mesh.vertices.copy()
    vertices[row] += [0, 0, 1.0]
    failed = scene.failed(mesh.moved(vertices))
    assert failed[row]
    assert not scene.failed(mesh).any()


def test_a_bad_choice_is_told():
    with pytest.raises(ValueError, match="creases must be"):
        sm.reconstruct(np.zeros((10, 3)), creases="all")


class TestFlatFaces:
    def test_a_flat_face_with_corners_on_a_line_does_not_cross_itself(self):
        ball, rng = sm.sphere(6), np.random.default_rng(0)
        c = ball.connectivity
        face = int(np.flatnonzero(c.face_sizes == 6)[0])
        loop = c.face_vertices[c.face_offsets[face] : c.face_offsets[face + 1]]
        for _ in range(50):
            vertices = ball.vertices.copy()
            vertices[loop] = [[3, 0, 0], [4, 0, 0], [5, 0, 0], [6, 0, 0], [5, 1, 0], [4, 1, 0]]
            vertices[loop] += 1e-10 * rng.normal(size=(6, 3))
            assert [face, face] not in self_intersections(vertices, c).tolist()

    def test_a_star_does(self):
        ball = sm.sphere(4)
        c = ball.connectivity
        face = int(np.flatnonzero(c.face_sizes == 5)[0])
        loop = c.face_vertices[c.face_offsets[face] : c.face_offsets[face + 1]]
        vertices = ball.vertices.copy()
        vertices[loop] = vertices[loop[[0, 2, 4, 1, 3]]] + 1e-3 * np.arange(5)[:, None] * vertices[loop].mean(axis=0)
        pairs = self_intersections(vertices, c)
        assert [face, face] in pairs.tolist()


@pytest.mark.nightly
def test_a_model_finer_than_its_data_shows_has_the_edges_of_a_box():
    """Near edges its vertices are closer than points, and lines must not be sought at their scale."""
    creases = sm.reconstruct(box_points(count=8000, seed=3), vertices=4000).creases
    assert len(creases) == 12
    assert sum(line.length for line in creases) == pytest.approx(8 * HALF.sum(), rel=0.005)


@pytest.mark.nightly
def test_a_model_with_several_times_as_many_vertices_as_points_has_the_edges_of_a_box():
    """Its vertices are farther from the nearest point than its edges are long."""
    creases = sm.reconstruct(box_points(count=1500), vertices=8000).creases
    assert sum(line.length for line in creases) > 0.85 * 8 * HALF.sum()


@pytest.mark.parametrize("sides", [(100, 60, 2), *nightly(((100, 100, 3),))])
def test_the_twelve_triangles_of_a_thin_plate_keep_their_edges_and_corners(sides):
    """Its walls are nearer to each other than points resolve; vertices lie on lines exactly."""
    box = manifold3d.Manifold.cube(sides).to_mesh()
    plate = sm.TriangleMesh(box.vert_properties.astype(float), box.tri_verts)
    model = sm.reconstruct(plate, vertices=6000)
    assert len(model.creases) == 12
    assert model.mesh.volume == pytest.approx(plate.volume, rel=2e-3)
    assert sum(line.length for line in model.creases) == pytest.approx(4 * sum(sides), rel=0.02)
    corners = np.linalg.norm(model.mesh.vertices[None] - plate.vertices[:, None], axis=2).min(axis=1)
    assert corners.max() < 0.3  # edges of the mesh are of 1 to 2
    assert model.tangled == 0


def test_where_edges_find_no_way_along_sharp_ones_the_model_says_so(monkeypatch, scene):
    monkeypatch.setattr(sharpening, "traced", lambda *given: [])
    with pytest.warns(sm.SimplexMeshWarning, match="stays smooth: its edges find no way along the sharp edges"):
        assert sharpening._laid(scene) is None


@pytest.mark.filterwarnings("ignore::simplexmesh.SimplexMeshWarning")
def test_a_model_that_shrank_to_a_place_has_none(monkeypatch):
    """Lines would be cut into pieces of its size, more than memory holds."""
    monkeypatch.setattr("simplexmesh.motion.reconstruct.sharpen.sharpened", lambda *_, **__: pytest.fail("looked for"))
    flat = np.random.default_rng(0).uniform(-1, 1, (100, 3)) * [1, 1, 1e-6]
    assert not sm.reconstruct(flat, init="torus", vertices=20, iterations=10).creases
