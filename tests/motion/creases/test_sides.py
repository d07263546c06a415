"""The data of each part of a surface that creases cut."""

import numpy as np

import simplexmesh as sm
from simplexmesh._base.vectors import normalized, tangents
from simplexmesh.motion.creases import sides
from simplexmesh.motion.creases.paths import Path
from simplexmesh.motion.creases.sides import Sided
from simplexmesh.motion.model.state import mean_edge


def test_both_sides_of_a_thin_body_keep_their_data():
    """They are one part, and nearer to each other than the points are."""
    ball = sm.sphere(20)
    flat = ball.moved(ball.vertices * [1, 1, 0.03])
    cloud = flat.triangulated().sampled(4000, rng=0)
    edge = flat.connectivity.edge_vertices[0].astype(np.int64)
    whole = sm.targets.Points(cloud)
    sided = Sided(flat, [Path(0, edge, flat.vertices[edge], closed=False)], cloud.points, whole, 0.0)
    inner = np.hypot(*flat.vertices[:, :2].T) < 0.7
    gaps = [target.gap(flat.vertices, flat.normals, 0.2)[inner] for target in (sided, whole)]
    assert np.abs(gaps).max() < 0.001


def test_points_beside_a_face_without_area_are_of_no_part(monkeypatch):
    given = []
    monkeypatch.setattr(sides, "PartedPoints", lambda points, normals, parts, errors: given.extend(normals[parts[0]]))
    ball = sm.sphere(8)
    vertices = ball.vertices.copy()
    collapsed = list(ball.faces[20])
    vertices[collapsed] = 1.2 * vertices[collapsed].mean(axis=0)
    spike = ball.moved(vertices)
    points = np.vstack([spike.triangulated().sampled(2000, rng=0).points, 1.01 * vertices[collapsed[0]]])
    edge = spike.connectivity.edge_vertices[0].astype(np.int64)
    path = Path(0, edge, vertices[edge], closed=False)
    Sided(spike, [path], points, sm.targets.Points(sm.PointCloud(points)), 0.0)
    assert np.abs(np.linalg.norm(given, axis=1) - 1).max() < 1e-12


def test_some_vertices_are_laid_on_the_data_of_their_part():
    """Unfolded ones stayed where that had put them, at corners of labeled blocks over a voxel deep."""
    ball = sm.sphere(20)
    points = ball.triangulated().sampled(20_000, rng=0).points
    edge = ball.connectivity.edge_vertices[0].astype(np.int64)
    path = Path(0, edge, ball.vertices[edge], closed=False)
    sided = Sided(ball, [path], points, sm.targets.Points(sm.PointCloud(points)), 0.0)
    dented = ball.moved(0.98 * ball.vertices)
    some = ball.vertices[:, 2] > 0
    away = np.linalg.norm(sided.nearest(dented, some), axis=1)
    assert np.abs(away[some] - np.linalg.norm(ball.vertices[some], axis=1)).max() < 0.003
    np.testing.assert_array_equal(sided.nearest(dented, some)[~some], dented.vertices[~some])


def test_a_target_of_some_vertices_is_that_of_all_at_these():
    ball = sm.sphere(8)
    cap = ball.vertices[:, 2] > 0.5
    points = ball.triangulated().sampled(4000, rng=0).points
    edge = ball.connectivity.edge_vertices[0].astype(np.int64)
    path = Path(0, edge, ball.vertices[edge], closed=False)
    sided = Sided(ball, [path], points, sm.targets.Points(sm.PointCloud(points)), 0.0)
    sided.see_all(cap)
    rows = np.random.default_rng(0).permutation(ball.n_vertices)[:40]
    moved = 0.95 * ball.vertices
    some = sided.excerpt(rows).gap(moved[rows], ball.normals[rows], 0.3)
    np.testing.assert_array_equal(some, sided.gap(moved, ball.normals, 0.3)[rows])
    assert 0 < cap[rows].sum() < len(rows)


def test_each_part_pulls_once_at_a_crease_however_many_faces_it_has_there():
    """Vertices have three faces, of two parts: the edge of a double cone shrinks as two planes and bending balance."""
    ball = sm.sphere(3)
    pole = normalized(ball.vertices[next(face for face in ball.faces if len(face) == 5)].mean(axis=0))
    x, y, height = np.stack([*tangents(pole), pole]) @ ball.vertices.T
    angle, ring = np.arctan2(y, x), np.argsort(np.abs(height))[:30]
    ring, height[ring] = ring[np.argsort(angle[ring])], 0
    rng = np.random.default_rng(0)
    cone, points = (
        np.stack([(1 - np.abs(h)) * np.cos(a), (1 - np.abs(h)) * np.sin(a), h], axis=1)
        for a, h in ((angle, height), (rng.uniform(0, 2 * np.pi, 8000), rng.uniform(-0.6, 0.6, 8000)))
    )
    mesh = ball.moved(cone)
    path = Path(0, ring, cone[ring], closed=True)
    sided = Sided(mesh, [path], points, sm.targets.Points(sm.PointCloud(points)), 0.05)
    smooth = 3**4 * (2 - 2 * np.cos(2 * np.pi / 30)) ** 2
    radius = np.hypot(*sided.met(mesh, [path], 3 * mean_edge(mesh))[ring, :2].T)
    np.testing.assert_allclose(radius, 1 - smooth / (1 + smooth + sides.HELD), atol=0.005)
