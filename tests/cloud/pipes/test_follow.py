"""Pipes followed from one pick: bends of all radii, shadows, diameters, walls, ends; what is refused; what is saved."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.cloud.pipes import follow, refining
from simplexmesh.cloud.pipes.chain import Chain, chain_of
from simplexmesh.cloud.pipes.tracing.segmenting import segmented
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings
from simplexmesh.cloud.pipes.tracing.tracking import Step, Track
from tests.cloud.pipes.lines import meeting, random_chain, random_line, sampled, unit
from tests.cloud.scenes.line_scoring import line_score
from tests.cloud.scenes.piping import View, pipe_line
from tests.nightly.marks import nightly


def elbow(ratio, angle=90.0, radius=1.0, straight=10.0):
    """Straight, bend, straight, of a bend radius in radii and an angle in degrees."""
    turn = np.radians(angle)
    reach = radius * ratio * np.tan(turn / 2)
    corner = np.array([straight * radius + reach, 0, 0])
    along = np.array([np.cos(turn), np.sin(turn), 0])
    corners = [np.zeros(3), corner, corner + (straight * radius + reach) * along]
    return chain_of(corners, [radius * ratio], radius)


def followed(chain, *, noise=0.01, arc=360.0, seed=0, hidden=(0.0, 0.0), station=3.0, **options):
    """What is found of a chain seen within an arc, but not between two stations, from a pick at another one."""
    rng = np.random.default_rng(seed)
    points, s = sampled(chain, rng, 30.0, noise, np.array([0.3, -0.2, 1.0]) / 1.063, arc)
    seen = (s < hidden[0]) | (s > hidden[1])
    points, s = points[seen], s[seen]
    return sm.follow_pipe(points, points[np.abs(s - station).argmin()], **options)


class TestBends:
    """Protocol P8: straight, elbow, straight."""

    @pytest.mark.parametrize(("arc", "noise"), [(200.0, 0.04), (360.0, 0.01), *nightly((200.0, 0.01), (360.0, 0.04))])
    @pytest.mark.parametrize("ratio", [1.25, 1.5, 2.0, 3.0, 6.0])
    def test_of_all_radii_are_followed(self, ratio, arc, noise):
        line = followed(elbow(ratio), noise=noise, arc=arc)
        assert [element.kind for element in line.elements] == ["straight", "bend", "straight"]
        bend = line.elements[1]
        assert_allclose(bend.bend_radius, ratio, rtol=0.02 if noise < 0.02 else 0.08)
        assert_allclose(bend.bend_angle, np.pi / 2, atol=np.radians(0.5))
        assert_allclose([element.radius for element in line.elements], 1, rtol=0.003 if noise < 0.02 else 0.008)
        assert abs(bend.bend_radius - ratio) < 5 * bend.deviations.bend_radius + 0.003

    @pytest.mark.parametrize("seed", [200, *nightly(201, 204, 205)])
    def test_with_one_or_two_radii_between_them_are_followed(self, seed):
        rng = np.random.default_rng(seed)
        chain = random_chain(rng, 5, ratios=(1.3, 2.5), straights=(1.0, 2.0))
        points = sampled(chain, rng)[0]
        line = sm.follow_pipe(points, points[0])
        assert [element.kind for element in line.elements] == ["straight", *["bend", "straight"] * 5]
        assert_allclose(sorted(each.bend_radius for each in line.elements[1::2]), sorted(chain.bend_radii), rtol=0.1)

    def test_as_tight_as_the_pipe_is_wide_are_followed(self):
        line = followed(elbow(1.0))
        assert [element.kind for element in line.elements] == ["straight", "bend", "straight"]
        assert_allclose(line.elements[1].bend_radius, 1, rtol=0.02)

    @pytest.mark.parametrize("angle", [30.0, 45.0, 60.0, 90.0])
    def test_are_the_same_from_both_ends(self, angle):
        """Protocol P10; elements found one after the other depend on where one starts (Chaperon 2002, 3.3.1)."""
        chain = elbow(3.0, angle)
        one, other = (followed(chain, station=station) for station in (2.0, chain.stations[-1] - 2.0))
        assert_allclose(one.elements[1].bend_radius, 3, rtol=0.02)
        assert_allclose(np.degrees(one.elements[1].bend_angle), angle, atol=0.3)
        assert_allclose(one.elements[1].bend_radius, other.elements[1].bend_radius, rtol=0.01)
        assert_allclose(one.chain.radii, other.chain.radii, rtol=2e-4)

    @pytest.mark.parametrize("seed", [0, *nightly(2, 6)])
    @pytest.mark.parametrize("station", [3.0, *nightly(5.0), 5.8])
    @pytest.mark.parametrize("way", [1, -1])
    def test_too_tight_for_the_pipe_are_none(self, seed, station, way):
        """Where another of the same radius crosses its end, half a radius off its axis."""
        rng = np.random.default_rng(seed)
        picked, other = (
            chain_of([[0, 0, 0], [7, 0, 0]], [], 1.0),
            chain_of([[7.5, -2.8, 0.5], [7.5, 5.3, 0.5]], [], 1.0),
        )
        own, beyond = (sampled(each, rng, 48.0, 0.001, np.array([0.0, 0.0, 1.0]), 360.0)[0] for each in (picked, other))
        outside = (picked.distance(beyond) > -0.01) | (beyond[:, 0] > 7)
        points = np.concatenate([own[other.distance(own) > -0.01], beyond[outside]])
        line = sm.follow_pipe(way * points, [way * station, 0, way])
        longest = max(line.elements, key=lambda element: element.length)
        assert_allclose(longest.radius, 1, rtol=0.003)
        assert_allclose(np.abs(longest.primitive.axis), [1, 0, 0], atol=0.01)
        assert 5 < longest.length < 7
        assert all(element.bend_radius is None or element.bend_radius > 0.999 for element in line.elements)

    def test_in_which_a_line_ends_have_the_angle_that_is_seen(self):
        chain = elbow(4.0)
        end = chain.stations[2] - 1.0
        line = followed(chain, hidden=(end, np.inf))
        assert [element.kind for element in line.elements] == ["straight", "bend"]
        assert_allclose(line.elements[1].bend_radius, 4, rtol=0.02)
        assert_allclose(line.elements[1].bend_angle * 4, end - chain.stations[1], atol=0.2)

    @pytest.mark.parametrize("seed", [1, *nightly(2)])
    def test_that_end_a_line_too_soon_to_be_traced_are_told_from_points(self, seed):
        chain = elbow(1.5)
        line = followed(chain, hidden=(chain.stations[1] + 0.5, np.inf), arc=200.0, seed=seed)
        assert [element.kind for element in line.elements] == ["straight", "bend"]
        assert_allclose(line.elements[1].length, 0.5, atol=0.2)

    @pytest.mark.parametrize(("noise", "seeds"), [(0.01, 2), (0.04, 2), *nightly((0.01, 5), (0.04, 5))])
    def test_there_are_none_where_a_straight_ends(self, noise, seeds):
        straight = chain_of([[0.0, 0, 0], [12, 0, 0]], [], 1.0)
        assert all(len(followed(straight, arc=200.0, noise=noise, seed=seed).elements) == 1 for seed in range(seeds))

    @pytest.mark.parametrize("seed", [0, *nightly(1, 2)])
    def test_may_be_tight_beside_the_pick(self, seed):
        chain = elbow(1.25)
        line = followed(chain, arc=200.0, noise=0.02, seed=seed, station=chain.stations[1] - 0.05)
        assert [element.kind for element in line.elements] == ["straight", "bend", "straight"]


class TestShadows:
    @pytest.mark.parametrize("length", [1.0, 3.0, 5.0])
    @pytest.mark.parametrize("start", [5.0, 11.0])
    def test_are_jumped_over(self, length, start):
        line = followed(elbow(6.0), hidden=(start, start + length))
        assert [element.kind for element in line.elements] == ["straight", "bend", "straight"]
        assert_allclose(line.length, elbow(6.0).stations[-1], atol=0.3)
        assert_allclose(line.elements[1].bend_radius, 6, rtol=0.02)

    def test_in_last_bends_do_not_split_them(self):
        """What is seen behind one may be drawn as a straight and a bend of its own."""
        turn, ratio = np.radians(105), 9.0
        reach = ratio * np.tan(turn / 2)
        corner = np.array([10 + reach, 0, 0])
        chain = chain_of([np.zeros(3), corner, corner + reach * np.array([np.cos(turn), np.sin(turn), 0])], [ratio], 1)
        start = chain.stations[1] + 0.65 * turn * ratio
        hidden = start, chain.stations[2] - 0.5
        lines = [followed(chain, noise=0.02, arc=200.0, seed=seed, hidden=hidden) for seed in range(6)]
        whole = [line for line in lines if [element.kind for element in line.elements] == ["straight", "bend"]]
        assert len(whole) >= 5
        assert_allclose([line.elements[1].bend_radius for line in whole], ratio, rtol=0.02)

    def test_longer_than_asked_for_are_ends(self):
        line = followed(elbow(3.0, straight=15.0), hidden=(6.0, 9.0), gap=1.0)
        assert_allclose(line.length, 6, atol=0.3)
        assert line.stops == ("end", "end")

    def test_nothing_is_found_behind_an_end(self):
        rng = np.random.default_rng(0)
        chain = elbow(3.0)
        points, s = sampled(chain, rng, 30.0, 0.01)
        beside = sampled(chain_of([[0, 0, 4.0], [40, 0, 4]], [], 1.0), rng, 30.0, 0.01)[0]
        line = sm.follow_pipe(np.concatenate([points[s < 8], beside]), points[np.abs(s - 3).argmin()])
        assert_allclose(line.length, 8, atol=0.3)


class TestStops:
    def stops(self, points):
        """Follow a pipe of radius 1 along x; return why it stops in the order of x, and where."""
        line = sm.follow_pipe(points, points[np.abs(points[:, 0] - 6).argmin()])
        ends = [(line.elements[0].start[0], line.stops[0]), (line.elements[-1].end[0], line.stops[1])]
        return zip(*sorted(ends), strict=True)

    def pipe(self, rng, view=None):
        return sampled(chain_of([[0.0, 0, 0], [12, 0, 0]], [], 1.0), rng, 30.0, 0.01, view, 180.0)[0]

    @pytest.mark.parametrize("sparse", [1, 4])
    def test_say_that_a_wall_begins_but_not_that_a_floor_is_beside(self, sparse):
        """Also where that end of the pipe is as sparse as the wall."""
        rng = np.random.default_rng(0)
        points = self.pipe(rng)
        points = points[rng.random(len(points)) < np.where(points[:, 0] > 8, 1 / sparse, 1)]
        wall, floor = rng.uniform(-6, 6, (2, 4000, 3))
        wall[:, 0], floor[:, 2] = 12, -1.5
        wall = wall[np.hypot(wall[:, 1], wall[:, 2]) > 1][::sparse]
        ends, stops = self.stops(np.concatenate([points, wall, floor]))
        assert_allclose(ends, [0, 12], atol=0.3)
        assert stops == ("end", "obstacle")

    @pytest.mark.parametrize("beside", ["cap", "shadow", "wall behind", "thinner", "outliers", "neighbor"])
    def test_are_ends_where_nothing_wider_begins_at_the_rim(self, beside):
        rng = np.random.default_rng(0)
        points = self.pipe(rng, np.array([0, 0, 1.0]) if beside == "shadow" else None)
        y, z = rng.uniform(-6, 6, (2, 9000))
        disc = np.column_stack([np.full(9000, 12.0), y, z])
        if beside == "shadow":
            x = 1.5 * y + 6
            more = np.column_stack([x, z, np.full(9000, -1.4)])[(x < 0) | (x > 12) | (np.abs(z) > 1)]
        elif beside == "wall behind":
            more = np.add(disc, [0.8, 0, 0])
        elif beside == "cap":
            more = disc[np.hypot(y, z) < 1]
        elif beside == "outliers":
            more = rng.uniform([-3, -3, -3], [15, 3, 3], (len(points), 3))
        elif beside == "neighbor":
            more = np.add(self.pipe(rng), [11.7, 2.1, 0])
        else:
            more = 0.3 * self.pipe(rng) + [12, 0, 0]
        assert list(self.stops(np.concatenate([points, more])))[1] == ("end", "end")


class TestDiameters:
    @pytest.mark.parametrize("ratio", [0.6, 0.8, 1.2, 1.5])
    def test_change_in_reducers(self, ratio):
        chain = Chain(
            np.array([[0.0, 0, 0], [30, 0, 0]]), np.zeros(0), np.array([1, ratio]), np.array([[0, 14.0, 15.0]])
        )
        line = followed(chain, arc=200.0)
        assert [element.kind for element in line.elements] == ["straight", "reducer", "straight"]
        assert_allclose([line.elements[0].radius, line.elements[2].radius], [1, ratio], rtol=0.003)
        reducer = line.elements[1]
        assert_allclose([reducer.radius, reducer.end_radius], [1, ratio], rtol=0.003)
        assert_allclose([reducer.start[0], reducer.end[0]], [14, 15], atol=0.2)
        assert reducer.primitive.kind == "cone"

    def test_a_flange_is_no_diameter(self):
        rng = np.random.default_rng(0)
        points, s = sampled(chain_of([[0.0, 0, 0], [30, 0, 0]], [], 1.0), rng, 30.0, 0.01)
        flange = sampled(chain_of([[14.0, 0, 0], [14.5, 0, 0]], [], 1.5), rng, 30.0, 0.01)[0]
        points = points[(s < 14) | (s > 14.5)]
        line = sm.follow_pipe(np.concatenate([points, flange]), points[np.abs(s[(s < 14) | (s > 14.5)] - 3).argmin()])
        assert [element.kind for element in line.elements] == ["straight"]
        assert_allclose(line.length, 30, atol=0.3)

    @staticmethod
    def eccentric(seed, offset, *, gap=False):
        """A pipe along x of radius 1, and behind a reducer from 14 to 16 one of 0.7, moved up; 200 degrees are seen."""
        rng = np.random.default_rng(seed)
        x, share = rng.uniform(0, 30, 6000), 0.0
        turn = rng.uniform(0, 2 * np.pi) + np.radians(rng.uniform(-100, 100, len(x)))
        share = np.clip((x - 14) / 2, 0, 1)
        out = 1 - 0.3 * share + rng.normal(0, 0.01, len(x))
        points = np.stack([x, out * np.cos(turn), offset * share + out * np.sin(turn)], axis=1)
        return points[(x < 14) | (x > 16)] if gap else points

    @pytest.mark.parametrize("pick", [5, 25])
    @pytest.mark.parametrize("offset", [0.3, 0.15, 0.06])
    def test_lines_go_on_through_eccentric_reducers(self, offset, pick):
        points = self.eccentric(0, offset)
        line = sm.follow_pipe(points, points[np.abs(points[:, 0] - pick).argmin()])
        assert [element.kind for element in line.elements] == ["straight", "reducer", "straight"]
        first, reducer, last = sorted(line.elements, key=lambda each: each.start[0])
        assert abs(reducer.offset - offset) < 5 * reducer.deviations.offset < 0.03
        assert_allclose([first.radius, last.radius], [1, 0.7], atol=0.004)
        assert_allclose(np.sort([reducer.start[0], reducer.end[0]]), [14, 16], atol=0.15)
        assert_allclose(np.abs(first.primitive.axis @ last.primitive.axis), 1, rtol=1e-14)

    def test_eccentric_reducers_are_found_in_any_place_and_unit(self):
        points, T = self.eccentric(1, 0.3), Rotation.random(random_state=2).as_matrix()
        pick = points[np.abs(points[:, 0] - 5).argmin()]
        here = sm.follow_pipe(points, pick).elements
        there = sm.follow_pipe(50 * points @ T + 9, 50 * pick @ T + 9).elements
        assert [each.kind for each in here] == [each.kind for each in there] == ["straight", "reducer", "straight"]
        assert_allclose(there[1].offset, 50 * here[1].offset, rtol=0.02)

    @pytest.mark.parametrize("pick", [5, 25])
    def test_pipes_with_nothing_between_them_are_two(self, pick):
        points = self.eccentric(0, 0.3, gap=True)
        line = sm.follow_pipe(points, points[np.abs(points[:, 0] - pick).argmin()])
        assert [element.kind for element in line.elements] == ["straight"]

    @pytest.mark.parametrize("seed", [1, *nightly(2)])
    def test_a_head_of_a_vessel_beside_whose_axis_a_pipe_ends_is_no_reducer(self, seed):
        rng = np.random.default_rng(seed)
        pipe = sampled(chain_of([[0.0, 0, 0], [14.3, 0, 0]], [], 1.0), rng, 30.0, 0.01)[0]
        shell = sampled(chain_of([[15.2, 0.5, 0], [22, 0.5, 0]], [], 2.4), rng, 30.0, 0.01)[0]
        head = rng.normal(size=(9000, 3)) / [2, 1, 1]
        head *= -2.4 * np.sign(head[:, :1]) / np.linalg.norm(head * [2, 1, 1], axis=1)[:, None]
        head += [15.2, 0.5, 0]
        head = head[np.hypot(head[:, 1], head[:, 2]) > 1]
        line = sm.follow_pipe(np.concatenate([pipe, head, shell]), pipe[np.abs(pipe[:, 0] - 4).argmin()])
        assert [element.kind for element in line.elements] == ["straight"]
        assert sorted(line.stops) == ["end", "obstacle"]

    @pytest.mark.parametrize(("scale", "wrong"), [(1e300, "reach to"), (1e-300, "be")])
    def test_lengths_whose_products_overflow_are_refused(self, scale, wrong):
        with pytest.raises(ValueError, match=rf"^cloud must be within .*, not {wrong} .* another unit$"):
            sm.follow_pipe(scale * np.random.default_rng(0).normal(size=(60, 3)), (0, 0, 0))

    def test_a_given_radius_is_kept(self):
        line = followed(elbow(3.0), radius=1.01)
        assert {element.radius for element in line.elements} == {1.01}

    def test_a_given_radius_is_kept_where_a_short_straight_ends_the_line(self):
        chain = elbow(3.0)
        line = followed(chain, hidden=(chain.stations[2] + 0.7, np.inf), radius=1.01)
        assert {element.radius for element in line.elements} == {1.01}

    @pytest.mark.parametrize("radius", [(1.3, 1.9), 1000.0, 0.001])
    def test_another_radius_than_asked_for_is_named(self, radius):
        """Also one in another unit than the cloud's."""
        with pytest.raises(ValueError, match=r"^radius must be that of the pipe at pick, about (1|0\.9\d+|1\.0\d+)$"):
            followed(elbow(3.0), radius=radius)


