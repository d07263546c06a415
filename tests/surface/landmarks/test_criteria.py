"""Landmarks of bones, on bodies made for it: the angle of a jaw, sutures that meet, cusps (Charton 2014, 5.1.3)."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

import simplexmesh as sm
from simplexmesh.surface.landmarks.junctions import _subsampled, junctions
from simplexmesh.surface.sampled_surface import SampledSurface, as_sampled_surface
from tests.nightly.marks import nightly

BEND = 0.35
"""Outer radius of the jaw's angle."""

MEETING = np.array([0.15, -0.1])


def noisy(mesh, amount):
    """The mesh with its vertices moved along their normals."""
    shift = amount * np.random.default_rng(1).normal(size=(mesh.n_vertices, 1)) * mesh.vertex_normals
    return sm.TriangleMesh(mesh.vertices + shift, mesh.faces)


@pytest.fixture(scope="module")
def jaw():
    """A plate bent like a jaw seen from the side, its border round, and thinner the farther from the angle."""
    step = 0.04
    x, y, z = np.mgrid[-0.3:2.7:step, -0.3:2.1:step, -0.3:0.3:step]
    qx, qy = BEND - x, BEND - y
    outer = np.hypot(np.maximum(qx, 0), np.maximum(qy, 0)) + np.minimum(np.maximum(qx, qy), 0) - BEND
    away = np.max([outer, np.minimum(x, y) - 0.7, x - 2.4, y - 1.8], axis=0)
    round_ = 0.16 - 0.035 * np.minimum(np.maximum(x, y), 2)
    grid = pv.ImageData(dimensions=x.shape, spacing=(step,) * 3, origin=(x.min(), y.min(), z.min()))
    grid["away"] = (np.hypot(np.maximum(away + round_, 0), z) - round_).ravel(order="F")
    found = grid.contour([0.0], scalars="away", method="flying_edges").clean()
    mesh = sm.TriangleMesh(np.asarray(found.points, dtype=float), found.regular_faces)
    return mesh if mesh.volume > 0 else sm.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def vault(count=70, *, arms=(0.4, 2.3, 4.6), pit=True):
    """A vault with grooves that meet, and a pit in one of them that is deeper than they are."""
    flat = sm.plane(count, count, size=(2.0, 2.0)).triangulated("dual")
    x, y, _ = flat.vertices.T
    px, py = x - MEETING[0], y - MEETING[1]
    away = np.hypot(px, py)
    for turn in arms:
        along, aside = px * np.cos(turn) + py * np.sin(turn), np.abs(py * np.cos(turn) - px * np.sin(turn))
        away = np.minimum(away, np.where(along > 0, aside, np.hypot(px, py)))
    z = -0.25 * (x**2 + y**2) - 0.05 * np.exp(-((away / 0.05) ** 2) / 2)
    if pit:
        z -= 0.08 * np.exp(-((x + 0.15) ** 2 + (y - 0.25) ** 2) / (2 * 0.065**2))
    return sm.TriangleMesh(np.stack([x, y, z], axis=1), flat.faces)


class TestGonion:
    """The point of a border that bends most: where the smaller of its bends is largest."""

    PICKS = ([0.5, 0.0, 0.05], [0.0, 0.5, 0.05], [0.3, 0.03, 0.0], [0.6, 0.0, 0.0])
    ANGLE = np.array([BEND * (1 - 0.5**0.5)] * 2 + [0])

    def test_picks_along_the_border_lead_to_the_angle(self, jaw):
        curvature = sm.curvature(jaw)
        found = [sm.snap_landmark(jaw, pick, "peak", radius=0.8, curvature=curvature) for pick in self.PICKS]
        assert len({each.vertex for each in found}) == 1
        assert np.linalg.norm(found[0].point - self.ANGLE) < 0.05

    def test_other_criteria_find_where_the_border_is_sharpest(self, jaw):
        """By the larger bend the landmark goes to where the border is sharpest."""
        curvature = sm.curvature(jaw)
        for criterion in ("ridge", "curvedness"):
            found = sm.snap_landmark(jaw, self.PICKS[0], criterion, radius=0.8, curvature=curvature)
            assert np.linalg.norm(found.point - self.ANGLE) > 0.5


