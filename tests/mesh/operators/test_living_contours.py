"""Contours of a mesh live on: they keep their sides and their course through edits, batches, undo, files and copies."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh import Contour, EditableMesh, SimplexMeshWarning, TopologyError
from simplexmesh.mesh.operators.cut_join import together
from simplexmesh.mesh.shapes import sphere, torus
from simplexmesh.motion.model.state import mean_edge

BALL, RING = sphere(8), torus(24, 12)
seeds = st.integers(0, 2**32 - 1)


def equator(mesh):
    x, y, _ = mesh.vertices.T
    return Contour.through(mesh, [x.argmax(), y.argmax(), x.argmin(), y.argmin()])


def meridian(mesh):
    x, _, z = mesh.vertices.T
    return Contour.through(mesh, [(z + 0.3 * x).argmax(), (z + x).argmax()], closed=False)


NAMED = BALL.with_contours(equator=equator(BALL), meridian=meridian(BALL))


def edited(mesh, seed):
    """Return a batch of random edits, some of them undone."""
    rng = np.random.default_rng(seed)
    edit, counts = EditableMesh(mesh), [0, 0]
    for kind in rng.permutation(["remove", "refine", "swap", "insert", "collapse", "undo"]):
        if kind == "remove":
            edit.remove_edges(rng.integers(0, mesh.n_vertices * 3, 60))
        elif kind == "swap":
            edit.swap_edges(rng.integers(0, mesh.n_vertices * 3, 60))
        elif kind == "undo":
            edit.undo(edit.n_edits - counts[-2])  # the last batch; a part of T6 alone may make chords
        elif kind == "insert":
            darts = mesh.connectivity.face_darts[rng.integers(0, mesh.n_vertices * 3, 60)]
            back = mesh.connectivity.twin.reshape(-1)[darts]
            edit.insert_edges(darts, 3 * (back // 3) + (back + 2) % 3)
        else:
            faces = rng.integers(0, mesh.n_faces, 20)
            faces = faces[edit._darts.face_dart[faces] >= 0]
            edit.refine_faces(faces) if kind == "refine" else edit.remove_faces(faces)
        counts.append(edit.n_edits)
    return edit


def off(points, places, *, closed):
    """Return the distances of points from a polyline."""
    ends = np.roll(places, -1, axis=0)[: None if closed else -1]
    starts = places[: len(ends)]
    along = ends - starts
    t = np.clip(((points[:, None] - starts) * along).sum(-1) / (along**2).sum(-1), 0, 1)
    return np.linalg.norm(starts + t[..., None] * along - points[:, None], axis=-1).min(axis=1)


@given(seed=seeds)
def test_edits_keep_the_course_and_the_sides(seed):
    edit = edited(NAMED, seed)
    out = edit.result()
    assert out.mesh.contours.keys() == NAMED.contours.keys()
    for name, before in NAMED.contours.items():
        after = out.mesh.contours[name]
        assert after.closed == before.closed
        number = out.vertex_map[before.vertices]
        kept = number[number >= 0]
        assert_array_equal(
            after.vertices[np.isin(after.vertices, kept)], kept
        )  # in the same order, from the same start
    left = NAMED.contours["equator"].left_faces
    now = out.mesh.contours["equator"].left_faces
    for side in (True, False):
        faces = out.face_map[left == side]
        assert (now[faces[faces >= 0]] == side).all()
    edit.undo()
    for name, darts in NAMED.connectivity.contour_darts.items():
        assert_array_equal(edit.result().mesh.connectivity.contour_darts[name], darts)


@given(seed=seeds)
def test_new_vertices_are_on_the_polyline(seed):
    rng = np.random.default_rng(seed)
    edit = EditableMesh(NAMED)
    edit.refine_faces(rng.permutation(NAMED.n_faces)[:100])
    mesh = edit.result().mesh
    for name, before in NAMED.contours.items():
        after = mesh.contours[name]
        assert len(after) >= len(before)
        assert off(mesh.vertices[after.vertices], BALL.vertices[before.vertices], closed=before.closed).max() < 1e-12
        assert_allclose(after.length, before.length)


@pytest.mark.parametrize("name", ["equator", "meridian"])
def test_what_would_break_one_is_refused(name):
    contour, c = NAMED.contours[name], NAMED.connectivity
    dart = int(contour.darts[3])
    with pytest.raises(TopologyError, match=r"edge \d+-\d+ cannot be removed: it would break a contour"):
        sm.remove_edge(NAMED, dart)
    third = next(
        d for d in range(3 * (dart // 3), 3 * (dart // 3) + 3) if c.twin.reshape(-1)[d] // 3 not in contour.vertices
    )
    for edge in (dart, third):
        with pytest.raises(TopologyError, match=r"edge \d+-\d+ cannot be swapped: it would break a contour"):
            sm.swap_edge(NAMED, edge)
    shorter = sm.remove_edge(NAMED, third).mesh.contours[name]
    assert len(shorter) == len(contour) - 1
    with pytest.raises(TopologyError, match=r"face \d+ cannot be removed: it would break a contour"):
        sm.remove_face(NAMED, int(c.face.reshape(-1)[dart]))
    pairs = [d for d in contour.darts if (c.face.reshape(-1)[contour.darts] == c.face.reshape(-1)[d]).sum() > 1]
    if pairs:
        one, other = contour.darts[c.face.reshape(-1)[contour.darts] == c.face.reshape(-1)[pairs[0]]][:2].tolist()
        with pytest.raises(
            TopologyError, match="are on one contour, which an edge between them would make touch itself"
        ):
            sm.insert_edge(NAMED, one, other)


def test_the_ends_of_an_open_one_stay():
    end = int(NAMED.contours["meridian"].vertices[0])
    for dart in range(3 * end, 3 * end + 3):
        with pytest.raises(TopologyError, match="it would break a contour"):
            sm.remove_edge(NAMED, dart)


def test_a_removal_does_not_make_a_chord():
    loop = BALL.faces[100]
    named = BALL.with_contours(bay=Contour(BALL, [*loop[2:], loop[0]], closed=False))  # all of a face but one vertex
    outer = next(v for v in BALL.neighbors[loop[1]] if v not in loop)
    with pytest.raises(TopologyError, match="it would break a contour"):
        sm.remove_edge(named, (int(loop[1]), int(outer)))


def test_a_cut_drops_what_loses_edges_and_keeps_the_rest():
    around = equator(RING)
    named = RING.with_contours(around=around)
    with pytest.warns(SimplexMeshWarning, match="contour 'around' was dropped: it lost edges to a cut or join"):
        assert sm.cut(named, around).mesh.contours == {}
    far = [f for f in range(RING.n_faces) if not np.isin(RING.faces[f], around.vertices).any()]
    kept = RING.with_contours(face=Contour.of_face(RING, far[0]))
    assert_array_equal(sm.cut(kept, around).mesh.contours["face"].vertices, kept.contours["face"].vertices)
    edit = EditableMesh(named)
    edit.cut(around.darts)
    edit.undo()
    assert_array_equal(edit.result().mesh.contours["around"].vertices, around.vertices)


def test_a_join_takes_those_of_both_meshes():
    other = BALL.moved(BALL.vertices + 3).with_contours(other=equator(BALL))
    pole = int(BALL.connectivity.vertex_faces[BALL.vertices[:, 2].argmin(), 0])
    out = sm.join(NAMED, other, pole, pole)
    assert set(out.mesh.contours) == {"equator", "meridian", "other"}
    assert_array_equal(out.mesh.contours["other"].vertices, equator(BALL).vertices + BALL.n_vertices)
    with pytest.raises(
        ValueError, match="meshes must have contours of different names, but two have one named 'equator'"
    ):
        together(NAMED, NAMED)
    halves = sm.parts(together(NAMED, other))
    assert [set(half.mesh.contours) for half in halves] == [{"equator", "meridian"}, {"other"}]
    assert_array_equal(halves[1].mesh.contours["other"].vertices, equator(BALL).vertices)


def test_decimated_they_keep_vertices_of_their_own():
    for out in (sm.decimate(NAMED, vertices=400), sm.decimate(NAMED, tolerance=0.05)):
        for name, before in NAMED.contours.items():
            after = out.mesh.contours[name]
            assert len(after) < len(before)
            kept = out.vertex_map[before.vertices]
            assert_array_equal(after.vertices, kept[kept >= 0])
            assert_array_equal(out.mesh.vertices[kept[kept >= 0]], BALL.vertices[before.vertices[kept >= 0]])
    marks = np.isin(np.arange(BALL.n_vertices), NAMED.contours["equator"].vertices)
    out = sm.decimate(NAMED.with_data(crease=marks.astype(np.uint8)), vertices=400)
    stays = [
        (out.mesh.vertices[c.vertices, None] == BALL.vertices).all(axis=2).any(axis=1)
        for c in out.mesh.contours.values()
    ]
    assert not stays[0][1:-1].all()
    assert stays[1][1:-1].all()


def test_regularized_they_stay_where_they_are():
    uneven = sm.refine_face(NAMED, int(NAMED.connectivity.vertex_faces[NAMED.contours["equator"].vertices[0], 0])).mesh
    out = sm.regularize(uneven).mesh
    for name, contour in uneven.contours.items():
        assert_array_equal(out.contours[name].vertices, contour.vertices)
        assert_array_equal(out.vertices[contour.vertices], uneven.vertices[contour.vertices])


def test_refined_and_redistributed_they_move_with_the_mesh():
    egg = sm.ellipsoid((1.0, 1.0, 1.3), 16).triangulated()
    for out in (
        sm.refine(NAMED, egg, vertices=1800, iterations=5),
        sm.redistribute(NAMED, egg, vertices=900, iterations=5, rounds=1),
    ):
        assert set(out.mesh.contours) == {"equator", "meridian"}
        places = BALL.vertices[NAMED.contours["equator"].vertices] * [1.0, 1.0, 1.3]
        edge = mean_edge(out.mesh)
        assert off(out.mesh.vertices[out.mesh.contours["equator"].vertices], places, closed=True).max() < 1.5 * edge
        assert out.mesh.contours["equator"].separates


def test_copies_and_files_keep_them(tmp_path):
    NAMED.save(tmp_path / "named.vtp")
    found = [sm.read(tmp_path / "named.vtp"), pickle.loads(pickle.dumps(NAMED)), copy.deepcopy(NAMED)]
    for mesh in [*found, NAMED.moved(2 * NAMED.vertices), NAMED.with_data(a=np.zeros(NAMED.n_vertices))]:
        for name, contour in NAMED.contours.items():
            assert_array_equal(mesh.contours[name].vertices, contour.vertices)
            assert mesh.contours[name].closed == contour.closed
    assert "equator, meridian" in NAMED._repr_html_()


def test_names_are_replaced_and_removed():
    assert set(NAMED.with_contours(equator=None).contours) == {"meridian"}
    other = NAMED.with_contours(equator=equator(BALL).reversed())
    assert_array_equal(other.contours["equator"].vertices, equator(BALL).vertices[::-1])
    assert set(NAMED.with_contours(rim=equator(BALL).reversed()).contours) == {"meridian", "rim"}


def test_what_is_not_on_the_mesh_is_refused():
    with pytest.raises(TopologyError, match="contour 'twice' must share no edge with another contour"):
        NAMED.with_contours(twice=sm.Contour(BALL, equator(BALL).vertices[:5], closed=False))
    with pytest.raises(TypeError, match="contour 'x' must be a Contour"):
        BALL.with_contours(x=[1, 2, 3])
    with pytest.raises(TopologyError, match="contour 'x' is on another mesh"):
        BALL.with_contours(x=equator(RING))
    with pytest.raises(ValueError, match=r"contours to remove must be of \[\], not 'x'"):
        BALL.with_contours(x=None)
    c = BALL.connectivity
    for darts, message in (([], "'x' must have at least one edge"), ([0, 0], "dart 0 does not lead to the next one")):
        with pytest.raises(TopologyError, match=message):
            sm.Connectivity(c.twin, contour_darts={"x": darts})