class TestLines:
    @pytest.mark.parametrize("seed", [0, *nightly(2, 4)])
    def test_of_many_elements_by_walls_are_found_whole(self, seed):
        scene = pipe_line(seed)
        line = sm.follow_pipe(scene.points, scene.points[scene.picks[3]])
        score = line_score(line.elements, scene)
        assert score.recall == score.precision == 1
        assert score.ordered
        assert score.bend_radius < 0.02
        assert score.worst_radius < 0.005
        assert max(max(meeting(*pair)) for pair in zip(line.elements, line.elements[1:], strict=False)) < 1e-9
        true = scene.labels >= 0
        true &= scene.labels <= max(element.shape for element in scene.elements)
        assert (line.labels[true] >= 0).mean() > 0.97

    def test_move_and_grow_with_their_points(self):
        drawn = random_line(3, bends=2)
        turn, shift, scale = Rotation.random(random_state=2).as_matrix(), np.array([1e6, -2e6, 500.0]), 0.05
        one = sm.follow_pipe(drawn.points, drawn.pick)
        other = sm.follow_pipe(scale * drawn.points @ turn.T + shift, scale * turn @ drawn.pick + shift)
        corners, expected = other.chain.corners, scale * one.chain.corners @ turn.T + shift
        if np.linalg.norm(corners[0] - expected[0]) > np.linalg.norm(corners[-1] - expected[0]):
            corners = corners[::-1]  # which end comes first is not told
        assert_allclose(corners, expected, atol=0.05 * scale)
        assert_allclose(other.chain.radii, scale * one.chain.radii, rtol=1e-3)

    def test_labels_are_elements(self):
        line = followed(elbow(3.0))
        assert set(line.labels) <= {-1, 0, 1, 2}
        assert (line.labels >= 0).mean() > 0.99
        assert line.rms < 0.012


