"""Surfaces that meet in edges of more than two triangles: taken apart, they are what other functions take."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import simplexmesh as sm


def blocks():
    """Two unit cubes that touch along one edge, with heights."""
    one, other = (trimesh.creation.box(bounds=[[k, k, 0], [k + 1, k + 1, 1]]) for k in (0, 1))
    both = trimesh.util.concatenate([one, other])
    mesh = sm.TriangleMesh(both.vertices, both.faces).welded(report=False)
    assert mesh.n_vertices == 14
    return mesh.with_data(height=mesh.vertices[:, 2]).in_unit("mm", "mm")


DOORS = {
    "feature_lines": lambda mesh: sm.feature_lines(mesh).lines,
    "zones": lambda mesh: sm.zones(mesh),
    "simplify": lambda mesh: sm.simplify(mesh, tolerance=0.01),
    "decimate": lambda mesh: sm.decimate(mesh, vertices=20).mesh.faces,
}


@pytest.mark.parametrize("door", DOORS)
def test_what_is_refused_is_taken_when_it_is_taken_apart(door):
    with pytest.raises(sm.TopologyError, match=r"has 4: .*; sm\.separated takes surfaces apart there$"):
        DOORS[door](blocks())
    with pytest.warns(sm.SimplexMeshWarning, match="1 edge has more than two triangles: .* were taken apart"):
        found = sm.separated(blocks())
    DOORS[door](found)


def test_bodies_keep_their_places_arrays_and_unit():
    with pytest.warns(sm.SimplexMeshWarning, match="1 edge has more than two triangles"):
        found = sm.separated(blocks())
    assert (found.n_components, found.genus, found.n_borders, found.unit) == (2, 0, 0, "mm")
    assert found.n_vertices == 2 * 8 + 2  # one in the middle of the edge, for each
    assert found.volume == pytest.approx(2)
    assert np.array_equal(found.data["height"], found.vertices[:, 2])


def test_seams_are_closed_first_and_sheets_stay_open():
    """Faces with vertices of their own, as files for display have, have no edge of more than two triangles."""
    mesh = blocks()
    fin = np.concatenate([mesh.vertices, [[0.5, 0.5, 2]]])
    faces = np.concatenate([mesh.faces, [[*mesh.faces[0, :2], 14]]])
    soup = sm.TriangleMesh(fin[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3))
    with pytest.raises(sm.TopologyError, match=r"; sm\.separated takes surfaces apart there$"):
        sm.feature_lines(soup)
    with pytest.warns(sm.SimplexMeshWarning, match="2 edges have more than two triangles"):
        found = sm.separated(soup)
    assert (found.n_components, found.n_borders) == (3, 1)
    assert sm.feature_lines(found).mesh.n_borders == 1
    assert sm.separated(found) is found


def tangle(seed):
    """Random triangles between a few points of a grid, many on each other."""
    rng = np.random.default_rng(seed)
    n, count = int(rng.integers(4, 8)), int(rng.integers(4, 24))
    corners = rng.integers(0, 3, (n, 3)).astype(float)
    return sm.TriangleMesh(corners, np.stack([rng.permutation(n)[:3] for _ in range(count)]))


@pytest.mark.filterwarnings("ignore:.* have more than two triangles")
def test_edges_are_halved_again_where_needed_and_what_stays_crowded_is_refused(monkeypatch):
    assert sm.separated(tangle(69)).topology.n_components >= 1
    for seed, rounds in ((69, 1), (157, 3)):
        monkeypatch.setattr("simplexmesh.data.cutting.separating.ROUNDS", rounds)
        with pytest.raises(sm.TopologyError, match=r"^surface cannot be taken apart at [1-9]\d* of the edges of more"):
            sm.separated(tangle(seed))


def test_a_surface_without_such_edges_is_returned_itself():
    ball = sm.sphere(3).triangulated()
    assert sm.separated(ball) is ball
    with pytest.raises(TypeError, match="surface must be a surface of triangles"):
        sm.separated(np.eye(5)[:, :3] + np.arange(5)[:, None])
