"""That the operators are enough: every mesh into every other one of the same genus, by sequences that are found."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from simplexmesh.mesh import shapes
from simplexmesh.mesh.editing import EditableMesh
from tests.isomorphism import invariant, mirrored, swapped, way_down, way_up
from tests.mesh_families import ALL, renumbered
from tests.test_mesh_editing import complete, with_holes

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
        (DODECAHEDRON, TETRAHEDRON, 12),
        (shapes.torus(6, 4), shapes.torus(5, 4), 12),
        (shapes.torus(7, 4), shapes.torus(5, 4), 12),
        pytest.param(shapes.torus(5, 6), shapes.torus(5, 4), 60, marks=pytest.mark.slow),
        (shapes.plane(2, 2), with_holes(TETRAHEDRON, 0), 20),
    ],
)
def test_regular_meshes_of_a_genus_turn_into_each_other(large, small, width):
    """T1 all the way down, T2 all the way up again, never through a mesh that is not complete."""
    down = way_down(large, small, width)
    assert invariant(down[-1]) == invariant(small)
    up = way_up(small, down[-2::-1])
    assert invariant(up[-1]) == invariant(large)
    assert len(down) == len(up) == 1 + (large.n_vertices - small.n_vertices) // 2
    for mesh in (*down, *up):
        assert complete(mesh.connectivity)
        assert (mesh.genus, mesh.n_holes) == (large.genus, large.n_holes)


def connected_by_swaps(start):
    """The meshes that T7 leads to, by their invariants."""
    seen, ahead = {invariant(start): start}, [start]
    while ahead:
        for _, made in swapped(ahead.pop()):
            if (name := invariant(made)) not in seen:
                seen[name] = made
                ahead.append(made)
    return seen


def test_swaps_lead_from_any_simple_polyhedron_to_any_other_of_as_many_vertices():
    """K. Wagner, 1936, of triangulations of the sphere, whose numbers are those of OEIS A000109."""
    for mesh, count in zip(way_down(DODECAHEDRON, CUBE)[:-4:-1], (2, 5, 14), strict=True):
        found = connected_by_swaps(mesh)
        assert len({min(name, invariant(mirrored(other))) for name, other in found.items()}) == count


@pytest.mark.parametrize("name", ["icosahedron-2", "torus", "plane", "cylinder"])
def test_the_invariant_does_not_see_the_numbering_and_sees_one_edit(name):
    mesh, rng = ALL[name], np.random.default_rng(5)
    assert invariant(renumbered(mesh, rng.permutation(mesh.n_vertices))) == invariant(mesh)
    edit = EditableMesh(mesh)
    while not edit.swap_edges(rng.integers(0, 3 * edit.n_slots, 1)).done.any():
        pass
    assert invariant(edit.result().mesh) != invariant(mesh)
    edit.undo()
    assert_array_equal(edit.result().mesh.connectivity.twin, mesh.connectivity.twin)