class TestClosed:
    @pytest.mark.parametrize("station", [2.0, 13.0, 30.0])
    def test_lines_are_found_once_from_anywhere(self, station):
        corners = [[3, 0, 0], [14, 0, 0], [14, 10, 3], [0, 9, 0], [0, 0, 0], [3, 0, 0.0]]
        line = followed(chain_of(corners, [3.0, 2.0, 2.5, 3.0], 1.0), arc=220.0, station=station)
        assert line.stops == ("closed", "closed")
        assert [element.kind for element in line.elements] == ["straight", "bend"] * 4
        for pair in zip(line.elements, [*line.elements[1:], line.elements[0]], strict=True):
            assert max(meeting(*pair)) < 1e-9
        assert_allclose(sorted(e.bend_radius for e in line.elements[1::2]), [2, 2.5, 3, 3], rtol=0.02)
        assert max(e.deviations.bend_radius for e in line.elements[1::2]) < 0.05
        assert (line.labels >= 0).mean() > 0.99
        assert line.mesh().n_holes == 0


class TestStraights:
    @pytest.mark.parametrize("seed", [51, 56, *nightly(57)])
    def test_with_much_noise_and_strays_are_one(self, seed):
        """Where slight corners stay that points do not ask for, they are in up to six pieces."""
        rng = np.random.default_rng(seed)
        turn, height = np.radians(rng.uniform(-180, 180, 3000)), rng.uniform(0, 2, 3000)
        pipe = np.stack([0.05 * np.cos(turn), 0.05 * np.sin(turn), height], axis=1) + rng.normal(0, 0.0055, (3000, 3))
        strays = rng.uniform([-0.3, -0.3, 0], [0.3, 0.3, 2], (300, 3))
        line = sm.follow_pipe(np.concatenate([pipe, strays]), pipe[np.abs(height - 1).argmin()])
        assert [element.kind for element in line.elements] == ["straight"]

    """Protocol P9: chains of 50 steps in three straight parts, whose directions are noisy."""

    @pytest.mark.parametrize("degrees", [1, 4, 7, 10])
    def test_are_told_by_places_not_by_directions(self, degrees):
        rng, chain = np.random.default_rng(degrees), random_line(1, bends=2, walls=False).chain
        places, along = chain.at(np.linspace(0, chain.stations[-1], 50))
        noisy = [unit(u + np.radians(degrees) * rng.normal(size=3) / np.sqrt(2)) for u in along]
        steps = [Step(p + 0.01 * rng.normal(size=3), u, 1.0, 0.3, 0.0) for p, u in zip(places, noisy, strict=True)]
        found = segmented(Track(steps), 1.0)
        assert len(found.bend_radii) == 2
        assert_allclose(found.corners[1:-1], chain.corners[1:-1], atol=0.2)

    @pytest.mark.parametrize("ratio", [1.1, 3.0, 10.0])
    def test_are_joined_by_the_bend_between_them(self, ratio):
        chain = elbow(ratio)
        places, along = chain.at(np.linspace(0, chain.stations[-1], 200))
        found = segmented(Track([Step(p, u, 1.0, 0.3, 0.0) for p, u in zip(places, along, strict=True)]), 1.0)
        assert_allclose(found.bend_radii, [ratio], rtol=0.1)


