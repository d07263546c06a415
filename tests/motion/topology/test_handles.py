"""Joining of holes to handles, and reasons for refusal."""

from __future__ import annotations

import re

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.mesh.face_geometry import face_areas
from simplexmesh.mesh.operators.cut_join import together
from simplexmesh.motion.topology.handles import _resampled, add_handles, face_frame
from simplexmesh.motion.topology.wrapping import resized_faces


def capped(ball, *caps):
    """Return a ball with holes: each cap by a direction and the smallest cosine to it."""
    zones = []
    for direction, cosine in caps:
        inside = ball.vertices @ np.asarray(direction, float) / np.linalg.norm(direction) > cosine
        zones.append([f for f in range(ball.n_faces) if inside[ball.faces[f]].all()])
    return sm.open_holes(ball, zones=zones).mesh


def sound(mesh):
    """Return whether the topology is that of a complete mesh."""
    return set(mesh.check().where) <= {"folded", "inverted"}


BALL = sm.sphere(10)
OPPOSITE = capped(BALL, ((0, 0, 1), 0.7), ((0, 0, -1), 0.7))


class TestConditions:
    def test_two_opposite_holes_become_a_tunnel(self):
        out = add_handles(OPPOSITE, gap=3.0)
        assert (out.mesh.genus, out.mesh.n_holes, out.mesh.n_components) == (1, 0, 1)
        assert out.mesh.n_vertices == OPPOSITE.n_vertices
        assert sound(out.mesh)
        (proposal,) = out.proposals
        assert proposal.accepted
        assert proposal.reason == ""
        assert proposal.angle < 0.05
        holes = np.flatnonzero(OPPOSITE.connectivity.face_is_hole)
        assert sorted(proposal.faces) == sorted(holes)
        assert (out.face_map[holes] == -1).all()
        assert (out.vertex_map == np.arange(OPPOSITE.n_vertices)).all()

    def test_the_measures_are_those_of_the_rims(self):
        (proposal,) = add_handles(OPPOSITE, gap=0.0).proposals
        for face, center, radius in zip(proposal.faces, proposal.centers, proposal.radii, strict=True):
            c = OPPOSITE.connectivity
            rim = OPPOSITE.vertices[c.face_vertices[c.face_offsets[face] : c.face_offsets[face + 1]]]
            assert center == pytest.approx(rim.mean(axis=0))
            assert radius == pytest.approx(np.linalg.norm(rim - rim.mean(axis=0), axis=1).mean())
        assert proposal.distance == pytest.approx(np.linalg.norm(np.diff(proposal.centers, axis=0)))

    def test_far_apart(self):
        out = add_handles(OPPOSITE, gap=0.5)
        assert out.mesh.genus == 0
        assert not out.proposals[0].accepted
        far = out.proposals[0].distance / out.proposals[0].radii.mean()
        assert out.proposals[0].reason == f"centers are {far:.3g} mean radii apart"

    def test_diameters_differ(self):
        uneven = capped(BALL, ((0, 0, 1), 0.6), ((0, 0, -1), 0.9))
        out = add_handles(uneven, gap=9.0)
        (proposal,) = out.proposals
        assert proposal.difference == pytest.approx(1 - proposal.radii.min() / proposal.radii.max())
        assert proposal.reason == f"diameters differ by {100 * proposal.difference:.0f} %"
        assert add_handles(uneven, gap=9.0, difference=0.9).mesh.genus == 1

    def test_planes_not_parallel(self):
        bent = capped(BALL, ((0, 0, 1), 0.85), ((1, 0, -0.6), 0.85))
        out = add_handles(bent, gap=9.0, difference=0.5)
        (proposal,) = out.proposals
        turn = 180 - np.degrees(np.arccos(np.dot([0, 0, 1], [1, 0, -0.6]) / np.hypot(1, 0.6)))
        assert np.degrees(proposal.angle) == pytest.approx(turn, abs=8)
        assert proposal.reason == f"planes {np.degrees(proposal.angle):.0f} degrees apart"
        assert add_handles(bent, gap=9.0, difference=0.5, angle=np.pi).mesh.genus == 1

    def test_holes_that_face_the_same_way_are_half_a_turn_apart(self):
        c = OPPOSITE.connectivity
        a, b = np.flatnonzero(c.face_is_hole)
        assert face_frame(OPPOSITE, a)[2] @ face_frame(OPPOSITE, b)[2] == pytest.approx(-1, abs=0.01)
        beside = together(OPPOSITE, OPPOSITE.moved(OPPOSITE.vertices + np.array([3.0, 0, 0])))
        out = add_handles(beside, gap=9.0, angle=3.0, accept=lambda p: False)
        said = [proposal.reason for proposal in out.proposals]
        assert said.count("planes 180 degrees apart") == 2
        assert said.count("refused by accept") == 4

    def test_each_hole_goes_to_its_closest_partner(self):
        tube = sm.cylinder(12, 4, radius=1.0, height=1.0)
        both = together(tube, tube.moved(tube.vertices + np.array([0, 0, 1.2])))
        out = add_handles(both, gap=9.0)
        assert out.mesh.n_components == 1
        assert out.proposals[0].accepted
        assert out.proposals[0].distance == pytest.approx(0.2, abs=0.05)
        assert sum(proposal.accepted for proposal in out.proposals) == 2  # the two outer ends close the ring
        taken = [proposal.reason for proposal in out.proposals if "was joined to face" in proposal.reason]
        assert taken

    def test_no_holes_no_proposals(self):
        out = add_handles(BALL)
        assert out.proposals == ()
        assert out.mesh.connectivity.twin.tolist() == BALL.connectivity.twin.tolist()


