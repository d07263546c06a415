"""What points tell of lines: edges, fillets and bends."""

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.motion.creases.evidence import evidence
from simplexmesh.motion.creases.line import CreaseLine

SIDE = 0.1
LINE = CreaseLine(np.column_stack([np.linspace(0, 3, 60), np.zeros(60), np.zeros(60)]), closed=False, angle=np.pi / 2)


def roof(radius=0.0, noise=0.0, seed=0):
    """Points on two slopes of 45 degrees that meet above the line, rounded with a radius, five for a square of SIDE."""
    rng = np.random.default_rng(seed)
    x, u = rng.uniform(-0.5, 3.5, 12000), rng.uniform(-0.6, 0.6, 12000)
    flat = radius * np.sqrt(0.5)
    height = np.where(np.abs(u) > flat, -np.abs(u), np.sqrt(np.maximum(radius**2 - u**2, 0)) - 2 * flat)
    return np.column_stack([x, u, height]) + noise * rng.normal(size=(12000, 3))


def told(points, lines=(LINE,), side=SIDE):
    surface = sm.TriangleMesh([[-1, -1, 0], [4, -1, 0], [4, 1, 0], [-1, 1, 0.0]], [[0, 1, 2], [0, 2, 3]])
    return evidence(lines, surface, points, side)


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_an_edge_is_told_from_what_is_round(noise):
    assert told(roof(noise=noise)).together() > 10
    assert told(roof(0.4, noise)).together() < 0
    assert told(roof(0.03, noise)).together() > 5  # less than can be seen


def test_points_far_off_tell_nothing():
    assert told(roof() + np.array([0, 0, 5])) == (pytest.approx([0.0]), pytest.approx([0.0]))
    assert abs(told(roof(noise=0.3)).together()) < 4


def test_each_line_has_its_own():
    other = LINE._replace(points=LINE.points + np.array([0, 0.35, -0.35]))
    sharp, smooth = told(roof(noise=0.01), [LINE, other]).errors
    assert sharp > 10
    assert abs(smooth) < 4  # flat there: both are as close


def test_lines_near_each_other_do_not_see_each_others_edges():
    """A groove whose bottom and walls are narrower than what a line sees."""
    rng = np.random.default_rng(0)
    x, u = rng.uniform(-0.5, 3.5, 20000), rng.uniform(-0.8, 0.8, 20000)
    knots, depth = np.array([-0.16, -0.08, 0.08, 0.16]), np.array([0, 0.1, 0.1, 0])
    points = np.column_stack([x, u, np.interp(u, knots, -depth)]) + 0.004 * rng.normal(size=(20000, 3))
    lines = [LINE._replace(points=LINE.points + np.array([0, k, -d])) for k, d in zip(knots, depth, strict=True)]
    assert told(points, lines).errors.min() > 4
    assert told(points, lines[1:2]).together() < 0


def test_the_other_side_of_a_thin_wall_tells_nothing():
    """Edges of channels and cups of sheet were not told from what is round."""
    x, u = (axis.ravel() for axis in np.meshgrid(np.linspace(-0.5, 3.5, 81), np.linspace(-0.6, 0.6, 25), indexing="ij"))
    vertices = np.column_stack([x, u, -np.abs(u)])
    row = np.arange(81 * 25).reshape(81, 25)
    a, b, c, d = (part.ravel() for part in (row[:-1, :-1], row[1:, :-1], row[1:, 1:], row[:-1, 1:]))
    faces, down = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]), np.array([0, 0, -0.14])
    wall = sm.TriangleMesh(
        np.concatenate([vertices, vertices + down]), np.concatenate([faces, faces[:, ::-1] + row.size])
    )
    points = np.concatenate([roof(noise=0.01), roof(noise=0.01, seed=1) + down])
    assert evidence([LINE], wall, points, SIDE).together() > 10


def test_it_is_the_same_wherever_and_in_any_unit():
    points = roof(noise=0.01)
    corners = 20 * np.array([[-1, -1, 0], [4, -1, 0], [4, 1, 0], [-1, 1, 0.0]]) + 3
    line, surface = LINE._replace(points=20 * LINE.points + 3), sm.TriangleMesh(corners, [[0, 1, 2], [0, 2, 3]])
    far = evidence([line], surface, 20 * points + 3, 20 * SIDE)
    assert far.together() == pytest.approx(told(points).together(), rel=1e-6)