class TestWaysOut:
    @pytest.fixture(scope="class")
    @classmethod
    def line(cls):
        return followed(elbow(3.0))

    def test_mesh_is_a_tube_open_at_its_ends(self, line):
        mesh = line.mesh()
        assert (mesh.n_holes, mesh.genus) == (2, 0)
        assert np.abs(line.distance(mesh.vertices)).max() < 0.02
        area = 2 * np.pi * line.elements[0].radius * line.length
        assert_allclose(line.triangulated(0.05).area, area, rtol=0.01)
        assert line.to_pyvista().n_cells > 100

    def test_normals_of_the_tube_point_outward(self, line):
        vertices, faces = (triangles := line.triangulated()).vertices, triangles.faces
        across = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
        middle = vertices[faces].mean(axis=1)
        assert ((across * line.chain.measured(middle)[1]).sum(axis=1) > 0).all()

    def test_files_tell_all_elements(self, line, tmp_path):
        line.save(tmp_path / "line.json")
        line.save(tmp_path / "line.csv")
        (described,) = json.loads((tmp_path / "line.json").read_text())["lines"]
        assert [element["kind"] for element in described["elements"]] == ["straight", "bend", "straight"]
        assert described["elements"][1]["bend_radius"] == line.elements[1].bend_radius
        rows = list(csv.DictReader((tmp_path / "line.csv").read_text().splitlines()))
        assert_allclose([float(row["diameter"]) for row in rows], 2, rtol=0.01)
        assert_allclose(float(rows[1]["bend_angle_degrees"]), 90, atol=0.5)
        assert sorted(path.name for path in tmp_path.iterdir()) == ["line.csv", "line.json"]

    def test_other_files_are_refused(self, line, tmp_path):
        with pytest.raises(ValueError, match=r"^path must end in one of .json, .csv, .step, .*, not 'line.txt'$"):
            line.save(tmp_path / "line.txt")

    def test_nothing_can_be_written_to(self, line):
        for array in (line.chain.corners, line.chain.bend_radii, line.labels, line.elements[0].start):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0

    def test_representations_read_well(self, line):
        assert repr(line).startswith("PipeLine(3 elements, diameter ")
        assert repr(line.elements[1]).startswith("PipeElement(bend, diameter ")


