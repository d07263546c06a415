"""The operators are complete: sequences are found from every mesh to every other one of the same genus."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from simplexmesh.mesh import shapes
from simplexmesh.mesh.contours import Contour
from simplexmesh.mesh.operators.cut_join import cut, join, parts
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from tests.mesh.families import ALL, renumbered
from tests.mesh.isomorphism import holes_merged, holes_parted, invariant, mirrored, way_down, way_up, ways_by_swaps
from tests.mesh.operators.test_editing import complete, with_holes
from tests.nightly.marks import nightly

TETRAHEDRON, CUBE, DODECAHEDRON = (shapes.sphere(1, base) for base in ("tetrahedron", "octahedron", "icosahedron"))


def test_regular_meshes_are_regular():
    """Faces all of p vertices on the sphere: p = 3, 4, 5; on the torus p = 6."""
    for mesh, p, n in ((TETRAHEDRON, 3, 4), (CUBE, 4, 8), (DODECAHEDRON, 5, 20), (shapes.torus(5, 4), 6, 40)):
        assert set(mesh.connectivity.face_sizes.tolist()) == {p}
        assert mesh.n_vertices == n


@pytest.mark.parametrize(
    ("large", "small", "width"),
    [
        (CUBE, TETRAHEDRON, 12),
        (DODECAHEDRON, CUBE, 12),
        *nightly((DODECAHEDRON, TETRAHEDRON, 12)),
        (shapes.torus(6, 4), shapes.torus(5, 4), 6),
        *nightly((shapes.torus(7, 4), shapes.torus(5, 4), 12)),
        *nightly((shapes.torus(5, 6), shapes.torus(5, 4), 60)),
        (shapes.plane(2, 2), with_holes(TETRAHEDRON, 0), 20),
    ],
)
def test_regular_meshes_of_a_genus_turn_into_each_other(large, small, width):
    """T1 to the smallest mesh and T2 up again, through complete meshes only."""
    down = way_down(large, small, width)
    assert invariant(down[-1]) == invariant(small)
    up = way_up(small, down[-2::-1])
    assert invariant(up[-1]) == invariant(large)
    assert len(down) == len(up) == 1 + (large.n_vertices - small.n_vertices) // 2
    for mesh in (*down, *up):
        assert complete(mesh.connectivity)
        assert (mesh.genus, mesh.n_holes) == (large.genus, large.n_holes)


@pytest.mark.nightly
def test_a_plane_turns_into_a_cylinder_and_back():
    """T1 down to a tetrahedron with a hole, T2 across the hole, T7 until the two holes are apart, T2 up; and back."""
    plane, cylinder, least = shapes.plane(2, 2), shapes.cylinder(3, 1), with_holes(TETRAHEDRON, 0)
    (parted,) = {invariant(mesh): mesh for mesh in holes_parted(least)}.values()
    assert (parted.n_vertices, parted.n_holes) == (6, 2)
    ways = ways_by_swaps(parted).values()
    across = min((way for way in ways if set(hole_sizes(way[-1])) == {3}), key=len)
    assert sorted(len(face) for face in across[-1].faces) == [4, 4, 4]  # a prism, open at both ends

    plane_down = way_down(plane, least, 20)
    cylinder_down = way_down(cylinder, across[-1], 20)
    way = [*plane_down, *across, *way_up(across[-1], cylinder_down[-2::-1])]
    assert invariant(way[0]) == invariant(plane)
    assert invariant(way[-1]) == invariant(cylinder)
    back_across = ways_by_swaps(cylinder_down[-1])[invariant(parted)]
    (merged,) = {invariant(mesh): mesh for mesh in holes_merged(back_across[-1])}.values()
    back = [*cylinder_down, *back_across[1:], *way_up(merged, plane_down[-2::-1])]
    assert invariant(merged) == invariant(least)
    assert invariant(back[-1]) == invariant(plane)
    for meshes, first, last in ((way, 1, 2), (back, 2, 1)):
        holes = [mesh.n_holes for mesh in meshes]
        assert holes == sorted(holes, reverse=first > last)
        assert (holes[0], holes[-1]) == (first, last)
        assert np.abs(np.diff([mesh.n_vertices for mesh in meshes])).max() == 2
        for mesh in meshes:
            assert complete(mesh.connectivity)
            assert (mesh.genus, mesh.n_components) == (0, 1)


def hole_sizes(mesh):
    return mesh.connectivity.face_sizes[mesh.connectivity.face_is_hole].tolist()


@pytest.mark.nightly
def test_a_sphere_turns_into_a_plane_and_back():
    """T3 cuts off a cap, leaving a hole, and T4 joins it again; T1 and T2 in between."""
    plane, least = shapes.plane(2, 2), with_holes(TETRAHEDRON, 0)
    c = DODECAHEDRON.connectivity
    around = c.twin.reshape(-1)[c.face_darts[: c.face_sizes[0]]]
    (rim,) = Contour.of_faces(DODECAHEDRON, [0, *c.face.reshape(-1)[around]])
    cup, cap = (part.mesh for part in parts(cut(DODECAHEDRON, rim, holes=True).mesh))
    assert (cup.genus, cup.n_holes, hole_sizes(cup)) == (0, 1, [5])
    assert invariant(cup) == invariant(cap)

    cup_down, plane_down = way_down(cup, least, 20), way_down(plane, least, 20)
    assert invariant(way_up(cup_down[-1], plane_down[-2::-1])[-1]) == invariant(plane)
    again = way_up(plane_down[-1], cup_down[-2::-1])[-1]
    assert invariant(again) == invariant(cup)
    hole, other = (int(np.flatnonzero(mesh.connectivity.face_is_hole)[0]) for mesh in (again, cap))
    closed = join(again, cap, hole, other).mesh
    assert (closed.n_holes, closed.n_components) == (0, 1)
    assert invariant(closed) == invariant(DODECAHEDRON)


def test_swaps_lead_from_any_simple_polyhedron_to_any_other_of_as_many_vertices():
    """K. Wagner, 1936, of triangulations of the sphere, whose numbers are those of OEIS A000109."""
    for mesh, count in zip(way_down(DODECAHEDRON, CUBE)[:-4:-1], (2, 5, 14), strict=True):
        found = ways_by_swaps(mesh)
        assert len({min(name, invariant(mirrored(way[-1]))) for name, way in found.items()}) == count


@pytest.mark.parametrize("name", ["icosahedron-2", "torus", "plane", "cylinder"])
def test_the_invariant_depends_on_one_edit_and_not_on_the_numbering(name):
    mesh, rng = ALL[name], np.random.default_rng(5)
    assert invariant(renumbered(mesh, rng.permutation(mesh.n_vertices))) == invariant(mesh)
    edit = EditableMesh(mesh)
    while not edit.swap_edges(rng.integers(0, 3 * edit.n_slots, 1)).done.any():
        pass
    assert invariant(edit.result().mesh) != invariant(mesh)
    edit.undo()
    assert_array_equal(edit.result().mesh.connectivity.twin, mesh.connectivity.twin)
