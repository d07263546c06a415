"""The motion of a part of a mesh is that of the same vertices in the whole."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

import simplexmesh as sm
from simplexmesh.motion.creases.paths import Path
from simplexmesh.motion.creases.sides import Sided
from simplexmesh.motion.model.untangle import Tangles, excerpt, untangled
from simplexmesh.motion.topology.face_regions import dilated

BALL = sm.sphere(12)


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.sampled_from(["mean_curvature", "orientation"]))
def test_a_motion_of_few_vertices_is_bit_for_bit_that_of_the_whole_mesh(seed, rigidity, constraint):
    rng = np.random.default_rng(seed)
    mesh = BALL.moved(BALL.vertices + 0.02 * rng.normal(size=BALL.vertices.shape))
    free = dilated(np.isin(np.arange(mesh.n_vertices), rng.integers(0, mesh.n_vertices, 3)), mesh.neighbors, 2)
    part, rows = excerpt(mesh, dilated(free, mesh.neighbors, rigidity))
    assert part.n_vertices < mesh.n_vertices
    target = sm.targets.Triangles(BALL.triangulated())
    moved = []
    for each, weights in ((mesh, free.astype(float)), (part, free[rows].astype(float))):
        model = sm.DeformableModel(each, target, alpha=0.4 * weights, beta=0.2 * weights, damping=1.0, reach=0.5,
                                   rigidity=rigidity, constraint=constraint)  # fmt: skip
        for _ in model.run(12, warnings=False):
            pass
        moved.append(model.mesh.vertices)
    assert (moved[0] != mesh.vertices).any(axis=1).sum() == free.sum()
    assert_array_equal(moved[1], moved[0][rows])


def test_an_excerpt_keeps_neighbors_in_order_positions_and_data():
    mesh = BALL.with_data(metric=np.random.default_rng(0).random((BALL.n_vertices, 3)))
    zone = dilated(np.arange(mesh.n_vertices) == 100, mesh.neighbors, 4)
    part, rows = excerpt(mesh, zone)
    assert set(rows[: zone.sum()]) == set(np.flatnonzero(zone))
    assert not zone[rows[zone.sum() :]].any()
    assert_array_equal(rows[part.neighbors[: zone.sum()]], mesh.neighbors[rows[: zone.sum()]])
    assert_array_equal(part.vertices, mesh.vertices[rows])
    assert_array_equal(part.data["metric"], mesh.data["metric"][rows])


def test_vertices_on_creases_keep_their_marks():
    """Of meshes with creases no excerpt was taken: each attempt at a few tangles moved all vertices."""
    mesh = BALL.with_data(crease=(np.arange(BALL.n_vertices) % 7 == 0).astype(np.uint8))
    part, rows = excerpt(mesh, dilated(np.arange(mesh.n_vertices) == 100, mesh.neighbors, 4))
    assert part.n_vertices < mesh.n_vertices / 2
    assert_array_equal(part.data["crease"], mesh.data["crease"][rows])


def test_untangling_fits_to_data_that_tells_vertices_by_their_number():
    """As that beside creases does, which each vertex sees of its part alone."""
    vertices = BALL.vertices.copy()
    vertices[np.linalg.norm(vertices - [0, 0, 1], axis=1) < 0.1] += [0.3, 0, 0]
    points = BALL.triangulated().sampled(8000, rng=0).points
    edge = BALL.connectivity.edge_vertices[0].astype(np.int64)
    path = Path(0, edge, BALL.vertices[edge], closed=False)
    sided = Sided(BALL, [path], points, sm.targets.Points(sm.PointCloud(points)), 0.0)
    tangles = Tangles(BALL.moved(vertices))
    mended = untangled(tangles, sided, reach=0.5)
    assert tangles.count > 0
    assert mended.count == 0
    assert np.abs(np.linalg.norm(mended.mesh.vertices, axis=1) - 1).max() < 0.01


@pytest.mark.parametrize("mesh", [BALL, sm.cylinder(9, 5)])
def test_of_all_vertices_or_some_on_holes_the_whole_mesh_is_kept(mesh):
    part, rows = excerpt(mesh, np.ones(mesh.n_vertices, bool))
    assert part is mesh
    assert_array_equal(rows, np.arange(mesh.n_vertices))
    if mesh.n_holes:
        rim = mesh.connectivity.face_is_hole[mesh.connectivity.vertex_faces].any(axis=1)
        assert excerpt(mesh, np.arange(mesh.n_vertices) == np.flatnonzero(rim)[0])[0] is mesh


@pytest.mark.parametrize("seed", range(3))
def test_held_vertices_release_none(seed):
    """Where no data is seen, folds would spread from the ring that closes an excerpt."""
    ball = BALL.moved(BALL.vertices + 0.03 * np.random.default_rng(seed).normal(size=BALL.vertices.shape))
    target = sm.targets.Triangles(ball.moved(1.05 * BALL.vertices).triangulated())
    free = dilated(np.arange(ball.n_vertices) == 200 * seed, ball.neighbors, 4)
    part, rows = excerpt(ball, dilated(free, ball.neighbors, 1))
    moved = []
    for each, weights in ((ball, free.astype(float)), (part, free[rows].astype(float))):
        model = sm.DeformableModel(each, target, alpha=0.4 * weights, beta=0.4 * weights, damping=1.0, reach=0.02)
        for _ in model.run(10, warnings=False):
            pass
        moved.append(model.mesh.vertices)
    assert_array_equal(moved[1], moved[0][rows])