class TestPterion:
    """Where three sutures meet."""

    PICKS = ([0.3, 0.1, 0.0], [0.0, -0.3, 0.0], [-0.05, 0.05, 0.0])

    @pytest.mark.parametrize("noise", [*nightly(0.0, 0.002), 0.004])
    def test_picks_around_lead_to_the_junction_and_not_to_a_deeper_pit(self, noise):
        mesh = noisy(vault(), noise)
        curvature = sm.curvature(mesh)
        found = [sm.snap_landmark(mesh, pick, "junction", radius=0.6, curvature=curvature) for pick in self.PICKS]
        assert max(np.linalg.norm(each.point[:2] - MEETING) for each in found) < 0.06  # two edges
        pit = sm.snap_landmark(mesh, self.PICKS[0], "pit", radius=0.6, curvature=curvature)
        assert np.linalg.norm(pit.point[:2] - MEETING) > 0.3

    @pytest.mark.nightly
    def test_a_sample_of_many_vertices_leads_to_the_same_place(self, monkeypatch):
        mesh = vault(140)
        curvature, samples = sm.curvature(mesh), as_sampled_surface(mesh)
        middle = np.flatnonzero(np.linalg.norm(mesh.vertices[:, :2] - MEETING, axis=1) < 0.1)
        assert len(_subsampled(samples, middle, 0.3)[0]) == mesh.n_vertices
        monkeypatch.setattr("simplexmesh.surface.landmarks.junctions.MAX_VERTICES", 200)
        looked_at, tree = _subsampled(samples, middle, 0.3)
        assert (tree.data == mesh.vertices[looked_at]).all()
        assert 100 < np.mean(tree.query_ball_point(mesh.vertices[middle], 0.3, return_length=True)) < 250
        found = [sm.snap_landmark(mesh, pick, "junction", radius=0.6, curvature=curvature) for pick in self.PICKS]
        assert max(np.linalg.norm(each.point[:2] - MEETING) for each in found) < 0.06

    @pytest.mark.parametrize("arms", [(0.4,), (0.4, 3.0)])
    def test_a_groove_that_only_bends_is_no_junction(self, arms):
        mesh = vault(arms=arms)
        with pytest.raises(ValueError, match=r"^pick must have a junction of three grooves within 0\.5, it has none"):
            sm.snap_landmark(mesh, [0.2, -0.1, 0.0], "junction", radius=0.5)

    def test_rotates_and_scales_with_the_surface(self):
        mesh = vault()
        q, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
        q *= np.sign(np.linalg.det(q))
        other = sm.TriangleMesh(30 * mesh.vertices @ q.T + 5, mesh.faces)
        first = sm.snap_landmark(mesh, [*MEETING + 0.1, 0.0], "junction", radius=0.6)
        again = sm.snap_landmark(other, 30 * q @ [*MEETING + 0.1, 0.0] + 5, "junction", radius=18)
        assert np.linalg.norm(mesh.vertices[again.vertex] - first.point) < 0.05  # directions are counted from elsewhere
        assert again.value == pytest.approx(first.value / 30, rel=0.1)


class TestJunctions:
    @staticmethod
    def of_arms(*turns):
        """How strong a junction the middle of a sheet is, from which arms of strength 1, 2, 3 ... leave."""
        rng = np.random.default_rng(0)
        flat = np.concatenate([[[0, 0]], rng.uniform(-1, 1, (4000, 2))])
        strength = np.zeros(len(flat))
        for k, turn in enumerate(turns):
            way = np.array([np.cos(turn), np.sin(turn)])
            on = (flat @ way > 0) & (np.abs(flat @ [way[1], -way[0]]) < 0.08)
            strength[on] = np.maximum(strength[on], k + 1)
        samples = SampledSurface(np.concatenate([flat, np.zeros((len(flat), 1))], axis=1))
        return junctions(samples, strength, np.tile([0, 0, 1.0], (len(flat), 1)), np.array([0]), 0.8)[0]

    def test_are_as_strong_as_their_third_arm(self):
        assert self.of_arms(0.1, 2.2, 4.0) == pytest.approx(1, rel=0.5)
        weaker, stronger = self.of_arms(0.1, 2.2, 4.0), self.of_arms(0.1, 2.2, 4.0, 5.2)
        assert stronger > 1.5 * weaker  # of four the second in strength

    def test_of_two_arms_are_none(self):
        assert self.of_arms(0.1, 2.2) == 0
        assert self.of_arms(0.1) == 0
        assert self.of_arms() == 0

    def test_ignore_the_other_side_of_a_wall(self):
        sheet = sm.plane(40, 40).triangulated("dual").vertices
        x, y, _ = sheet.T
        away = np.min(
            [np.where(a * x + b * y > 0, np.abs(a * y - b * x), 9) for a, b in ((1, 0), (-0.5, 0.87))], axis=0
        )
        third = np.where(y < 0, np.abs(x + 0.5 * y), 9)
        points = np.concatenate([sheet, sheet - [0, 0, 0.01]])
        strength = np.exp(-((np.concatenate([away, third]) / 0.03) ** 2))
        normals = np.repeat([[0, 0, 1.0], [0, 0, -1.0]], len(sheet), axis=0)
        middle = np.array([np.hypot(x, y).argmin()])
        samples = SampledSurface(points)
        assert junctions(samples, strength, normals, middle, 0.3)[0] == 0
        assert junctions(samples, strength, np.abs(normals), middle, 0.3)[0] > 0.1  # on one side they meet

    def test_a_uniform_field_has_none(self):
        sheet = as_sampled_surface(sm.plane(20, 20).triangulated("dual"))
        n = len(sheet.points)
        assert junctions(sheet, np.ones(n), np.tile([0, 0, 1.0], (n, 1)), np.arange(n), 0.3).max() == 0


def test_cusps_are_peaks():
    """Four cusps of a crown, picked by hand, as it were."""
    flat = sm.plane(70, 60, size=(2.0, 2.0)).triangulated("dual")
    x, y, _ = flat.vertices.T
    cusps = np.array([[0.4, 0.45], [-0.45, 0.4], [-0.4, -0.5], [0.5, -0.4]])
    hills = sum(
        h * np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.06) for h, (a, b) in zip((1, 0.8, 0.9, 1), cusps, strict=True)
    )
    crown = noisy(sm.TriangleMesh(np.stack([x, y, 0.5 * hills], axis=1), flat.faces), 0.003)
    curvature = sm.curvature(crown)
    rng = np.random.default_rng(0)
    for cusp in np.tile(cusps, (3, 1)):
        aside = cusp + 0.1 * rng.normal(size=2)
        pick = crown.vertices[np.linalg.norm(crown.vertices[:, :2] - aside, axis=1).argmin()]
        found = sm.snap_landmark(crown, pick, "peak", radius=0.4, curvature=curvature)
        assert np.linalg.norm(found.point[:2] - cusp) < 0.06
