"""Lines traced along the edges of a mesh."""

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.motion.creases.line import CreaseLine
from simplexmesh.motion.creases.paths import on_paths, traced
from simplexmesh.motion.creases.sides import crossed_edges, parts
from simplexmesh.motion.creases.tracing import MOST_TREES, Tracing, _trees, corners
from tests.nightly.marks import nightly

CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)


def cube_edges():
    ends = [(i, j) for i in range(8) for j in range(i) if np.abs(CORNERS[i] - CORNERS[j]).sum() == 2]
    return [CreaseLine(np.linspace(CORNERS[i], CORNERS[j], 20), closed=False, angle=np.pi / 2) for i, j in ends]


def octahedron_edges():
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    pairs = [(i, j) for i in range(6) for j in range(i) if i != j + 3]
    return [CreaseLine(np.linspace(corners[i], corners[j], 20), closed=False, angle=1.2) for i, j in pairs]


def inflated_cube(frequency=14, power=24):
    """A sphere pushed out towards the cube, with its edges rounded."""
    ball = sm.sphere(frequency)
    size = (np.abs(ball.vertices) ** power).sum(axis=1) ** (1 / power)
    return ball.moved(ball.vertices / size[:, None])


def ring(radius, height, count=90):
    turn = 2 * np.pi * np.arange(count) / count
    points = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(count, height)])
    return CreaseLine(points, closed=True, angle=1.0)


class TestCube:
    mesh = inflated_cube()
    paths = traced(mesh, cube_edges(), 0.0)

    def test_all_edges_are_traced_along_edges_of_the_mesh(self):
        assert sorted(path.line for path in self.paths) == list(range(12))
        linked = {tuple(sorted(edge)) for edge in self.mesh.connectivity.edge_vertices.tolist()}
        assert all(tuple(sorted(step)) in linked for path in self.paths for step in path.steps.tolist())

    def test_paths_meet_at_corners_only(self):
        counts = np.bincount(np.concatenate([path.vertices for path in self.paths]))
        assert sorted(counts[counts > 0].tolist())[-9:] == [1, *[3] * 8]
        nodes = np.flatnonzero(counts == 3)
        away = np.linalg.norm(self.mesh.vertices[nodes][:, None] - CORNERS, axis=2)
        assert sorted(away.argmin(axis=1).tolist()) == list(range(8))

    def test_places_are_on_the_lines_in_order(self):
        for path in self.paths:
            line = cube_edges()[path.line]
            start, end = line.points[[0, -1]] if np.allclose(path.places[0], line.points[0]) else line.points[[-1, 0]]
            share = (path.places - start) @ (end - start) / 4
            np.testing.assert_allclose(path.places, start + share[:, None] * (end - start), atol=1e-12)
            assert (share[0], share[-1]) == pytest.approx((0, 1), abs=1e-6)
            assert np.diff(share).min() > 0.3 / (len(share) - 1)
            beside = np.linalg.norm(np.cross(self.mesh.vertices[path.vertices] - start, end - start), axis=1) / 2
            moved = np.linalg.norm(self.mesh.vertices[path.vertices] - path.places, axis=1)
            assert np.median(moved - beside) < 0.02  # hardly along the line, whose vertices are 0.07 apart

    def test_they_cut_the_surface_into_its_six_sides(self):
        part, c = parts(self.mesh, self.paths), self.mesh.connectivity
        assert part.max() == 5
        assert crossed_edges(self.mesh, self.paths).sum() == sum(len(path.steps) for path in self.paths)
        normals = np.add.reduceat(self.mesh.vertices[c.face_vertices], c.face_offsets[:-1]) / c.face_sizes[:, None]
        for k in range(6):
            axis = np.abs(normals[part == k]).mean(axis=0).argmax()
            assert np.ptp(np.sign(normals[part == k][:, axis])) == 0


class TestOctahedron:
    lines = octahedron_edges()
    ball = sm.sphere(14)
    mesh = ball.moved(ball.vertices / (np.abs(ball.vertices) ** 1.1).sum(axis=1, keepdims=True))
    paths = traced(mesh, lines, 0.0)

    def test_corners_of_four_lines_are_two_vertices(self):
        ties = [path for path in self.paths if path.line < 0]
        assert len(ties) == 6
        assert sorted(path.line for path in self.paths if path.line >= 0) == list(range(12))
        ends = np.concatenate([path.vertices[[0, -1]] for path in self.paths])
        assert np.bincount(ends)[np.unique(ends)].tolist() == [3] * 12

    def test_they_cut_the_surface_into_its_eight_sides(self):
        assert parts(self.mesh, self.paths).max() == 7

    def test_their_vertices_are_at_the_corner(self):
        for path in self.paths:
            if path.line < 0:
                assert np.abs(np.linalg.norm(path.places.mean(axis=0)) - 1) < 1e-9
                assert 0 < np.linalg.norm(path.places[1] - path.places[0]) < 0.03


