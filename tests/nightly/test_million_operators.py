"""A million random operators on five meshes: checked along the way, and undone to the same mesh.

Run with `make nightly`, or `python -m pytest -m nightly`; two minutes.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from simplexmesh.mesh.check import check
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from tests.mesh.operators.test_editing import MESHES, any_edit, labels_hold

MILLION = 1_000_000
CHANGE = {1: -2, 2: 2, 5: -12, 6: 12, 7: 0}  # of the number of vertices, about


def random_batch(edit, rng, wanted):
    """Apply some hundred operators of a kind that keeps the number of vertices near `wanted`; return both."""
    n, f, _ = edit._used
    alive = np.flatnonzero(edit._darts.alive[:n])
    kinds = [kind for kind, change in CHANGE.items() if change * (len(alive) - wanted) <= 0 or rng.random() < 0.3]
    kind = int(rng.choice(kinds))
    darts = 3 * rng.choice(alive, 400) + rng.integers(0, 3, 400)
    faces = rng.choice(np.flatnonzero(edit._darts.face_dart[:f] >= 0), 60)
    in_order = bool(rng.integers(2))
    if kind == 2:
        ahead = edit._darts.twin[darts]
        for _ in range(int(rng.integers(1, 5))):  # along the face on the left of each
            other = 3 * (ahead // 3) + (ahead + 2) % 3
            ahead = edit._darts.twin[other]
        return kind, edit.insert_edges(darts, other, rng.uniform(0.1, 0.9, (400, 2)), in_order=in_order)
    if kind in (5, 6):
        return kind, (edit.remove_faces if kind == 5 else edit.refine_faces)(faces, in_order=in_order)
    return kind, (edit.remove_edges if kind == 1 else edit.swap_edges)(darts, in_order=in_order)


def checked(edit, euler):
    """Check that the connectivity of `result` is complete and satisfies Euler's relation."""
    labels_hold(edit)
    mesh = edit.result().mesh
    c = mesh.connectivity
    assert not check(mesh).where.keys() & {"one_sided_edges", "shared_edges"}
    assert 2 * c.n_edges == 3 * c.n_vertices
    assert c.n_vertices - c.n_edges + len(c.face_sizes) == euler == 2 * (c.n_components - c.genus)


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["sphere", "torus", "two tori", "plane", "two tori with holes"])
def test_a_million_operators_keep_the_mesh_complete_and_are_undone(name):
    mesh, rng = MESHES[name], np.random.default_rng(len(name))
    edit = EditableMesh(mesh)
    edit.refine_faces(np.arange(mesh.n_faces))
    start, euler, applied = 4 * mesh.n_vertices, mesh.connectivity.euler, Counter()
    sample = MILLION // 50
    while edit.n_edits < MILLION:
        before = edit.n_edits
        kind, batch = random_batch(edit, rng, start)
        applied[kind] += int(batch.done.sum())
        for _ in range(2):
            euler += any_edit(edit, rng) or 0
        if edit.n_edits // sample > before // sample:
            checked(edit, euler)
    logged = np.bincount(edit._darts.log[: edit.n_edits, 0], minlength=8)
    assert min(applied[5], applied[6], *logged[[1, 2, 3, 4, 7]]) > 50, (applied, logged)
    edit.undo(MILLION // 2)
    labels_hold(edit)
    edit.undo()
    back = edit.result()
    assert_array_equal(back.mesh.connectivity.twin, mesh.connectivity.twin)
    assert_array_equal(back.mesh.connectivity.hole_darts, mesh.connectivity.hole_darts)
    assert_array_equal(back.mesh.vertices, mesh.vertices)
    assert_array_equal(back.face_map, np.arange(len(mesh.connectivity.face_sizes)))
