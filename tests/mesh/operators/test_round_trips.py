"""T3 and T4 are exact inverses: handles and bridges between faces or holes of any two sizes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh import shapes
from simplexmesh.mesh.operators.cut_join import cut, join, parts, together
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from tests.mesh.operators.test_editing import MESHES, complete

seeds = st.integers(0, 2**32 - 1)


def uneven(name, rng):
    """A mesh with faces of many sizes, and with data of three kinds."""
    edit = EditableMesh(MESHES[name])
    edit.remove_edges(rng.integers(0, 3 * edit.n_slots, 12))
    edit.refine_faces(np.flatnonzero(~MESHES[name].connectivity.face_is_hole)[:2])
    mesh = edit.result().mesh
    n = mesh.n_vertices
    return mesh.with_data(weight=rng.normal(size=n), pair=rng.normal(size=(n, 2)), number=np.arange(n))


def assert_same(one, other):
    assert_array_equal(one.connectivity.twin, other.connectivity.twin)
    assert_array_equal(one.connectivity.hole_darts, other.connectivity.hole_darts)
    assert_array_equal(one.vertices, other.vertices)
    assert set(one.data) == set(other.data)
    for key, values in one.data.items():
        assert_array_equal(values, other.data[key])


def unequal_pair(mesh, rng, low=0, split=None):
    """Two faces with different numbers of vertices, the second one numbered from `split`."""
    sizes = mesh.connectivity.face_sizes
    a = int(rng.integers(low, split or len(sizes)))
    others = np.flatnonzero((sizes != sizes[a]) & (np.arange(len(sizes)) >= (split or 0)))
    assume(len(others))
    return a, int(rng.choice(others))


@given(name=st.sampled_from(["sphere", "torus", "two tori", "plane", "torus with holes"]), seed=seeds)
def test_a_handle_between_faces_of_two_sizes_is_cut_again(name, seed):
    rng = np.random.default_rng(seed)
    mesh = uneven(name, rng)
    a, b = unequal_pair(mesh, rng)
    try:
        there = join(mesh, a, b)
    except TopologyError:
        assume(False)
    c, after = mesh.connectivity, there.mesh.connectivity
    assert complete(after)
    assert (there.mesh.genus, after.n_vertices, after.n_edges) == (mesh.genus + 1, c.n_vertices, c.n_edges)
    assert len(after.face_sizes) == len(c.face_sizes) - 2
    assert len(there.contour) == c.face_sizes[a] + c.face_sizes[b]
    assert not there.contour.separates
    assert there.face_map[[a, b]].tolist() == [-1, -1]
    alternate_evenly(there.contour.vertices, c.face_vertices[c.face_offsets[a] : c.face_offsets[a + 1]])
    back = cut(there.mesh, there.contour)
    assert not back.separated
    assert sorted(back.mesh.connectivity.face_sizes[list(back.faces)]) == sorted(c.face_sizes[[a, b]])
    was_hole = c.face_is_hole[[a, b]]
    if not was_hole.any():
        assert_same(back.mesh, mesh)
    elif was_hole.all():
        assert_same(cut(there.mesh, there.contour, holes=True).mesh, mesh)
    assert_array_equal(back.mesh.connectivity.twin, c.twin)


def alternate_evenly(vertices, face):
    """Whether there are never more vertices of the larger face between those of the smaller than their ratio."""
    of_face = np.isin(vertices, face)
    few = of_face if of_face.sum() <= (~of_face).sum() else ~of_face
    at = np.flatnonzero(few)
    between = np.diff(np.append(at, at[0] + len(vertices))) - 1
    ratio = (~few).sum() / few.sum()
    assert between.min() >= np.floor(ratio)
    assert between.max() <= np.ceil(ratio)


@given(names=st.tuples(*[st.sampled_from(["sphere", "cube", "torus", "plane", "cylinder"])] * 2), seed=seeds)
def test_two_meshes_joined_at_faces_of_two_sizes_come_apart_again(names, seed):
    rng = np.random.default_rng(seed)
    one, other = (uneven(name, rng) for name in names)
    other = other.moved(other.vertices + 5.0)
    a, b = unequal_pair(together(one, other), rng, split=len(one.connectivity.face_sizes))
    there = join(one, other, a, b - len(one.connectivity.face_sizes))
    assert complete(there.mesh.connectivity)
    assert (there.mesh.n_components, there.mesh.genus) == (1, one.genus + other.genus)
    assert there.contour.separates
    back = cut(there.mesh, there.contour)
    assert back.separated
    both = together(one, other)
    assert_array_equal(back.mesh.connectivity.twin, both.connectivity.twin)
    holes = both.connectivity.face_is_hole[[a, b]]
    if holes[0] == holes[1]:
        pieces = parts(cut(there.mesh, there.contour, holes=bool(holes[0])).mesh)
        assert_same(pieces[0].mesh, one)
        assert_same(pieces[1].mesh, other)


@pytest.mark.parametrize("holes", [False, True])
@pytest.mark.parametrize("name", ["sphere", "torus", "two tori"])
def test_what_is_cut_is_sewn_again_by_undoing(name, holes):
    mesh = MESHES[name]
    c = mesh.connectivity
    rng = np.random.default_rng(1)
    done = 0
    for vertex in rng.permutation(c.n_vertices)[:30].tolist():
        edit = EditableMesh(mesh)
        zone = np.isin(c.face, c.vertex_faces[vertex])
        path = [int(np.flatnonzero((zone & ~zone.reshape(-1)[c.twin]).reshape(-1))[0])]
        inside = zone.reshape(-1)
        while True:  # along the zone's border, with it on the left
            back = int(c.twin.reshape(-1)[path[-1]])
            ahead = 3 * (back // 3) + (back + 2) % 3
            ahead = ahead if not inside[c.twin.reshape(-1)[ahead]] else 3 * (back // 3) + (back + 1) % 3
            if ahead == path[0]:
                break
            path.append(ahead)
        try:
            left, right = edit.cut(path, holes=holes)
        except TopologyError:
            continue
        done += 1
        assert edit._darts.face_hole[left] == edit._darts.face_hole[right] == holes
        cut_mesh = edit.result().mesh
        assert cut_mesh.n_holes == mesh.n_holes + 2 * holes
        assert cut_mesh.genus - cut_mesh.n_components == mesh.genus - mesh.n_components - 1
        edit.undo()
        assert_same(edit.result().mesh, mesh)
    assert done


def test_a_triangle_and_a_hole_of_many_vertices():
    """p = 3 and q = 30: ten of the large face between two of the small one."""
    small, large = shapes.sphere(3, "tetrahedron"), shapes.cylinder(30, 3)
    triangle = int(np.flatnonzero(small.connectivity.face_sizes == 3)[0])
    hole = int(np.flatnonzero(large.connectivity.face_is_hole)[0])
    there = join(small, large, triangle, hole)
    q = int(large.connectivity.face_sizes[hole])
    assert len(there.contour) == 3 + q
    of_small = there.contour.vertices < small.n_vertices
    at = np.flatnonzero(of_small)
    assert (np.diff(np.append(at, at[0] + 3 + q)) - 1).tolist() == [r * q // 3 - (r - 1) * q // 3 for r in (1, 2, 3)]
    assert_array_equal(cut(there.mesh, there.contour).mesh.connectivity.twin, together(small, large).connectivity.twin)