def test_lines_without_a_way_of_their_own_go_along_others():
    """A ring and an arc that crosses it: what they share is one path, and it ends where the arc leaves."""
    ball, turn = sm.sphere(12), np.linspace(0, 3, 80)
    arc = np.column_stack([np.cos(turn), np.sin(turn), 0.2 * (turn - 1.5)])
    arc = CreaseLine(arc / np.linalg.norm(arc, axis=1, keepdims=True), closed=False, angle=1.0)
    paths = traced(ball, [ring(1.0, 0.0), arc], 0.0)
    steps = np.concatenate([np.sort(path.steps, axis=1) for path in paths])
    assert len(np.unique(steps, axis=0)) == len(steps)
    inner = np.concatenate([path.vertices if path.closed else path.vertices[1:-1] for path in paths])
    assert (np.bincount(steps.ravel())[inner] == 2).all()
    assert {path.line for path in paths} == {0, 1}


@pytest.mark.parametrize("count", [7, 12, *nightly(20)])
def test_many_lines_meet_in_one_place(count):
    """Sets of vertices for a corner were three times as many for each more line, and 20 lines took forever."""
    trace = Tracing(sm.sphere(20), 0.0)
    assert len(_trees(trace, 100, min(count, 12) - 2)) <= MOST_TREES
    away = np.linspace(0.0, 0.7, 20)[:, None]
    turns = 2 * np.pi * np.arange(count) / count
    lines = [CreaseLine(np.sin(away) * [np.cos(t), np.sin(t), 0] + np.cos(away) * [0, 0, 1], False, 1.0) for t in turns]
    corner = corners(trace, lines)[0, 0]
    assert len(set(corner.vertices)) == count - 2
    assert len(set(corner.exits.values())) == count


class TestClosedLines:
    def test_a_ring_around_a_ball(self):
        ball = sm.sphere(10)
        (path,) = traced(ball, [ring(np.sqrt(1 - 0.3**2), 0.3)], 0.0)
        assert path.closed
        assert len(path.steps) == len(path.vertices)
        assert np.abs(ball.vertices[path.vertices][:, 2] - 0.3).max() < 0.15
        assert parts(ball, [path]).max() == 1
        turns = np.diff(np.unwrap(np.arctan2(path.places[:, 1], path.places[:, 0])))
        assert np.ptp(np.sign(turns)) == 0

    def test_lines_farther_from_the_mesh_than_what_they_were_found_on_rounds_have_no_path(self):
        assert traced(sm.sphere(6), [ring(3.0, 0.0)], 0.0) == []
        assert len(traced(sm.sphere(6), [ring(3.0, 0.0)], 1.0)) == 1

    def test_an_arc_does_not_take_the_short_way(self):
        ball, turn = sm.sphere(12), np.linspace(0.1, 2 * np.pi, 90)
        arc = CreaseLine(np.column_stack([np.cos(turn), np.sin(turn), np.zeros(90)]), closed=False, angle=1.0)
        (path,) = traced(ball, [arc], 0.0)
        assert np.linalg.norm(np.diff(path.places, axis=0), axis=1).sum() == pytest.approx(2 * np.pi - 0.1, abs=0.05)

    def test_two_rings_share_no_vertex(self):
        ball = sm.sphere(12)
        one, two = traced(ball, [ring(0.98, 0.1), ring(0.98, -0.1)], 0.0)
        assert not set(one.vertices.tolist()) & set(two.vertices.tolist())
        assert on_paths([one, two], ball.n_vertices).sum() == len(one.vertices) + len(two.vertices)


@pytest.mark.parametrize("closed", [False, True])
def test_pieces_are_what_is_kept(closed):
    ball = sm.sphere(8)
    (path,) = traced(ball, [ring(1.0, 0.0)], 0.0)
    if not closed:
        (path,) = path.pieces(np.arange(ball.n_vertices) != path.vertices[3])
        assert len(path.vertices) == len(path.steps) + 1
    kept = ~np.isin(np.arange(ball.n_vertices), path.vertices[[5, 9]])
    pieces = path.pieces(kept)
    assert len(pieces) == 3 - closed
    assert sum(len(piece.vertices) for piece in pieces) == len(path.vertices) - 2
    whole = {tuple(sorted(step)) for step in path.steps.tolist()}
    assert all(tuple(sorted(step)) in whole for piece in pieces for step in piece.steps.tolist())


@pytest.mark.parametrize("turns", [[(0.0, 2.0)], [(0.0, 2.0), (0.4, 1.6)]])
def test_sides_of_lines_that_end_are_parts(turns):
    """Arcs on a ball above each other, the upper ones shorter: each has another part above than below."""
    ball = sm.sphere(40)
    lines = []
    for k, (start, end) in enumerate(turns):
        turn, height = np.linspace(start, end, 60), 0.2 * k - 0.1
        x, y = np.sqrt(1 - height**2) * np.array([np.cos(turn), np.sin(turn)])
        lines.append(CreaseLine(np.column_stack([x, y, np.full(60, height)]), closed=False, angle=1.0))
    paths = traced(ball, lines, 0.0)
    part = parts(ball, paths)
    beside = part[ball.connectivity.edge_faces[crossed_edges(ball, paths)]]
    assert len(np.unique(part)) == len(turns) + 1
    assert (beside[:, 0] != beside[:, 1]).all()
