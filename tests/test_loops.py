"""Tunnel loops of surfaces, and the report of tunnels that a model lacks."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.errors import TopologyError
from simplexmesh.mesh.homology import cut_open, linking_number
from simplexmesh.mesh.loops import tunnel_loops
from simplexmesh.motion.handles import HandleProposal
from simplexmesh.motion.missing_topology import missing_tunnels, tunnel_list
from simplexmesh.motion.tunnel_homology import TunnelHomology, independent


def grid_torus(around=48, across=24, tube=0.4):
    """Return a triangulated torus whose circles run along edges."""
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    s, t = 2 * np.pi * u.ravel() / around, 2 * np.pi * v.ravel() / across
    points = np.stack(
        [(1 + tube * np.cos(t)) * np.cos(s), (1 + tube * np.cos(t)) * np.sin(s), tube * np.sin(t)], axis=1
    )
    a, b = u * across + v, (u + 1) % around * across + v
    c, d = (u + 1) % around * across + (v + 1) % across, u * across + (v + 1) % across
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return points, faces


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


@pytest.mark.parametrize("tube", [0.2, 0.4, 0.7])
def test_the_tunnel_of_a_torus_is_its_inner_circle(tube):
    (loop,) = tunnel_loops(*grid_torus(tube=tube))
    assert loop.length == pytest.approx(2 * np.pi * (1 - tube), rel=0.01)
    assert loop.center == pytest.approx([0, 0, 0], abs=1e-9)


@pytest.mark.parametrize("holes", [[(2, 2)], [(2, 2), (4, 2)], [(2, 2), (4, 2), (6, 2)]])
def test_every_square_tunnel_of_a_plate(holes):
    vertices, faces = block(holes, (7, 3))
    loops = tunnel_loops(vertices, faces)
    assert [loop.length for loop in loops] == pytest.approx([4.0] * len(holes))
    found = np.array(sorted(loop.center[:2].tolist() for loop in loops))
    assert found == pytest.approx(np.array(holes) + 0.5)


def test_loops_stay_when_vertices_have_other_numbers_and_places():
    vertices, faces = block([(2, 2), (4, 2)], (5, 3))
    rng = np.random.default_rng(0)
    order = rng.permutation(len(vertices))
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    moved = np.zeros_like(vertices)
    moved[order] = 3 * vertices @ rotation.T + 1
    loops = tunnel_loops(moved, order[faces][rng.permutation(len(faces))])
    assert [loop.length for loop in loops] == pytest.approx([12.0, 12.0])


def test_turned_inside_out_handles_are_tunnels():
    vertices, faces = grid_torus(tube=0.3)
    (loop,) = tunnel_loops(vertices, faces[:, ::-1])
    assert loop.length == pytest.approx(2 * np.pi * 0.3, rel=0.02)


def test_a_ball_has_no_loops_and_borders_are_refused():
    ball = sm.sphere(5).triangulated()
    assert tunnel_loops(ball.vertices, ball.faces) == ()
    with pytest.raises(TopologyError, match="closed"):
        tunnel_loops(ball.vertices, ball.faces[1:])


def test_forms_count_the_loops_of_the_basis():
    cut = cut_open(*block([(2, 2), (4, 2)], (5, 3)))
    homology = TunnelHomology(cut.vertices, cut.faces)
    loops = [homology.winding_of_path(cut.loop(edge, cut.parent)) for edge in cut.generators.tolist()]
    assert np.array_equal(loops, np.eye(4))
    triangles = [homology.winding_of_path(face) for face in cut.faces]
    assert not np.any(triangles)


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


class TestLeftOut:
    homology = TunnelHomology(*block([(2, 2), (4, 2)], (5, 3)))

    def accepted(self, loop):
        place = np.stack([loop.center, loop.center])
        winding = self.homology.winding_of_path(loop.vertices)
        return HandleProposal((0, 1), place, np.ones(2), 0.0, 0.0, accepted=True, winding=winding)

    def test_tunnels_that_were_found_are_not_reported(self):
        one, other = self.homology.tunnels
        (lacking,) = missing_tunnels(self.homology, [self.accepted(one)], edge=0.1, vertices=1000)
        assert lacking.centers[0] == pytest.approx(other.center)
        assert 2 * np.pi * lacking.radii[0] == pytest.approx(4.0)
        assert missing_tunnels(self.homology, [self.accepted(one), self.accepted(other)], edge=0.1, vertices=1000) == ()

    def test_why(self):
        one = self.homology.tunnels[0]
        assert {x.reason for x in missing_tunnels(self.homology, [], edge=0.1, vertices=1000)} == {
            "its films did not meet"
        }
        narrow = missing_tunnels(self.homology, [], edge=1.0, vertices=1000)[0].reason
        assert narrow.startswith("its girth of 4 is 4 edges of the model; about ")
        place = np.stack([one.center, one.center])
        before = HandleProposal((3, 4), place, np.ones(2), 0.0, 0.0, reason="refused by accept")
        said = [x.reason for x in missing_tunnels(self.homology, [before], edge=0.1, vertices=1000)]
        assert "its films met, but were not joined: refused by accept" in said

    def test_few_are_listed_one_by_one(self):
        many = [HandleProposal((-1, -1), np.zeros((2, 3)), np.ones(2), 0.0, 0.0, reason="why")] * 6
        assert tunnel_list(many).endswith("; 2 more, in topology.handles")

    def test_a_line_that_jumps_between_sheets_has_no_class(self):
        fine = TunnelHomology(*grid_torus(200, 60, 0.4))
        across = np.array([[1.4, 0, 0], [-1.4, 0, 0], [0, 1.4, 0]])
        assert fine.winding(across, 0.01) is None
        assert not independent([], None)


def test_a_sphere_finds_the_narrow_tunnels_of_triangles():
    vertices, faces = block([(2, 2), (4, 2)], (5, 3))
    model = sm.reconstruct((vertices, faces), init="sphere", vertices=1500, iterations=60)
    assert model.mesh.genus == 2
    middles = sorted(proposal.centers.mean(axis=0)[0] for proposal in model.topology.handles)
    assert middles == pytest.approx([2.5, 4.5], abs=0.3)


@pytest.mark.parametrize(("name", "genus"), [("anchor.off", 4)])
def test_bores_are_found_from_a_sphere(data_folder, name, genus):
    model = sm.reconstruct(data_folder / name, init="sphere", vertices=4000, iterations=60)
    assert (model.mesh.genus, len(model.topology.handles)) == (genus, genus)


def test_the_handles_of_a_bone_scan_are_steps_of_its_voxels(data_folder):
    surface = sm.read_triangles(data_folder / "femur.off").oriented()
    girths = [loop.length / surface.diagonal for loop in tunnel_loops(surface.vertices, surface.faces)]
    assert girths == pytest.approx([0.0032, 0.0098], abs=0.0002)


def test_a_knot_leads_no_films(data_folder):
    from simplexmesh.motion.sampling import known_homology

    knot, ring = (sm.read_triangles(data_folder / name) for name in ("knot1.off", "torus.stl"))
    assert known_homology(knot.vertices, knot.faces, 1) is None
    assert known_homology(ring.vertices, ring.faces, 1) is not None