class TestChoice:
    def test_accept_is_called_with_pairs_that_meet_the_conditions(self):
        asked = []
        out = add_handles(OPPOSITE, gap=3.0, accept=lambda proposal: bool(asked.append(proposal)))
        assert len(asked) == 1
        assert not asked[0].accepted
        assert out.proposals[0].reason == "refused by accept"
        assert out.mesh.genus == 0
        asked.clear()
        add_handles(OPPOSITE, gap=0.1, accept=asked.append)
        assert not asked

    def test_accept_returns_a_bool_or_a_reason(self):
        out = add_handles(OPPOSITE, gap=3.0, accept=lambda proposal: "it is a handle of a cup")
        assert (out.mesh.genus, out.proposals[0].reason) == (0, "it is a handle of a cup")
        with pytest.raises(TypeError, match="accept must return True, False or a text with the reason, not NoneType"):
            add_handles(OPPOSITE, gap=3.0, accept=lambda proposal: None)

    def test_pairs_of_any_faces(self):
        top, bottom = (int((s * BALL.vertices[:, 2]).argmax()) for s in (1, -1))
        pair = [int(BALL.connectivity.vertex_faces[v][0]) for v in (top, bottom)]
        out = add_handles(BALL, pairs=[pair])
        assert out.mesh.genus == 1
        assert out.proposals[0].faces == tuple(pair)

    def test_pairs_that_the_operator_forbids_have_a_reason(self):
        pairs = BALL.connectivity.edge_faces
        a, b = pairs[0].tolist()
        out = add_handles(BALL, pairs=[[a, b]])
        assert out.proposals[0].reason == "they share an edge"
        beside = set(pairs[(pairs == a).any(axis=1)].ravel().tolist())
        c = next(f for f in pairs[(pairs == b).any(axis=1)].ravel().tolist() if f not in beside)
        out = add_handles(BALL, pairs=[[a, c]])
        assert re.fullmatch(r"face \d+ shares an edge with both", out.proposals[0].reason)

    def test_two_pairs_two_handles(self):
        four = capped(BALL, *(((x, y, 0), 0.93) for x, y in ((1, 1), (-1, -1), (1, -1), (-1, 1))))
        out = add_handles(four, gap=9.0, difference=0.5)
        assert out.mesh.genus == 2
        assert sum(proposal.accepted for proposal in out.proposals) == 2
        assert sound(out.mesh)

    def test_rims_of_different_counts(self):
        uneven = capped(BALL, ((0, 0, 1), 0.6), ((0.1, 0, -1), 0.7))
        sizes = uneven.connectivity.face_sizes[uneven.connectivity.face_is_hole]
        assert sizes[0] != sizes[1]
        out = add_handles(uneven, gap=9.0, difference=0.9)
        assert out.mesh.genus == 1
        assert sound(out.mesh)