class TestRefused:
    def test_a_pick_off_the_cloud(self):
        with pytest.raises(ValueError, match=r"^pick must be on the cloud: its nearest point, .* is \d+\.?\d* away$"):
            sm.follow_pipe(random_line(0, bends=1).points, (1000, 0, 0))

    def test_a_pick_out_of_the_world(self):
        with pytest.raises(ValueError, match=r"^pick must be on the cloud: its nearest point, .* is 1e\+100 away$"):
            sm.follow_pipe(random_line(0, bends=1).points, (1e300, 0, 0))

    def test_a_pick_on_a_wall(self):
        wall = np.random.default_rng(0).uniform([0, 0, 0], [10, 10, 0.001], (5000, 3))
        with pytest.raises(ValueError, match=r"^pick must be on a pipe, but no cylinder fits the points around it$"):
            sm.follow_pipe(wall, (5, 5, 0))

    @pytest.mark.parametrize("count", [4, 1_000_000])
    def test_points_at_one_place(self, count):
        with pytest.raises(ValueError, match=r"^pick must be on a pipe"):
            sm.follow_pipe(np.ones((count, 3)), (1, 1, 1))

    def test_few_points(self):
        with pytest.raises(ValueError, match=r"^pick must be on a pipe"):
            sm.follow_pipe(np.random.default_rng(0).normal(size=(20, 3)), (0, 0, 0))

    @pytest.mark.parametrize("radius", [(2, 1), (-1, 1)])
    def test_wrong_limits(self, radius):
        with pytest.raises(ValueError, match=r"^radius must be"):
            sm.follow_pipe(np.eye(4)[:, :3], (0, 0, 0), radius=radius)


