"""Results are printed on one line, without arrays."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.cli.app import app

pytestmark = pytest.mark.usefixtures("coarse_starts")

BALL = sm.sphere(8)
RING = sm.torus(24, 12)
REBUILT = ("reconstruct", "--json", "--vertices", "100")


@pytest.mark.parametrize(
    ("edit", "expected"),
    [
        (
            lambda: sm.remove_face(BALL, 3),
            "Edited(SimplexMesh(1268 vertices, 636 faces, genus 0, 0 holes) of 1280 vertices)",
        ),
        (lambda: sm.regularize(BALL), f"Regularized({BALL!r} of 1280 vertices, swaps 0, 0 exceptions)"),
        (lambda: sm.cut(RING, sm.Contour.through(RING, [0, 5])), "faces ("),
        (lambda: sm.join(BALL, RING.moved(RING.vertices + 5), 0, 10), "contour Contour(12 vertices))"),
        (lambda: sm.open_holes(BALL, zones=[[1, 2]]), "of 1280 vertices, 1 proposals)"),
        (lambda: sm.EditableMesh(BALL).remove_faces([3, 3]), "Batch(1 of 2 done, 1 not: touched by an earlier edit)"),
    ],
)
def test_edits_are_printed_on_one_line(edit, expected):
    told = repr(edit())
    assert expected in told
    assert "\n" not in told
    assert "array" not in told


def test_matches_are_printed_with_their_angle():
    egg = sm.sphere(12)
    egg = egg.moved(egg.vertices * [1.6, 1.3, 1.0] + 0.1 * egg.vertices**2)
    quarter = np.array([[0, -1.0, 0], [1, 0, 0], [0, 0, 1]])
    found = sm.match(sm.sai(egg.moved(egg.vertices @ quarter.T), 6), sm.sai(egg, 6))[0]
    assert "turned by 90.0 degrees" in repr(found)


def test_warnings_are_at_the_line_that_called(tmp_path):
    """From any depth of calls, and through cached properties and context managers."""
    points = np.vstack([BALL.vertices, BALL.vertices[:3]])
    np.savetxt(tmp_path / "ball.xyz", points)
    two = np.vstack([BALL.vertices, 0.6 * BALL.vertices + 3.0])
    for call in (
        lambda: sm.reconstruct(points, vertices=100, iterations=10),
        lambda: sm.register(points, BALL),
        lambda: sm.dual((BALL.triangulated().vertices, np.vstack([BALL.triangulated().faces] * 2))),
        lambda: sm.reconstruct(two, vertices=200, iterations=10),
        lambda: sm.reconstruct(tmp_path / "ball.xyz", vertices=100, iterations=10),
        lambda: app([*REBUILT, *map(str, (tmp_path / "ball.xyz", "-o", tmp_path / "ball.vtp"))], standalone_mode=False),
    ):
        with pytest.warns(sm.SimplexMeshWarning) as caught:
            call()
        assert {each.filename for each in caught} == {__file__}
