"""Invalid input of operators, batches and contours: one sentence that names the argument and the exact reason."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import simplexmesh as sm
from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh.contours import Contour
from simplexmesh.mesh.operators import seams
from simplexmesh.mesh.operators.cut_join import together
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from tests.mesh.operators.test_editing import anywhere, heawood, k33_on_the_torus

BALL = sm.sphere(4)
OTHER = sm.sphere(8)
TUBE = sm.cylinder(9, 4)
LOOP = BALL.faces[0].tolist()
PAIRS = [(LOOP[0], LOOP[1]), (LOOP[2], LOOP[3])]
NAMED = " and ".join(f"{a}-{b}" for a, b in PAIRS)
HOLE = int(TUBE.connectivity.face_is_hole.argmax())

NAMES = [  # what edges and faces may be called
    (lambda: sm.remove_edge(BALL, "a"), TypeError, "edge must be a dart or the two ends of an edge, not str 'a'"),
    (
        lambda: sm.remove_edge(BALL, None),
        TypeError,
        "edge must be a dart or the two ends of an edge, not NoneType None",
    ),
    (lambda: sm.swap_edge(BALL, 1.5), TypeError, "edge must be a dart or the two ends of an edge, not float 1.5"),
    (lambda: sm.swap_edge(BALL, True), TypeError, "edge must be a dart or the two ends of an edge, not bool True"),
    (lambda: sm.remove_edge(BALL, -1), ValueError, "edge must be at least 0, not -1"),
    (lambda: sm.remove_edge(BALL, 960), ValueError, "edge must be at most 959, not 960"),
    (lambda: sm.remove_edge(BALL, (0.5, 1)), TypeError, "edge must be whole numbers, not float64"),
    (lambda: sm.remove_edge(BALL, (0, -1)), ValueError, "edge[1] is -1, outside 0..319"),
    (lambda: sm.remove_edge(BALL, (320, 0)), ValueError, "edge[0] is 320, outside 0..319"),
    (lambda: sm.remove_edge(BALL, (0, 1, 2)), ValueError, "edge must have shape (2,), not (3,)"),
    (
        lambda: sm.swap_edge(BALL, [[0, 1], [2]]),
        ValueError,
        "edge must be an array, but its rows have different lengths",
    ),
    (lambda: sm.remove_edge(BALL, (True, False)), TypeError, "edge must be whole numbers, not bool"),
    (lambda: sm.remove_edge(BALL, (7, 7)), TopologyError, "edge must be two neighboring vertices; 7 and 7 are not"),
    (lambda: sm.remove_face(BALL, 1.0), TypeError, "face must be a whole number, not float 1.0"),
    (lambda: sm.remove_face(BALL, -1), ValueError, "face must be at least 0, not -1"),
    (lambda: sm.refine_face(BALL, 162), ValueError, "face must be at most 161, not 162"),
    (lambda: sm.refine_face(BALL, [1]), TypeError, "face must be a whole number, not list [1]"),
    (lambda: sm.join(BALL, 0, 2.0), TypeError, "face_b must be a whole number, not float 2.0"),
    (lambda: sm.join(BALL, -1, 2), ValueError, "face_a must be at least 0, not -1"),
    (lambda: sm.join(BALL, BALL, 162, 2), ValueError, "face_a must be at most 161, not 162"),
    (lambda: sm.join(BALL, BALL, 0, 162), ValueError, "face_b must be at most 161, not 162"),
    (lambda: sm.join("x", BALL, 0, 2), TypeError, "mesh_a must be a SimplexMesh, not str"),
    (lambda: sm.join(BALL, 0, BALL, 2), TypeError, "mesh_b must be a SimplexMesh, not int"),
    (lambda: sm.remove_edge(BALL.vertices, 0), TypeError, "mesh must be a SimplexMesh, not ndarray"),
    (lambda: sm.cut(None, LOOP), TypeError, "mesh must be a SimplexMesh, not NoneType"),
    (lambda: sm.parts(None), TypeError, "mesh must be a SimplexMesh, not NoneType"),
    (lambda: sm.regularize(3), TypeError, "mesh must be a SimplexMesh, not int"),
    (lambda: together(), TypeError, "together takes at least one mesh"),
    (
        lambda: sm.join(BALL.with_data(x=np.zeros(320)), OTHER.with_data(x=np.zeros((1280, 2))), 0, 0),
        ValueError,
        "data 'x' must have the same shape in all parts, not () and (2,)",
    ),
]
INSERTIONS = [
    (lambda: sm.insert_edge(BALL, *PAIRS, at=(0.5,)), ValueError, "at must have shape (2,), not (1,)"),
    (lambda: sm.insert_edge(BALL, *PAIRS, at=(0.5, np.nan)), ValueError, "at must be finite; at[1] is nan"),
    (lambda: sm.insert_edge(BALL, *PAIRS, at=np.nan), ValueError, "at must be finite, not nan"),
    (lambda: sm.insert_edge(BALL, *PAIRS, at=(0.5, 1)), ValueError, "at must be strictly between 0 and 1, not 1"),
    (lambda: sm.insert_edge(BALL, *PAIRS, at=0), ValueError, "at must be strictly between 0 and 1, not 0"),
    (lambda: sm.insert_edge(BALL, *PAIRS, at="ab"), TypeError, "at must be a number, not str"),
    (lambda: sm.insert_edge(BALL, *PAIRS, at=True), TypeError, "at must be a number, not bool"),
    (
        lambda: sm.insert_edge(BALL, *PAIRS, at=[[0.5], 1]),
        ValueError,
        "at must be an array, but its rows have different",
    ),
    (lambda: sm.insert_edge(BALL, *PAIRS, face=999), ValueError, "face must be at most 161, not 999"),
    (lambda: sm.insert_edge(BALL, *PAIRS, face=100), TopologyError, f"edges {NAMED} are not both on face 100"),
    (
        lambda: sm.insert_edge(BALL, PAIRS[0], PAIRS[0][::-1]),
        TopologyError,
        f"edges {LOOP[0]}-{LOOP[1]} and {LOOP[1]}-{LOOP[0]} are the same; an edge is inserted between two different",
    ),
]
LINES = [  # what is no contour, and what cannot be cut along
    (lambda: sm.cut(BALL, []), TopologyError, "contour must have at least 3 vertices, not 0"),
    (lambda: sm.cut(BALL, LOOP[:2]), TopologyError, "contour must have at least 3 vertices, not 2"),
    (
        lambda: sm.cut(BALL, LOOP[:-1]),
        TopologyError,
        f"contour is not closed: vertices {LOOP[-2]} and {LOOP[0]} are not neighbors",
    ),
    (
        lambda: sm.cut(BALL, [*LOOP, LOOP[0]]),
        TopologyError,
        f"contour must not touch itself, but visits vertex {LOOP[0]} twice",
    ),
    (lambda: sm.cut(BALL, LOOP), TopologyError, "contour cannot be cut: it is face 0 itself, so there is nothing"),
    (
        lambda: sm.cut(BALL, LOOP[::-1]),
        TopologyError,
        "contour cannot be cut: it is face 0 itself, so there is nothing",
    ),
    (
        lambda: sm.cut(TUBE, Contour.of_face(TUBE, HOLE)),
        TopologyError,
        f"contour cannot be cut: it is face {HOLE} itself",
    ),
    (lambda: sm.cut(BALL, [0.0, 1.0, 2.0]), TypeError, "contour must be whole numbers, not float64"),
    (lambda: sm.cut(BALL, [[0, 1], [1, 2]]), ValueError, "contour must have shape (*,), not (2, 2)"),
    (lambda: sm.cut(BALL, [0, -1, 2]), ValueError, "contour[1] is -1, outside 0..319"),
    (lambda: sm.cut(BALL, [0, 1, 320]), ValueError, "contour[2] is 320, outside 0..319"),
    (lambda: sm.cut(BALL, Contour.of_face(OTHER, 3)), TopologyError, "contour must run along edges"),
    (lambda: Contour(BALL, None), TypeError, "contour must be numbers of shape (*,), not NoneType of object"),
    (lambda: Contour(BALL, np.zeros(320, bool)), TypeError, "contour must be whole numbers, not bool"),
    (lambda: Contour(BALL, [[0, 1], [2]]), ValueError, "contour must be an array, but its rows have different lengths"),
    (lambda: Contour(None, LOOP), TypeError, "mesh must be a SimplexMesh, not NoneType"),
    (lambda: Contour.of_face(None, 0), TypeError, "mesh must be a SimplexMesh, not NoneType"),
    (lambda: Contour.of_faces(None, [0]), TypeError, "mesh must be a SimplexMesh, not NoneType"),
    (lambda: Contour.of_holes(None), TypeError, "mesh must be a SimplexMesh, not NoneType"),
    (lambda: Contour.through(None, [0, 1]), TypeError, "mesh must be a SimplexMesh, not NoneType"),
    (lambda: Contour.of_face(BALL, 162), ValueError, "face must be at most 161, not 162"),
    (lambda: Contour.of_faces(BALL, [0.5]), TypeError, "faces must be whole numbers, not float64"),
    (lambda: Contour.of_faces(BALL, [True]), ValueError, "faces must have shape (162,), not (1,)"),
    (lambda: Contour.through(BALL, [1, 999]), ValueError, "at[1] is 999, outside 0..319"),
    (lambda: Contour.through(BALL, [1, 1]), ValueError, "at must be at least 2 different vertices, not [1, 1]"),
]
BATCHES = [
    (lambda e: e.remove_edges([1.5]), TypeError, "darts must be whole numbers, not float64"),
    (lambda e: e.remove_edges([[1, 2]]), ValueError, "darts must have shape (*,), not (1, 2)"),
    (lambda e: e.remove_edges(3), ValueError, "darts must have shape (*,), not ()"),
    (lambda e: e.swap_edges([-1]), ValueError, "darts[0] is -1, outside 0..959"),
    (lambda e: e.swap_edges([0, 2**40]), ValueError, "darts[1] is 1099511627776, outside 0..959"),
    (lambda e: e.swap_edges(np.ones(7, bool)), ValueError, "darts must have shape (960,), not (7,)"),
    (lambda e: e.swap_edges("a"), TypeError, "darts must be numbers of shape (*,), not"),
    (lambda e: e.insert_edges([0], [2], [1, 2, 3]), ValueError, "at must have shape (2,), not (3,)"),
    (lambda e: e.insert_edges([0], [2], [[0.5, 0.5]] * 2), ValueError, "at must have shape (1, 2), not (2, 2)"),
    (lambda e: e.refine_faces([162]), ValueError, "faces[0] is 162, outside 0..161"),
    (lambda e: e.refine_faces([0.5]), TypeError, "faces must be whole numbers, not float64"),
    (lambda e: e.remove_faces([[0]]), ValueError, "faces must have shape (*,), not (1, 1)"),
    (lambda e: e.cut([]), TopologyError, "contour must have at least 3 vertices, not 0"),
    (lambda e: e.cut([-1, 2, 3]), ValueError, "darts[0] is -1, outside 0..959"),
    (lambda e: e.cut(np.ones(960, bool)), TypeError, "darts must be whole numbers, not bool"),
    (lambda e: e.values([320]), ValueError, "at[0] is 320, outside 0..319"),
    (lambda e: e.values(None), TypeError, "at must be numbers of shape (*,), not NoneType of object"),
    (lambda e: e.set_values([0], [[0, np.nan, 0]]), ValueError, "values must be finite; values[0, 1] is nan"),
    (lambda e: e.set_values([0, 1], [[0, 0, 0]]), ValueError, "values must have shape (2, 3), not (1, 3)"),
    (lambda e: e.even_out("a"), TypeError, "limit must be a whole number, not str 'a'"),
    (lambda e: e.even_out(-1), ValueError, "limit must be at least 0, not -1"),
    (lambda e: e.faces_beside(960), ValueError, "dart must be at most 959, not 960"),
    (lambda e: e.ends(-1), ValueError, "dart must be at least 0, not -1"),
    (lambda e: e.undo(-1), ValueError, "count must be at least 0, not -1"),
    (lambda e: e.undo(1.5), TypeError, "count must be a whole number, not float 1.5"),
    (lambda e: e.around(162), ValueError, "face must be at most 161, not 162"),
    (
        lambda e: [e.remove_edges([0]), e.dart("edge", 0)],
        TopologyError,
        "edge ends at vertex 0, which was removed by an earlier edit",
    ),
]


@pytest.mark.parametrize(("action", "kind", "message"), NAMES + INSERTIONS + LINES)
def test_functions_say_what_is_wrong(action, kind, message):
    with pytest.raises(kind, match="^" + re.escape(message)) as caught:
        action()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("action", "kind", "message"), BATCHES)
def test_batches_say_what_is_wrong_and_do_nothing(action, kind, message):
    edit = EditableMesh(BALL)
    with pytest.raises(kind, match="^" + re.escape(message)) as caught:
        action(edit)
    assert "\n" not in str(caught.value)
    edit.undo()
    assert_array_equal(edit.result().mesh.connectivity.twin, BALL.connectivity.twin)


def test_masks_are_taken_as_the_numbers_that_they_mark():
    c = BALL.connectivity
    for call, count in (("swap_edges", c.twin.size), ("refine_faces", len(c.face_sizes))):
        mask = np.random.default_rng(0).random(count) < 0.1
        one, other = EditableMesh(BALL), EditableMesh(BALL)
        assert getattr(one, call)(mask).reasons == getattr(other, call)(np.flatnonzero(mask)).reasons
        assert_array_equal(one.result().mesh.connectivity.twin, other.result().mesh.connectivity.twin)


def test_removed_faces_are_reported():
    edit = EditableMesh(BALL)
    left, right = edit.faces_beside(0)
    edit.remove_edges([0])
    gone = left if edit._darts.face_dart[left] < 0 else right
    for action in (lambda: edit.join(gone, 100), lambda: edit.around(gone)):
        with pytest.raises(TopologyError, match=f"{gone} was removed by an earlier edit"):
            action()
    assert edit.refine_faces([gone]).reasons == {"touched by an earlier edit": 1}


def test_no_edge_of_an_incomplete_or_smallest_mesh_is_legal():
    """K3,3 on the torus (thesis, figure 2.24), and the smallest complete torus: seven hexagons, all adjacent."""
    for connectivity, reason in ((k33_on_the_torus(), "mesh is not complete"), (heawood(), "is adjacent to both its")):
        mesh = anywhere(connectivity)
        for dart in range(connectivity.twin.size):
            with pytest.raises(TopologyError, match=reason):
                sm.remove_edge(mesh, dart)


def test_every_reason_to_refuse_a_join_occurs():
    """All pairs of faces on small meshes: each refusal has the right reason, each joined mesh is complete."""
    reasons = set()
    for mesh in (sm.sphere(3), sm.torus(9, 6)):
        c = mesh.connectivity
        beside = np.eye(len(c.face_sizes), dtype=bool)
        beside[c.edge_faces[:, 0], c.edge_faces[:, 1]] = beside[c.edge_faces[:, 1], c.edge_faces[:, 0]] = True
        for a in (0, 5):
            for b in range(len(c.face_sizes)):
                edit = EditableMesh(mesh)
                try:
                    edit.join(a, b)
                except TopologyError as error:
                    reason = re.sub(r"\d+", "#", str(error).split(": ")[1])
                    reasons.add(reason)
                    assert (reason == "they are the same") == (a == b)
                    assert (reason == "they share an edge") == (a != b and beside[a, b])
                    third = (beside[a] & beside[b]).any() and not beside[a, b]
                    assert (reason == "face # shares an edge with both") == third
    assert reasons == {
        "they are the same",
        "they share an edge",
        "face # shares an edge with both",
        "faces # and #, which would share an edge there, already share one",
    }


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_side_with_too_few_edges_cannot_be_closed(side):
    """No complete mesh has such a contour: the faces between two edges on one side would share both."""
    left = np.array([True, True, False, False, False])
    seam = seams.Seam(np.arange(0, 15, 3), np.arange(2, 17, 3), left if side == "left" else ~left)
    reason = seams.refusal_to_cut(seam, np.arange(20, dtype=np.int32))
    assert reason == f"it has 2 edges on its {side}, where a cut needs at least 3"