def test_a_chain_is_fitted_once_for_all_simpler_ones(monkeypatch):
    ways = np.radians([0, 30, 60, 30, 0])
    steps = np.array([10, 5, 20, 5, 10])[:, None] * np.stack([np.cos(ways), np.sin(ways), 0 * ways], axis=1)
    chain = chain_of(np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]), [4, 4, 4, 4], 1.0)
    points, _ = sampled(chain, np.random.default_rng(0), 30.0, 0.01, np.array([0, 0, 1.0]), 360.0)
    fits = []
    monkeypatch.setattr(refining, "fitted", lambda around, chain, *_: fits.append(chain) or chain)
    assert refining.simplified(Surroundings(points, 1.0), chain) is chain
    assert [each is chain for each in fits] == [True, False, False]


def test_a_narrow_view_among_strays_is_followed():
    """Strays tell another radius than the pipe has, unless they count less."""
    line = pipe_line(806, view=View(noise=0.005, outliers=0.3, around=120, gaps=3), count=25_000)
    found = sm.follow_pipe(line.points, line.points[line.picks[0]])
    assert line_score(found.elements, line).recall == 1


def test_shadows_are_no_longer_than_the_cloud(monkeypatch):
    places = []
    cropped = Surroundings.cropped
    monkeypatch.setattr(Surroundings, "cropped", lambda *args: places.append(len(args[1])) or cropped(*args))
    line = random_line(0, bends=1)
    sm.follow_pipe(line.points, line.pick, gap=1e5)
    assert max(places) < 1000


def test_a_line_without_elements_is_refused():
    points = np.random.default_rng(0).normal(size=(100, 3))
    chain = chain_of([[0, 0, 0], [1e-9, 0, 0]], [], 1.0)
    with pytest.raises(ValueError, match=r"^pick must be on a pipe, but that which is there has no length$"):
        follow.line_of(cKDTree(points), np.zeros(3), chain, np.eye(chain.n_parameters), 0.1, ("end", "end"))
