"""T1 to T7 as functions: what they change, what undoes them, what they refuse and why."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh import shapes
from simplexmesh.mesh.contours import Contour
from simplexmesh.mesh.operators.cut_join import cut, join, parts, together
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.single_edits import insert_edge, refine_face, remove_edge, remove_face, swap_edge
from tests.mesh.families import ALL
from tests.mesh.isomorphism import invariant, mirrored
from tests.mesh.operators.reference import Loops
from tests.mesh.operators.test_editing import anywhere, complete, heawood, k33_on_the_torus

BALL = shapes.sphere(4)
meshes = st.sampled_from(["icosahedron-2", "icosahedron-5", "torus", "ellipsoid", "cylinder", "plane"]).map(ALL.get)
seeds = st.integers(0, 2**32 - 1)


def counts(mesh):
    c = mesh.connectivity
    return np.array([c.n_vertices, c.n_edges, len(c.face_sizes)])


class TestCounts:
    @given(mesh=meshes, seed=seeds)
    def test_change_as_documented(self, mesh, seed):
        rng = np.random.default_rng(seed)
        c = mesh.connectivity
        dart = int(rng.integers(c.twin.size))
        f = int(rng.choice(np.flatnonzero(~c.face_is_hole)))
        m = int(c.face_sizes[f])
        around = c.face_vertices[c.face_offsets[f] : c.face_offsets[f + 1]].tolist()
        edge, other = (around[0], around[1]), (around[2], around[3])
        for make, change in (
            (lambda: remove_edge(mesh, dart), (-2, -3, -1)),
            (lambda: insert_edge(mesh, edge, other), (2, 3, 1)),
            (lambda: swap_edge(mesh, dart), (0, 0, 0)),
            (lambda: refine_face(mesh, f), (2 * m, 3 * m, m)),
            (lambda: remove_face(mesh, f), (-2 * m, -3 * m, -m)),
        ):
            try:
                out = make()
            except TopologyError:
                continue
            assert_array_equal(counts(out.mesh) - counts(mesh), change)
            assert complete(out.mesh.connectivity)
            assert out.mesh.genus == mesh.genus
            assert out.mesh.n_holes == mesh.n_holes
            assert (out.vertex_map < 0).sum() == max(0, -change[0])
            kept = out.vertex_map >= 0
            if change[0]:
                assert_array_equal(out.mesh.vertices[out.vertex_map[kept]], mesh.vertices[kept])
            assert (
                np.delete(out.face_map, np.flatnonzero(out.face_map < 0)) < len(out.mesh.connectivity.face_sizes)
            ).all()
            assert (out.face_map < 0).sum() == max(0, -change[2])

    def test_swap_moves_one_vertex_from_each_side_to_each_end(self):
        mesh = ALL["torus"]
        c = mesh.connectivity
        left, right = c.face.reshape(-1)[[7, c.twin.reshape(-1)[7]]]
        ends = {int(f) for v in (7 // 3, c.twin.reshape(-1)[7] // 3) for f in c.vertex_faces[v]} - {left, right}
        out = swap_edge(mesh, 7)
        sizes = out.mesh.connectivity.face_sizes[out.face_map]
        assert sizes[[left, right]].tolist() == [5, 5]
        assert sizes[list(ends)].tolist() == [7, 7]

    def test_maps_follow_the_faces(self):
        out = remove_edge(BALL, 100)
        before, after = Loops(BALL.connectivity), Loops(out.mesh.connectivity)
        for f, g in enumerate(out.face_map.tolist()):
            kept = [int(out.vertex_map[v]) for v in before.faces[f] if out.vertex_map[v] >= 0]
            if g >= 0:
                assert set(kept) <= set(after.faces[g])


class TestInverses:
    @given(mesh=meshes, seed=seeds)
    def test_removing_an_inserted_edge(self, mesh, seed):
        rng = np.random.default_rng(seed)
        c = mesh.connectivity
        f = int(rng.integers(len(c.face_sizes)))
        around = c.face_darts[c.face_offsets[f] : c.face_offsets[f + 1]]
        one, other = rng.choice(around, 2, replace=False).tolist()
        there = insert_edge(mesh, one, other).mesh
        back = remove_edge(there, (there.n_vertices - 2, there.n_vertices - 1)).mesh
        assert_array_equal(back.connectivity.twin, c.twin)
        assert_array_equal(back.connectivity.hole_darts, c.hole_darts)
        assert_array_equal(back.vertices, mesh.vertices)

    def test_inserting_a_removed_edge(self):
        mesh = shapes.sphere(2)
        out = remove_edge(mesh, 0)
        a, b = 0, int(mesh.connectivity.twin[0, 0]) // 3
        ends = [[int(out.vertex_map[v]) for v in mesh.neighbors[x].tolist() if v != y] for x, y in ((a, b), (b, a))]
        back = insert_edge(out.mesh, *ends).mesh
        assert invariant(back) == invariant(mesh)

    def test_two_quarter_turns_of_an_edge(self):
        mesh = shapes.torus(14, 6)
        ends = (0, int(mesh.neighbors[0, 0]))
        there = swap_edge(mesh, ends).mesh
        assert invariant(there) != invariant(mesh)
        assert invariant(swap_edge(there, ends).mesh) == invariant(mesh)

    @pytest.mark.parametrize(
        ("name", "size"),
        [
            ("icosahedron-2", 5),
            ("icosahedron-2", 6),
            ("torus", 6),
            ("plane", 6),
            ("tetrahedron-2", 3),
            ("tetrahedron-2", 6),
        ],
    )
    def test_removing_a_refined_face(self, name, size):
        mesh = ALL[name]
        c = mesh.connectivity
        found = np.flatnonzero((c.face_sizes == size) & ~c.face_is_hole)
        beside_hole = {int(f) for pair in c.edge_faces if c.face_is_hole[pair].any() for f in pair}
        f = next(f for f in found.tolist() if f not in beside_hole)
        out = refine_face(mesh, f)
        sizes = np.bincount(out.mesh.connectivity.face_sizes, minlength=12) - np.bincount(c.face_sizes, minlength=12)
        assert sizes.sum() == size
        inner = set(range(mesh.n_vertices, mesh.n_vertices + 2 * size))
        middle = [g for g, loop in Loops(out.mesh.connectivity).faces.items() if set(loop) <= inner]
        assert len(middle) == 1
        assert len(Loops(out.mesh.connectivity).faces[middle[0]]) == size
        back = remove_face(out.mesh, middle[0]).mesh
        assert_array_equal(back.connectivity.twin, c.twin)
        assert_array_equal(back.vertices, mesh.vertices)

    @pytest.mark.parametrize("name", ["tetrahedron-1", "icosahedron-2", "torus", "plane"])
    def test_a_refined_face_stays_in_the_middle(self, name):
        mesh = ALL[name]
        for f in np.flatnonzero(~mesh.connectivity.face_is_hole)[:8].tolist():
            out = refine_face(mesh, f)
            c, middle = out.mesh.connectivity, out.face_map[f]
            loop = c.face_vertices[c.face_offsets[middle] : c.face_offsets[middle + 1]]
            assert len(loop) == mesh.connectivity.face_sizes[f]
            assert (loop >= mesh.n_vertices).all()

    def test_refined_vertices_are_middles_and_halfway_to_the_centroid(self):
        mesh = shapes.torus(14, 6)
        loop = mesh.vertices[mesh.faces[0]]
        new = refine_face(mesh, int(mesh.connectivity.face[mesh.faces[0][0]].min())).mesh.vertices[mesh.n_vertices :]
        middles = (loop + np.roll(loop, -1, axis=0)) / 2
        wanted = np.concatenate([middles, (middles + loop.mean(axis=0)) / 2])
        np.testing.assert_allclose(np.sort(new, axis=0), np.sort(wanted, axis=0), atol=1e-12)

    @pytest.mark.parametrize("sizes", [(5, 6), (6, 5), (6, 6), (5, 5)])
    def test_cutting_a_joined_seam(self, sizes):
        mesh = shapes.sphere(5)
        found = [int(np.flatnonzero(mesh.connectivity.face_sizes == n)[i]) for n, i in zip(sizes, (0, -1), strict=True)]
        there = join(mesh, *found)
        assert (there.mesh.genus, len(there.mesh.connectivity.face_sizes)) == (1, 250)
        assert len(there.contour) == sum(sizes)
        assert not there.contour.separates
        back = cut(there.mesh, there.contour)
        assert not back.separated
        assert sorted(back.mesh.connectivity.face_sizes[list(back.faces)]) == sorted(sizes)
        assert_array_equal(back.mesh.connectivity.twin, mesh.connectivity.twin)

    def test_joining_two_meshes_and_parting_them(self):
        tri, torus = shapes.sphere(3, "tetrahedron"), shapes.torus(14, 6)
        small = int(np.flatnonzero(tri.connectivity.face_sizes == 3)[0])
        there = join(tri, torus.moved(torus.vertices + 9), small, 5)
        assert (there.mesh.n_components, there.mesh.genus, there.mesh.n_vertices) == (1, 1, 36 + 168)
        assert there.contour.separates
        back = cut(there.mesh, there.contour)
        assert back.separated
        assert_array_equal(back.mesh.connectivity.twin, together(tri, torus).connectivity.twin)
        back = cut(there.mesh, there.contour.reversed().vertices, holes=True)
        assert (back.mesh.n_holes, back.mesh.n_components) == (2, 2)


@pytest.mark.parametrize(("p", "q"), [(3, 3), (3, 5), (3, 7), (4, 6), (5, 6), (3, 20)])
def test_two_faces_alternate_as_evenly_as_can_be(p, q):
    from simplexmesh.mesh.operators.seams import between

    a, b = 3 * np.arange(p), 3 * (100 + np.arange(q))
    for seam, first in ((between(a, b, 1, 2), 1), (between(b, a, 2, 1), 102))[: 1 + (p < q)]:
        vertices = seam.onward // 3
        from_small = vertices < 100
        at = np.flatnonzero(from_small)
        gaps = np.diff(np.append(at, at[0] + p + q)) - 1
        assert gaps.tolist() == [r * q // p - (r - 1) * q // p for r in range(1, p + 1)]
        assert vertices[0] == 1  # the smaller face's of the closest pair, then the larger one's
        assert vertices[1] == 102
        forward = vertices[from_small] if first == 1 else vertices[~from_small]
        assert (np.diff(forward) % (p if first == 1 else q) == 1).all()


class TestRefusals:
    @pytest.mark.parametrize(
        ("action", "message"),
        [
            (
                lambda: remove_edge(ALL["tetrahedron-1"], 0),
                "edge 0-. cannot be removed: face ., opposite to it, is a triangle",
            ),
            (lambda: remove_edge(anywhere(heawood()), 0), "face . is adjacent to both its sides, faces . and ."),
            (lambda: remove_edge(anywhere(k33_on_the_torus()), 0), "mesh is not complete"),
            (
                lambda: swap_edge(ALL["tetrahedron-1"], 0),
                "edge 0-. cannot be swapped: face ., on one side of it, is a triangle",
            ),
            (
                lambda: swap_edge(anywhere(heawood()), 0),
                "the faces opposite to it, one of them face ., already share an edge",
            ),
            (lambda: remove_edge(BALL, (0, 300)), "edge must be two neighboring vertices; 0 and 300 are not"),
            (lambda: remove_edge(BALL, (0, 320)), r"edge\[1\] is 320, outside 0..319"),
            (lambda: remove_edge(BALL, 960), "edge must be at most 959, not 960"),
            (lambda: insert_edge(BALL, 0, 0), "edges 0-64 and 0-64 are the same; an edge is inserted between two"),
            (lambda: insert_edge(BALL, 0, 600), "edges 0-.* and 200-.* have no face in common"),
            (lambda: insert_edge(BALL, 0, 1, at=(0.5, 2)), "at must be strictly between 0 and 1, not 2"),
            (lambda: remove_face(ALL["cylinder"], 0), "face 0 cannot be removed: .* is a hole"),
            (
                lambda: remove_face(ALL["tetrahedron-1"], 0),
                "face 0 cannot be removed: face ., at the end of an edge to be removed, is a triangle",
            ),
            (lambda: remove_face(BALL, 162), "face must be at most 161, not 162"),
            (
                lambda: refine_face(ALL["cylinder"], int(ALL["cylinder"].connectivity.face_is_hole.argmax())),
                "cannot be refined: it is a hole",
            ),
            (lambda: join(BALL, 3, 3), "faces 3 and 3 cannot be joined: they are the same"),
            (lambda: join(BALL, *BALL.connectivity.edge_faces[0].tolist()), "cannot be joined: they share an edge"),
            (lambda: join(BALL, 1), "join takes"),
            (lambda: join(BALL, BALL, 0, 162), "face_b must be at most 161, not 162"),
            (lambda: cut(BALL, BALL.faces[7]), "contour cannot be cut: it is face . itself"),
            (lambda: cut(BALL, [0, 1, 2]), "contour must run along edges; vertices . and . are not neighbors"),
        ],
    )
    def test_name_the_condition(self, action, message):
        with pytest.raises((TopologyError, ValueError, TypeError), match=message):
            action()

    def test_a_face_between_two_forbids_joining_them(self):
        c = BALL.connectivity
        across = {f: {int(g) for pair in c.edge_faces if f in pair for g in pair} - {f} for f in range(162)}
        a = 0
        b = next(b for b in range(162) if b not in across[a] | {a} and across[a] & across[b])
        with pytest.raises(TopologyError, match=f"face {min(across[a] & across[b])}|shares an edge with both"):
            join(BALL, a, b)

    def test_a_contour_of_another_mesh_is_read_on_this_one(self):
        there = join(BALL, 0, 100)
        same = there.mesh.moved(2 * there.mesh.vertices)
        assert cut(same, there.contour).mesh.genus == 0

    def test_nothing_refused_is_half_done(self):
        edit_twin = ALL["tetrahedron-2"].connectivity.twin.copy()
        with pytest.raises(TopologyError):
            remove_face(ALL["tetrahedron-1"], 0)
        assert_array_equal(ALL["tetrahedron-2"].connectivity.twin, edit_twin)


def test_a_contour_that_meets_a_face_twice_is_refused():
    c = BALL.connectivity
    across = {f: {int(g) for pair in c.edge_faces if f in pair for g in pair} - {f} for f in range(162)}
    hub = int(np.flatnonzero(c.face_sizes == 6)[30])
    first = min(across[hub])
    opposite = next(f for f in across[hub] if f != first and not across[f] & across[first] - {hub})
    (contour,) = Contour.of_faces(BALL, [hub, *(across[hub] - {first, opposite})])
    with pytest.raises(TopologyError, match=f"face {hub} lies along its left in two places"):
        cut(BALL, contour)
    with pytest.raises(TopologyError, match=f"face {hub} lies along its right in two places"):
        cut(BALL, contour.reversed())


class TestWhatCanBeReached:
    def test_from_the_tetrahedron_are_all_simple_polyhedra(self):
        """Their numbers by vertices are those of the triangulations of the sphere (OEIS A000109)."""
        level = [ALL["tetrahedron-1"]]
        counted = [1]
        for _ in range(5):
            found = {}
            for mesh in level:
                c = mesh.connectivity
                for begin, end in zip(c.face_offsets[:-1], c.face_offsets[1:], strict=True):
                    darts = c.face_darts[begin:end].tolist()
                    for i, one in enumerate(darts):
                        for other in darts[:i]:
                            out = insert_edge(mesh, one, other).mesh
                            assert complete(out.connectivity)
                            found.setdefault(min(map(str, (invariant(out), invariant(mirrored(out))))), out)
            level = list(found.values())
            counted.append(len(level))
        assert counted == [1, 1, 2, 5, 14, 50]

    @pytest.mark.parametrize("name", ["octahedron-1", "icosahedron-1", "tetrahedron-2", "icosahedron-2"])
    def test_any_sphere_comes_down_to_the_tetrahedron_and_back(self, name):
        edit = EditableMesh(ALL[name])
        while edit.n_edits < ALL[name].n_vertices // 2 - 2:
            assert edit.remove_edges(
                np.arange(3 * edit.n_slots)[np.repeat(edit._darts.alive[: edit.n_slots], 3)]
            ).done.any()
        assert invariant(edit.result().mesh) == invariant(ALL["tetrahedron-1"])
        edit.undo()
        assert_array_equal(edit.result().mesh.connectivity.twin, ALL[name].connectivity.twin)


class TestParts:
    def test_together_are_the_whole(self):
        mesh = together(ALL["torus"], ALL["plane"], ALL["icosahedron-1"])
        mesh = mesh.with_data(number=np.arange(mesh.n_vertices))
        pieces = parts(mesh)
        assert [piece.mesh.genus for piece in pieces] == [1, 0, 0]
        again = together(*(piece.mesh for piece in pieces))
        assert_array_equal(again.connectivity.twin, mesh.connectivity.twin)
        assert_array_equal(again.connectivity.hole_darts, mesh.connectivity.hole_darts)
        assert_array_equal(again.data["number"], mesh.data["number"])
        for piece in pieces:
            kept = piece.vertex_map >= 0
            assert_array_equal(piece.mesh.vertices[piece.vertex_map[kept]], mesh.vertices[kept])
            sizes, faces = mesh.connectivity.face_sizes, piece.face_map
            assert_array_equal(piece.mesh.connectivity.face_sizes[faces[faces >= 0]], sizes[faces >= 0])
        assert sum((piece.face_map >= 0).astype(int) for piece in pieces).tolist() == [1] * len(sizes)

    def test_of_what_a_cut_separated(self):
        pairs = BALL.connectivity.edge_faces
        (rim,) = Contour.of_faces(BALL, np.unique(pairs[(pairs == 5).any(axis=1)]))
        pieces = parts(cut(BALL, rim).mesh)
        assert len(pieces) == 2
        assert all((piece.mesh.genus, piece.mesh.n_holes) == (0, 0) for piece in pieces)
        assert sum(piece.mesh.n_vertices for piece in pieces) == BALL.n_vertices
