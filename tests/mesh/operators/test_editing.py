"""The editable mesh: sequences of T1 to T4 and T7 against a reference of face loops, and their undo."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh import shapes
from simplexmesh.mesh.check import check
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from tests.mesh.families import CLOSED, OPEN, together
from tests.mesh.operators.reference import Loops


def two_tori():
    one = shapes.torus(9, 6)
    edit = EditableMesh(together(one, one.moved(one.vertices + 3.0)))
    edit.join(3, one.n_faces + 3)
    return edit.result().mesh


def with_holes(mesh, *darts):
    return SimplexMesh(mesh.vertices, Connectivity(mesh.connectivity.twin, darts))


MESHES = {
    "sphere": CLOSED["icosahedron-2"],
    "tetrahedron": CLOSED["tetrahedron-1"],
    "cube": CLOSED["octahedron-1"],
    "torus": CLOSED["torus"],
    "two tori": two_tori(),
    "plane": OPEN["plane"],
    "cylinder": OPEN["cylinder"],
    "torus with holes": with_holes(CLOSED["torus"], 0, 100, 200),
    "two tori with holes": with_holes(two_tori(), 7),
}
names = st.sampled_from(sorted(MESHES))
seeds = st.integers(0, 2**32 - 1)


def alive_darts(edit):
    return np.flatnonzero(np.repeat(edit._darts.alive[: edit._darts.used[0]], 3))


def random_edit(edit, loops, rng):
    """Apply one edit to both; return its kind, whether it was done, and the reason given."""
    kind = rng.choice(["remove", "insert", "swap"], p=[0.35, 0.35, 0.3])
    dart = int(rng.choice(alive_darts(edit)))
    a, b = dart // 3, int(edit._darts.twin[dart]) // 3
    if kind == "insert":
        face = int(edit._darts.face[dart])
        other = int(rng.choice(edit.around(face)))
        batch = edit.insert_edges([dart], [other])
        expected = 4 if dart == other else 0
        if not expected:
            w, x = other // 3, next(y for x, y in loops.edges(loops.left_of(a, b)) if x == other // 3)
            loops.insert(a, b, w, x)
    else:
        batch = (edit.remove_edges if kind == "remove" else edit.swap_edges)([dart])
        expected = getattr(loops, f"refuse_{kind}")(a, b)
        if not expected:
            getattr(loops, kind)(a, b)
    assert batch.status[0] == expected
    assert batch.done[0] == (expected == 0)
    return kind, bool(batch.done[0])


def labels_hold(edit):
    """Check that what is stored beside the twins is consistent with them."""
    d, (n, f, _) = edit._darts, edit._used
    for face in range(f):
        if d.face_dart[face] >= 0:
            darts = edit.around(face)
            assert (d.face[darts] == face).all()
            assert d.face_size[face] == len(darts)
    assert (d.face_dart[d.face[np.flatnonzero(np.repeat(d.alive[:n], 3))]] >= 0).all()


def complete(connectivity):
    c = connectivity
    left, right = np.sort(c.edge_faces, axis=1).T.astype(np.int64)
    return (left != right).all() and len(np.unique(left * len(c.face_sizes) + right)) == len(left)


CHANGE = {"remove": (-2, -3, -1), "insert": (2, 3, 1), "swap": (0, 0, 0)}


@given(name=names, seed=seeds)
@settings(max_examples=settings.default.max_examples // 3)
def test_sequences_equal_their_twin_and_can_be_undone(name, seed):
    mesh, rng = MESHES[name], np.random.default_rng(seed)
    start = mesh.connectivity
    edit, loops = EditableMesh(mesh), Loops(start)
    counts = start.n_vertices, start.n_edges, len(start.face_sizes)
    for _ in range(200):
        kind, done = random_edit(edit, loops, rng)
        if not done:
            continue
        counts = tuple(np.add(counts, CHANGE[kind]))
        if rng.random() < 0.1:
            labels_hold(edit)
            c = edit.result().mesh.connectivity
            number = np.cumsum(edit._darts.alive[: edit._used[0]]) - 1
            assert loops.canonical(number) == Loops(c).canonical()
            assert (c.n_vertices, c.n_edges, len(c.face_sizes)) == counts
            assert (c.genus, c.n_components) == (start.genus, start.n_components)
            assert complete(c)
    edit.undo()
    back = edit.result()
    assert_array_equal(back.mesh.connectivity.twin, start.twin)
    assert_array_equal(back.mesh.connectivity.hole_darts, start.hole_darts)
    assert_array_equal(back.mesh.vertices, mesh.vertices)
    assert_array_equal(back.vertex_map, np.arange(start.n_vertices))
    assert_array_equal(back.face_map, np.arange(len(start.face_sizes)))


@given(name=names, seed=seeds)
def test_joins_and_cuts_among_the_others_are_undone(name, seed):
    mesh, rng = MESHES[name], np.random.default_rng(seed)
    edit, start = EditableMesh(mesh), mesh.connectivity
    loops = Loops(start)  # only to keep random_edit company until the first join
    for _ in range(10):
        random_edit(edit, loops, rng)
    joined = 0
    for _ in range(40):
        before = edit.result().mesh.connectivity
        faces = np.flatnonzero(edit._darts.face_dart[: edit._used[1]] >= 0)
        a, b = rng.choice(faces, 2)
        try:
            seam = edit.join(int(a), int(b))
        except TopologyError:
            edit.remove_edges(rng.choice(alive_darts(edit), 1))
            continue
        joined += 1
        labels_hold(edit)
        c = edit.result().mesh.connectivity
        assert complete(c)
        assert c.n_vertices == before.n_vertices
        assert len(c.face_sizes) == len(before.face_sizes) - 2
        assert c.genus - c.n_components == before.genus - before.n_components + 1
        if rng.random() < 0.5:  # T3 along the seam undoes T4
            edit.cut(seam.onward)
            labels_hold(edit)
            assert_array_equal(edit.result().mesh.connectivity.twin, before.twin)
        edit.swap_edges(rng.choice(alive_darts(edit), 3))
    edit.undo(3)
    labels_hold(edit)
    edit.undo()
    labels_hold(edit)
    assert edit.n_edits == 0
    assert_array_equal(edit.result().mesh.connectivity.twin, start.twin)
    assert_array_equal(edit.result().mesh.connectivity.hole_darts, start.hole_darts)
    assert_array_equal(edit.result().mesh.vertices, mesh.vertices)


def outline(edit, faces):
    """The darts of one boundary loop of a set of faces."""
    inside = np.isin(edit._darts.face, sorted(faces))
    dart = next((int(d) for f in faces for d in edit.around(f) if not inside[edit._darts.twin[d]]), None)
    out = []
    while dart is not None and dart not in out:
        out.append(dart)
        back = int(edit._darts.twin[dart])
        ahead = 3 * (back // 3) + (back + 2) % 3
        dart = ahead if not inside[edit._darts.twin[ahead]] else 3 * (back // 3) + (back + 1) % 3
    return np.array(out, int)


def any_edit(edit, rng):
    """Apply one of the seven operators somewhere; return the expected change of V - E + F, None if refused."""
    dart = int(rng.choice(alive_darts(edit)))
    face = edit.faces_beside(dart)[0]
    kind = int(rng.integers(1, 8))
    try:
        if kind == 3:
            zone = {face, *(edit.faces_beside(int(d))[1] for d in edit.around(face))}
            edit.cut(outline(edit, zone), holes=bool(rng.integers(2)))
            return 2
        if kind == 4:
            edit.join(face, int(edit._darts.face[rng.choice(alive_darts(edit))]))
            return -2
        if kind in (5, 6):
            done = (edit.remove_faces if kind == 5 else edit.refine_faces)([face])
            return 0 if done.done.all() else None
    except TopologyError:
        return None
    done = {
        1: lambda: edit.remove_edges([dart]),
        2: lambda: edit.insert_edges([dart], rng.choice(edit.around(face), 1)),
        7: lambda: edit.swap_edges([dart]),
    }[kind]()
    return 0 if done.done.all() else None


@given(name=names, seed=seeds)
def test_all_seven_in_any_order_keep_the_mesh_complete_and_are_undone(name, seed):
    mesh, rng = MESHES[name], np.random.default_rng(seed)
    edit, start = EditableMesh(mesh), mesh.connectivity
    euler = start.euler
    for _ in range(100):
        before = edit.n_edits
        change = any_edit(edit, rng)
        if change is None:
            assert edit.n_edits == before
            continue
        euler += change
        c = edit.result().mesh.connectivity
        assert complete(c)
        assert c.euler == euler == 2 * (c.n_components - c.genus)
    labels_hold(edit)
    edit.undo(edit.n_edits // 2)
    labels_hold(edit)
    edit.undo()
    labels_hold(edit)
    back = edit.result().mesh
    assert_array_equal(back.connectivity.twin, start.twin)
    assert_array_equal(back.connectivity.hole_darts, start.hole_darts)
    assert_array_equal(back.vertices, mesh.vertices)


def k33_on_the_torus():
    """Three hexagons, each pair sharing three edges."""
    neighbors = [[3, 4, 5], [3, 4, 5], [3, 4, 5], [0, 1, 2], [0, 1, 2], [0, 1, 2]]
    return Connectivity.from_neighbors(neighbors)


def heawood():
    """The smallest complete torus: seven hexagons, each adjacent to all others."""
    i = np.arange(7)
    even = np.stack([7 + i, 7 + (i + 1) % 7, 7 + (i + 3) % 7], axis=1)
    odd = np.stack([i, (i - 1) % 7, (i - 3) % 7], axis=1)
    return Connectivity.from_neighbors(np.concatenate([even, odd]))


def anywhere(connectivity):
    return SimplexMesh(np.random.default_rng(0).normal(size=(connectivity.n_vertices, 3)), connectivity)


def test_k33_is_refused_as_incomplete():
    c = k33_on_the_torus()
    assert (c.genus, c.face_sizes.tolist()) == (1, [6, 6, 6])
    with pytest.raises(
        TopologyError, match=r"mesh is not complete: faces . and ., on both sides of edge .-., are the same or"
    ):
        EditableMesh(anywhere(c))


def test_the_least_complete_torus_has_no_legal_edge():
    c = heawood()
    assert (c.genus, c.face_sizes.tolist()) == (1, [6] * 7)
    edit = EditableMesh(anywhere(c))
    darts = np.arange(42)
    assert edit.remove_edges(darts).reasons == {"a face is adjacent to both sides": 42}
    assert edit.swap_edges(darts).reasons == {"opposite faces are adjacent": 42}
    assert edit.n_edits == 0


def test_data_is_interpolated_on_new_vertices_and_kept_on_old():
    mesh = shapes.sphere(3)
    mesh = mesh.with_data(height=mesh.vertices[:, 2], number=np.arange(mesh.n_vertices), pair=mesh.vertices[:, :2])
    edit = EditableMesh(mesh)
    face = edit.around(5)
    edit.insert_edges([face[0]], [face[3]], [[0.25, 0.75]])
    new = edit.result().mesh
    np.testing.assert_allclose(new.data["height"], new.vertices[:, 2], atol=1e-15)
    np.testing.assert_allclose(new.data["pair"], new.vertices[:, :2], atol=1e-15)
    a, b, c, d = face[[0, 1, 3, 4]] // 3
    np.testing.assert_allclose(new.vertices[-2], 0.75 * mesh.vertices[a] + 0.25 * mesh.vertices[b])
    np.testing.assert_allclose(new.vertices[-1], 0.25 * mesh.vertices[c] + 0.75 * mesh.vertices[d])
    assert new.data["number"].tolist() == [*range(mesh.n_vertices), a, d]


def test_data_keeps_its_type_and_shape_even_without_numbers():
    mesh = shapes.sphere(2)
    n = mesh.n_vertices
    data = {"none": np.zeros((n, 0)), "half": np.ones(n, np.float16), "flag": np.ones(n, bool), "t": np.ones((n, 2, 2))}
    edit = EditableMesh(mesh.with_data(**data))
    edit.refine_faces([0])
    edit.swap_edges([100])
    for name, values in edit.result().mesh.data.items():
        assert values.dtype == data[name].dtype
        assert values.shape == (edit.n_slots, *data[name].shape[1:])
        assert (values == 1).all()


def test_joined_holes_are_holes_again_when_undone():
    mesh = MESHES["torus with holes"]
    holes = np.flatnonzero(mesh.connectivity.face_is_hole)
    edit = EditableMesh(mesh)
    edit.join(int(holes[0]), int(holes[2]))
    assert (edit.result().mesh.n_holes, edit.result().mesh.genus) == (1, 2)
    edit.undo()
    assert_array_equal(edit.result().mesh.connectivity.hole_darts, mesh.connectivity.hole_darts)


def test_an_edge_beside_a_hole_opens_into_it():
    mesh = MESHES["torus with holes"]
    edit = EditableMesh(mesh)
    assert edit.remove_edges([0]).done
    after = edit.result().mesh
    assert (after.n_holes, after.n_faces) == (mesh.n_holes, mesh.n_faces - 1)
    edit.undo()
    assert_array_equal(edit.result().mesh.connectivity.face_is_hole, mesh.connectivity.face_is_hole)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (lambda e: e.remove_edges([960]), r"darts\[0\] is 960, outside 0..959"),
        (lambda e: e.insert_edges([0, 1], [2]), "others must have 2 darts, as many as darts, not 1"),
        (lambda e: e.insert_edges([0], [2], 1.5), "at must be strictly between 0 and 1, not 1.5"),
        (lambda e: e.join(0, 0), "faces 0 and 0 cannot be joined: they are the same"),
        (lambda e: e.join(0, e.faces_beside(e.around(0)[0])[1]), "cannot be joined: they share an edge"),
        (lambda e: e.cut([0, 1, 2]), "contour cannot be cut: dart 0 does not lead to the vertex of the next one, 1"),
        (lambda e: e.cut([*e.around(7), *e.around(7)]), "contour must not touch itself, but visits vertex .* twice"),
        (lambda e: e.cut(outline(e, e.faces_beside(0))), "vertex .* has all three neighbors on the contour"),
        (lambda e: e.cut(e.around(7)), "contour cannot be cut: it is face 7 itself"),
        (lambda e: e.join(0, 500), "face_b must be at most 161, not 500"),
        (lambda e: e.dart("edge", (0, 200)), "edge must be two neighboring vertices; 0 and 200 are not"),
    ],
)
def test_what_cannot_be_is_refused(action, message):
    with pytest.raises(ValueError, match=message):
        action(EditableMesh(shapes.sphere(4)))


def test_nothing_asked_is_nothing_done():
    edit = EditableMesh(shapes.sphere(2))
    assert len(edit.remove_edges([]).done) == 0
    assert edit.undo() == 0
    assert check(edit.result().mesh)