class TestTarget:
    def test_far_holes_are_joined_where_the_tube_between_lies_on_data(self):
        tunnel = np.stack(np.broadcast_arrays(*_tube(radius=0.72, height=1.4)), axis=-1).reshape(-1, 3)
        cloud = sm.PointCloud(tunnel)
        out = add_handles(OPPOSITE, sm.targets.Points(cloud), gap=0.5)
        assert out.proposals[0].on_data > 0.9
        assert out.mesh.genus == 1

    def test_and_not_where_it_does_not(self):
        outside = sm.targets.Points(sm.PointCloud(4 * BALL.vertices))
        out = add_handles(OPPOSITE, outside, gap=0.5)
        assert out.proposals[0].on_data == 0.0
        assert out.proposals[0].reason.endswith("no data is between them")

    def test_a_tunnel_is_seen_from_its_axis(self):
        tunnel = np.stack(np.broadcast_arrays(*_tube(radius=0.72, height=1.4)), axis=-1).reshape(-1, 3)
        outward = tunnel * [1, 1, 0]
        for sign, found in ((-1, 1), (1, 0)):
            cloud = sm.PointCloud(tunnel, sign * outward)
            assert add_handles(OPPOSITE, sm.targets.Points(cloud), gap=0.5).mesh.genus == found


def _tube(radius, height):
    turn, z = np.meshgrid(np.linspace(0, 2 * np.pi, 60, endpoint=False), np.linspace(-height / 2, height / 2, 30))
    return radius * np.cos(turn), radius * np.sin(turn), z


class TestBadInput:
    @pytest.mark.parametrize(
        ("given", "kind", "said"),
        [
            ({"pairs": [[0, 1, 2]]}, ValueError, r"pairs\[0\]"),
            ({"pairs": [[0, 100_000]]}, ValueError, r"pairs\[0\]"),
            ({"pairs": [[0, 50], [70, 50]]}, ValueError, "face 50 is in pairs.1. and in pairs.0."),
            ({"pairs": [[4, 4]]}, ValueError, "face 4 is in pairs.0. twice"),
            ({"pairs": 3}, TypeError, "pairs must be pairs of faces, not int"),
            ({"accept": 3}, TypeError, "accept must be a function"),
            ({"target": 3}, TypeError, "target must have a method gap"),
            ({"gap": -1.0}, ValueError, "gap"),
            ({"difference": 2.0}, ValueError, "difference"),
            ({"angle": float("nan")}, ValueError, "angle"),
        ],
    )
    def test_is_refused_in_a_sentence(self, given, kind, said):
        with pytest.raises(kind, match=said):
            add_handles(BALL, **given)

    def test_mesh_must_be_one(self):
        with pytest.raises(TypeError, match="mesh must be a SimplexMesh"):
            add_handles(BALL.vertices)


class TestResizedFaces:
    def test_faces_come_to_the_size_wanted(self):
        mesh = BALL.moved(BALL.vertices * [1, 1, 4])
        wanted = mesh.area / mesh.n_faces
        for _ in range(6):
            mesh = resized_faces(mesh, np.full(len(mesh.connectivity.face_sizes), wanted))
            assert sound(mesh)
        c = mesh.connectivity
        size = face_areas(mesh.vertices, c.face_vertices, c.face_offsets) / wanted
        assert size.min() > 0.25
        assert size.max() < 2.0
        assert mesh.genus == 0

    def test_holes_stay(self):
        wanted = np.full(len(OPPOSITE.connectivity.face_sizes), OPPOSITE.area / OPPOSITE.n_faces / 3)
        out = resized_faces(OPPOSITE, wanted)
        assert out.n_holes == 2
        assert out.n_faces > 1.5 * OPPOSITE.n_faces


def test_outlines_are_compared_at_equal_steps():
    square = 0.2 * np.array([[0.0, 0, 1], [2, 0, 1], [2, 2, 1], [0, 2, 1]])
    there = _resampled(square, 8)
    np.testing.assert_allclose(there[::2], square)
    np.testing.assert_allclose(there[1::2], (square + np.roll(square, -1, axis=0)) / 2)
