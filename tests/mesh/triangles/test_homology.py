"""Homology bases of closed surfaces, and linking numbers."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh.triangles.homology import cut_open, linking_number


def block(holes, size):
    """Return the triangulated surface of a plate of cubes, with a tunnel for each one left out."""
    full = np.zeros((size[0] + 2, size[1] + 2, 3), bool)
    full[1:-1, 1:-1, 1] = True
    for x, y in holes:
        full[x, y, 1] = False
    corners, faces = {}, []
    for cell in np.argwhere(full):
        for axis in range(3):
            for side in (0, 1):
                beside = cell.copy()
                beside[axis] += 2 * side - 1
                if full[tuple(beside)]:
                    continue
                square = []
                for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    place = cell.copy()
                    place[axis] += side
                    place[(axis + 1) % 3] += p
                    place[(axis + 2) % 3] += q
                    square.append(corners.setdefault(tuple(place.tolist()), len(corners)))
                square = square if side else square[::-1]
                faces += [[square[0], square[1], square[2]], [square[0], square[2], square[3]]]
    return np.array(list(corners), float), np.array(faces)


def test_the_basis_has_two_loops_a_handle_and_borders_are_refused():
    ball = sm.sphere(5).triangulated()
    assert len(cut_open(ball.vertices, ball.faces).generators) == 0
    assert len(cut_open(*block([(2, 2), (4, 2)], (5, 3))).generators) == 4
    with pytest.raises(TopologyError, match="closed"):
        cut_open(ball.vertices, ball.faces[1:])


def test_forms_count_the_loops_of_the_basis():
    cut = cut_open(*block([(2, 2), (4, 2)], (5, 3)))
    form = {}
    for (a, b), values in zip(cut.edges.tolist(), cut.forms, strict=True):
        form[a, b], form[b, a] = values, -values

    def turns(loop):
        return np.sum([form[step] for step in zip(loop, np.roll(loop, -1), strict=True)], axis=0)

    loops = [turns(cut.loop(edge, cut.parent)) for edge in cut.generators.tolist()]
    assert np.array_equal(np.abs(loops), np.eye(4))
    assert not np.any([turns(face) for face in cut.faces])


def test_a_loop_links_the_dual_cycle_outside_only_where_it_runs_around_the_tunnel():
    cut = cut_open(*block([(2, 2)], (3, 3)))
    inside = cut.linking - np.eye(2, dtype=int)
    assert np.linalg.matrix_rank(cut.linking) == np.linalg.matrix_rank(inside) == 1


def test_linking_against_the_integral_of_gauss():
    turn = 2 * np.pi * np.arange(400) / 400
    one = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    for times in (0, 1, 3):
        away = 1 + 0.3 * np.cos(times * turn)
        height = 0.3 * np.sin(times * turn) + (times == 0)
        coil = np.stack([away * np.cos(turn), away * np.sin(turn), height], axis=1)
        step_a, step_b = np.roll(one, -1, axis=0) - one, np.roll(coil, -1, axis=0) - coil
        apart = (one + step_a / 2)[:, None] - (coil + step_b / 2)[None]
        volume = np.einsum("ijk,ijk->ij", apart, np.cross(step_a[:, None], step_b[None]))
        gauss = (volume / np.linalg.norm(apart, axis=2) ** 3).sum() / (4 * np.pi)
        assert abs(linking_number(one, coil)) == pytest.approx(times, abs=1e-9)
        assert linking_number(one, coil) == pytest.approx(gauss, abs=0.01)
