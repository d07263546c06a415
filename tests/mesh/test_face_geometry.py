"""Faces: areas, volumes and Gaussian measures have closed forms, powers of scale and sums fixed by the topology."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from simplexmesh.mesh import face_geometry, shapes
from tests.mesh import reference as reference
from tests.mesh.families import ALL, CLOSED, OPEN, flipped, renumbered, shaken, together
from tests.mesh.test_geometry import rotation

seeds = st.integers(0, 2**32 - 1)
meshes = st.builds(
    lambda name, seed: shaken(ALL[name], np.random.default_rng(seed)), st.sampled_from(sorted(ALL)), seeds
)


def loops(mesh):
    return mesh.connectivity.face_vertices, mesh.connectivity.face_offsets


@pytest.mark.parametrize("name", ALL)
def test_equal_their_naive_twins(name):
    mesh = ALL[name]
    faces = np.split(loops(mesh)[0], loops(mesh)[1][1:-1])
    points = [mesh.vertices[face] for face in faces]
    assert_allclose(
        face_geometry.face_centroids(mesh.vertices, *loops(mesh)), [p.mean(axis=0) for p in points], atol=1e-14
    )
    assert_allclose(mesh.face_areas, [reference.face_area(p) for p in points])
    assert_array_equal(face_geometry.following(*loops(mesh)), np.concatenate([np.roll(f, -1) for f in faces]))


class TestClosedForms:
    def test_cube(self):
        cube = shapes.sphere(1, "octahedron", radius=np.sqrt(3))
        assert_allclose(cube.area, 6 * 4)
        assert_allclose(cube.volume, 8)
        assert_allclose(cube.face_areas, 4)
        assert_allclose(cube.face_gauss, 4 * np.pi / 6)

    def test_normals_of_a_cube_are_unit_and_of_a_point_zero(self):
        cube = shapes.sphere(1, "octahedron", radius=np.sqrt(3))
        centers = face_geometry.face_centroids(cube.vertices, *loops(cube))
        assert_allclose(face_geometry.face_normals(cube.vertices, *loops(cube)), centers, atol=1e-14)
        assert_array_equal(face_geometry.face_normals(np.ones_like(cube.vertices), *loops(cube)), 0)

    def test_curved_centers_come_closer_to_a_sphere_with_order_four_and_stay_in_faces_between_creases(self):
        away = []
        for ball in (shapes.sphere(8), shapes.sphere(16)):
            centers = face_geometry.curved_centers(ball.vertices, ball.vertices, *loops(ball))
            away.append(np.abs(np.linalg.norm(centers, axis=1) - 1).max())
        assert away[0] < 1e-3
        assert away[1] < away[0] / 12
        for flat in (shapes.sphere(1, "octahedron"), ALL["plane"]):
            centers = face_geometry.curved_centers(flat.vertices, flat.normals, *loops(flat))
            assert_allclose(centers, face_geometry.face_centroids(flat.vertices, *loops(flat)), atol=1e-14)

    def test_ellipsoid_and_torus_from_inside(self):
        ball = shapes.ellipsoid((3, 2, 1), 40)
        assert 0.995 < ball.volume / (4 / 3 * np.pi * 6) < 1
        ring = shapes.torus(160, 60, radius=2.0, tube_radius=0.5)
        assert 0.995 < ring.volume / (2 * np.pi**2 * 2 * 0.25) < 1
        assert 0.995 < ring.area / (4 * np.pi**2 * 2 * 0.5) < 1

    def test_area_and_volume_of_a_sphere_converge_with_order_two(self):
        balls = [shapes.sphere(f) for f in (8, 16, 32)]
        for error in ([4 * np.pi - b.area for b in balls], [4 / 3 * np.pi - b.volume for b in balls]):
            assert_allclose(np.log2(np.array(error[:-1]) / error[1:]), 2, atol=0.1)

    def test_open_surfaces(self):
        assert_allclose(shapes.cylinder(200, 60, radius=2.0, height=3.0).area, 2 * np.pi * 2 * 3, rtol=1e-3)
        assert_allclose(shapes.cylinder(200, 60, radius=2.0, height=3.0).volume, np.pi * 4 * 3, rtol=1e-2)
        assert_allclose(shapes.plane(60, 40, size=(3, 2)).area, 6, rtol=1e-3)
        assert shapes.plane(6, 4).volume == pytest.approx(0, abs=1e-15)


class TestGauss:
    @given(mesh=meshes)
    def test_sums_to_a_multiple_of_the_sphere(self, mesh):
        total = mesh.face_gauss.sum() / (4 * np.pi)
        assert_allclose(total, np.round(total), atol=1e-9)

    @pytest.mark.parametrize("name", CLOSED)
    def test_sums_to_what_the_genus_says(self, name):
        mesh = CLOSED[name]
        assert_allclose(mesh.face_gauss.sum(), 4 * np.pi * (mesh.n_components - mesh.genus), atol=1e-9)

    def test_adds_over_components(self):
        mesh = together(CLOSED["torus"], CLOSED["ellipsoid"], CLOSED["icosahedron-2"])
        assert_allclose(mesh.face_gauss.sum(), 8 * np.pi)

    def test_is_the_integral_of_the_curvature(self):
        ring = shapes.torus(120, 40, radius=2.0, tube_radius=0.7)
        centers = face_geometry.face_centroids(ring.vertices, *loops(ring))
        cosine = (np.hypot(*centers.T[:2]) - 2.0) / 0.7
        K = cosine / (0.7 * (2 + 0.7 * cosine))
        assert_allclose(ring.face_gauss / ring.face_areas, K, atol=0.02 * np.abs(K).max())

    def test_vanishes_on_a_flat_face(self):
        flat = shapes.plane(5, 5)
        assert_allclose(flat.face_gauss, 0, atol=1e-12)


class TestInvariance:
    @given(mesh=meshes, seed=seeds, log_scale=st.floats(-3, 3))
    def test_rigid_motion_and_scale(self, mesh, seed, log_scale):
        rng = np.random.default_rng(seed)
        Q, t, s = rotation(rng), rng.normal(size=3), 10**log_scale
        other = mesh.moved(s * (mesh.vertices @ Q.T + t))
        assert_allclose(other.area, s**2 * mesh.area, rtol=1e-9)
        assert_allclose(other.volume, s**3 * mesh.volume, rtol=1e-6, atol=1e-9 * s**3)
        assert_allclose(other.face_areas, s**2 * mesh.face_areas, rtol=1e-8)
        assert_allclose(np.exp(0.5j * other.face_gauss), np.exp(0.5j * mesh.face_gauss), atol=1e-5)

    @given(mesh=meshes, seed=seeds)
    def test_renumbering_and_orientation(self, mesh, seed):
        other = renumbered(mesh, np.random.default_rng(seed).permutation(mesh.n_vertices))
        assert_allclose(np.sort(other.face_areas), np.sort(mesh.face_areas), rtol=1e-9)
        assert_allclose(other.volume, mesh.volume, rtol=1e-9, atol=1e-12)
        assert_allclose(flipped(mesh).volume, -mesh.volume, rtol=1e-9, atol=1e-12)
        assert_allclose(flipped(mesh).area, mesh.area)
        total = [m.face_gauss[~m.connectivity.face_is_hole].sum() for m in (mesh, flipped(mesh))]
        assert_allclose(*np.exp(0.5j * np.array(total)), atol=1e-6)  # K has no orientation


def test_inversions_are_counted_on_a_fold():
    mesh = shapes.sphere(6)
    vectors = face_geometry.fan_vectors(mesh.vertices, *loops(mesh))
    at_corners = mesh.normals[mesh.connectivity.face_vertices]
    inversions = face_geometry.face_inversions(vectors, at_corners, *loops(mesh))
    assert not inversions.any()
    against = face_geometry.face_inversions(vectors, -at_corners, *loops(mesh))
    assert_array_equal(against, mesh.connectivity.face_sizes)


@pytest.mark.parametrize("name", OPEN)
def test_holes_have_no_part_in_the_area(name):
    mesh = OPEN[name]
    holes = mesh.connectivity.face_is_hole
    assert_allclose(mesh.area, mesh.face_areas.sum() - mesh.face_areas[holes].sum())
    assert len(mesh.faces) == mesh.n_faces == (~holes).sum()
