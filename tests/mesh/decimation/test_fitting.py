"""Fitting: least squares against a naive reference, closest points against libigl."""

from __future__ import annotations

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from simplexmesh.mesh.decimation import _kernels_fitting as kernels
from simplexmesh.mesh.decimation.fitting import FittedMesh, SurfaceSamples, _shares, faces_of
from tests.mesh.decimation.reference import shaken
from tests.mesh.operators.test_editing import MESHES

names = st.sampled_from(["sphere", "torus", "plane", "cylinder", "torus with holes"])
seeds = st.integers(0, 2**16)


@given(seeds)
def test_the_closest_point_of_a_triangle_is_that_of_libigl(seed):
    rng = np.random.default_rng(seed)
    p, corners = rng.normal(size=3), rng.normal(size=(3, 3))
    found, *weights = kernels.closest_on_triangle(tuple(p), *map(tuple, corners))
    squared, _, closest = igl.point_mesh_squared_distance(p[None], corners, np.array([[0, 1, 2]]))
    assert_allclose(found, squared[0])
    assert_allclose(np.array([1 - sum(weights), *weights]) @ corners, closest[0], atol=1e-9)


@settings(max_examples=5)
@given(seeds)
def test_the_closest_points_of_a_rim_are_those_of_all_its_edges(seed):
    mesh, rng = shaken(MESHES["plane"], seed), np.random.default_rng(seed)
    f, v = faces_of(mesh.connectivity), mesh.vertices
    rim = np.flatnonzero(f.hole[f.owner])
    places = kernels.Locations(rng.choice(rim, 20).astype(np.int32), np.zeros((20, 3)))
    samples = v[f.vertices[places.corner]] + 0.3 * rng.normal(size=(20, 3))
    kernels.locate_on_rim(v, f, samples, places)
    start, edge = v[f.vertices[rim]], v[f.ahead[rim]] - v[f.vertices[rim]]
    share = ((samples[:, None] - start) * edge).sum(axis=2) / (edge**2).sum(axis=1)
    away = start + share.clip(0, 1)[:, :, None] * edge - samples[:, None]
    ends = v[f.vertices[places.corner]], v[f.ahead[places.corner]]
    there = sum(places.weights[:, k, None] * end for k, end in enumerate(ends))
    assert_allclose(np.linalg.norm(there - samples, axis=1), np.linalg.norm(away, axis=2).min(axis=1))


@pytest.mark.parametrize("name", ["plane", "torus with holes"])
def test_samples_of_rims_start_on_edges_between_their_face_and_their_hole(name):
    mesh = MESHES[name]
    faces, surface = len(mesh.connectivity.face_sizes), SurfaceSamples.of(mesh)
    alone = np.arange(faces, dtype=np.int32)
    fit = FittedMesh(surface, mesh, alone, np.zeros((faces, 3)), np.ones(mesh.n_vertices, bool))
    f, corner = fit._faces, fit._rim_locations.corner
    assert_array_equal(f.owner[corner], surface.rim_holes)
    assert_array_equal(f.owner[f.across[corner]], surface.rim_faces)


def problem(mesh, seed):
    """Random samples, locations and weights on a mesh."""
    rng, f, n, s = np.random.default_rng(seed), faces_of(mesh.connectivity), mesh.n_vertices, 50
    corner = rng.choice(np.flatnonzero(~f.hole[f.owner]), s).astype(np.int32)
    places = kernels.Locations(corner, rng.dirichlet((1, 1, 1), s))
    direction = rng.normal(size=(s, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    root = rng.normal(size=(n, 3, 3))
    terms = kernels.Terms(
        rng.normal(size=(s, 3)),
        direction,
        rng.uniform(1, 2, s),
        rng.uniform(0, 1, s),
        np.ascontiguousarray(mesh.neighbors, np.int32),
        rng.dirichlet((1, 1, 1), n),
        root @ root.transpose(0, 2, 1),
        rng.normal(size=(len(f.hole), 3)),
    )
    return f, places, terms


def energy(v, f, places, t):
    """The sum of squares, written out."""
    middle = np.array([v[f.vertices[a:b]].mean(axis=0) for a, b in zip(f.offsets, f.offsets[1:], strict=False)])
    c, w = places.corner, places.weights
    there = w[:, :1] * v[f.vertices[c]] + w[:, 1:2] * v[f.ahead[c]] + w[:, 2:] * middle[f.owner[c]]
    off = there - t.samples
    dot = (off * t.direction).sum(axis=1)
    total = (t.along * dot**2 + t.across * ((off**2).sum(axis=1) - dot**2)).sum()
    uneven = v - np.einsum("nj,njk->nk", t.share, v[t.neighbors])
    total += np.einsum("ni,nij,nj->", uneven, t.smooth, uneven)
    return total + ((t.flat[f.owner] * (v[f.vertices] - middle[f.owner])).sum(axis=1) ** 2).sum()


@settings(max_examples=5)
@given(name=names, seed=seeds)
def test_the_least_squares_are_minimal(name, seed):
    mesh = shaken(MESHES[name], seed)
    f, places, terms = problem(mesh, seed)
    v = np.array(mesh.vertices)
    gradient, middle = np.empty_like(v), np.empty((len(f.hole), 3))
    kernels.half_gradient(v, middle, f, places, terms, 1.0, gradient)
    step = np.random.default_rng(seed).normal(size=v.shape)
    ends = [energy(v + sign * step, f, places, terms) for sign in (1, -1)]
    assert_allclose((gradient * step).sum(), (ends[0] - ends[1]) / 4, atol=1e-9 * max(ends))
    best = kernels.conjugate_gradients(v, f, places, terms, 3000)
    least = energy(best, f, places, terms)
    for size in (1e-3, 1.0):
        assert energy(best + size * step, f, places, terms) > least
    assert energy(kernels.conjugate_gradients(v, f, places, terms, 5), f, places, terms) >= least * (1 - 1e-9)


@pytest.mark.parametrize("name", ["sphere", "plane", "torus with holes"])
def test_vertices_are_compared_with_the_mean_of_their_neighbors_and_on_a_rim_of_those_on_it(name):
    mesh = MESHES[name]
    c, v = mesh.connectivity, mesh.vertices
    wanted = v[mesh.neighbors].mean(axis=1)
    for hole in np.flatnonzero(c.face_is_hole):
        loop = c.face_vertices[c.face_offsets[hole] : c.face_offsets[hole + 1]]
        wanted[loop] = (v[np.roll(loop, 1)] + v[np.roll(loop, -1)]) / 2
    assert_allclose(np.einsum("nj,njk->nk", _shares(c), v[mesh.neighbors]), wanted, atol=1e-12)
