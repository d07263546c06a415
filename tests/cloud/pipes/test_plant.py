"""All lines of a cloud without a pick: found once each, with their branches; none where there is none."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.cloud.pipes.chain import chain_of
from simplexmesh.cloud.pipes.doubts import is_peaked, is_round
from simplexmesh.cloud.pipes.follow import line_of
from simplexmesh.cloud.pipes.plant import _lines, _picked
from simplexmesh.cloud.pipes.tees import with_tees
from simplexmesh.cloud.pipes.tracing.seeds import likely_picks
from simplexmesh.cloud.pipes.tracing.start import beginning
from simplexmesh.numerics import scan_lines
from tests.cloud.pipes.lines import random_chain, random_line, sampled
from tests.nightly.marks import nightly


def two_lines(seed=0):
    """A bent line, a thinner straight one far from it, and a floor."""
    rng = np.random.default_rng(seed)
    bent = sampled(chain_of([[0, 0, 0], [12, 0, 0], [12, 12.0, 0]], [3.0], 1.0), rng, 15.0, 0.01)[0]
    thin = sampled(chain_of([[0, 0, 6.0], [15, 5, 6]], [], 0.5), rng, 10.0, 0.01)[0]
    floor = rng.uniform([-5, -5, -3], [20, 20, -2.98], (2000, 3))
    return [bent, thin, floor]


@pytest.fixture(scope="module")
def plant():
    return sm.extract_pipes(np.concatenate(two_lines()))


def test_lines_are_found_once_each(plant):
    sizes = [len(part) for part in two_lines()]
    assert sorted(len(line.elements) for line in plant.lines) == [1, 3]
    by_radius = sorted(plant.lines, key=lambda line: -line.chain.radii[0])
    assert_allclose([line.chain.radii[0] for line in by_radius], [1, 0.5], rtol=0.005)
    true = np.repeat([plant.lines.index(by_radius[0]), plant.lines.index(by_radius[1]), -1], sizes)
    assert (plant.labels == true).mean() > 0.98


def test_elements_are_those_of_the_lines(plant):
    assert len(plant.elements) == 4
    assert repr(plant).startswith("Plant(2 lines, 4 elements, ")


def test_ways_out(plant, tmp_path):
    assert plant.mesh().n_holes == 4
    assert plant.to_pyvista().n_cells > 100
    plant.save(tmp_path / "plant.json")
    assert len(json.loads((tmp_path / "plant.json").read_text())["lines"]) == 2


def test_a_branch_meets_its_run_exactly():
    rng = np.random.default_rng(0)
    run = chain_of([[0, 0, 0], [24.0, 0, 0]], [], 1.0)
    branch = chain_of([[12, 0, 0], [12, 3, 9.0]], [], 0.6)
    points, more = sampled(run, rng, 15.0, 0.01)[0], sampled(branch, rng, 15.0, 0.01)[0]
    points, more = points[branch.distance(points) > 0], more[run.distance(more) > 0]
    plant = sm.extract_pipes(np.concatenate([points, more]))
    (tee,) = plant.tees
    assert (tee.kind, len(plant.lines)) == ("tee", 2)
    assert_allclose([tee.radius, tee.end_radius], [1, 0.6], rtol=0.01)
    assert_allclose(tee.start, [12, 0, 0], atol=0.05)
    assert sorted(stop for line in plant.lines for stop in line.stops) == ["end", "end", "end", "tee"]
    assert_allclose(tee.length, 1 / np.sin(np.arctan2(9, 3)), atol=0.3)  # to where the branch leaves the run
    assert apart(next(line for line in plant.lines if line.chain.radii[0] < 0.8), plant.lines[0]) < 1e-9


@pytest.mark.parametrize("seeds", [[202], *nightly(range(200, 212))])
def test_a_pipe_of_hardly_more_than_bends_is_found_from_these(seeds):
    """Its straights are too short to be found as cylinders; of twelve one that nearly meets itself is taken apart."""
    whole = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        chain = random_chain(rng, 5, ratios=(1.3, 2.5), straights=(0.2, 1.0))
        points = sampled(chain, rng)[0]
        whole.append((sm.extract_pipes(points).labels == 0).mean() > 0.95)
    assert sum(whole) >= 5 / 6 * len(whole)


def test_cylinders_too_short_for_lines_are_told():
    rng = np.random.default_rng(3)
    pipe, vessel = chain_of([[0, 0, 0], [20, 0, 0]], [], 1.0), chain_of([[5, 12, 0], [5, 12, 9]], [], 4.0)
    points = np.concatenate([sampled(each, rng, density, 0.02)[0] for each, density in ((pipe, 15), (vessel, 240))])
    plant = sm.extract_pipes(points)
    (line,), (shell,) = plant.lines, plant.cylinders
    assert_allclose([line.chain.radii[0], shell.radius, np.ptp(shell.extent[1])], [1, 4, 9], rtol=0.02)
    assert sm.extract_pipes(points, radius=(0.5, 2)).cylinders == ()
    assert len(sm.extract_pipes(points, radius=4.05).cylinders) == 1


@pytest.mark.parametrize("length", [8.0, *nightly(26.0)])
def test_a_branch_as_wide_as_its_run_does_not_turn_into_it(length):
    rng = np.random.default_rng(2)
    run, branch = chain_of([[0, 0, 0], [20, 0, 0]], [], 1.0), chain_of([[9, 0, 0], [9, 0, length]], [], 1.0)
    points = [sampled(each, rng, 15.0, 0.02)[0] for each in (run, branch)]
    inside = [branch.feet(points[0]), run.feet(points[1])]
    outside = [(feet.distance > 0) | (feet.station <= 0) for feet in inside]
    plant = sm.extract_pipes(np.concatenate([some[fine] for some, fine in zip(points, outside, strict=True)]))
    assert [len(line.elements) for line in plant.lines] == [1, 1]
    (tee,) = plant.tees
    assert_allclose(tee.start, [9, 0, 0], atol=0.05)


def apart(one, other):
    """The distance between the axes of two straight lines."""
    across = np.cross(one.chain.directions[0], other.chain.directions[0])
    return abs((one.chain.corners[0] - other.chain.corners[0]) @ across) / np.linalg.norm(across)


def test_a_branch_of_a_branch_meets_it_where_it_is_in_the_end():
    rng = np.random.default_rng(0)
    axes = [
        [[4.22, 6, 0.6], [4.22, 6.3, 30.0]],
        [[4, 0.6, 0], [4.3, 8.0, 0]],
        [[0, 0, 0], [9.0, 0, 0]],
    ]  # not runs first
    chains = [chain_of(corners, [], radius) for corners, radius in zip(axes, (0.3, 0.5, 1.0), strict=True)]
    parts = [sampled(chain, rng, 15.0, 0.01)[0] for chain in chains]
    parts = [
        p[np.all([c.distance(p) > 0 for c in chains if c is not own], axis=0)]
        for p, own in zip(parts, chains, strict=True)
    ]
    tree, here = cKDTree(np.concatenate(parts)), np.zeros(3)
    moved = [chain_of(chain.corners + 0.01, [], chain.radii[0]) for chain in chains]
    lines = [line_of(tree, here, chain, np.eye(chain.n_parameters), 0.02, ("end", "end")) for chain in moved]
    found, tees = with_tees(lines, tree, here)
    assert [tee.end_radius > 0.4 for tee in tees] == [True, False]
    assert apart(found[0], found[1]) < 1e-9
    assert apart(found[1], found[2]) < 1e-9
    for line, chain in zip(found[:2], chains, strict=False):  # the free end finds its place aside, both ways
        off = line.chain.corners - chain.corners[0]
        assert np.linalg.norm(np.cross(off, chain.directions[0]), axis=1).min() < 0.008


@pytest.mark.parametrize(
    ("place", "radius", "meets"),
    [
        ([-0.8, 0, 1.2], 0.6, True),
        ([20.8, 0, 1.2], 0.6, True),
        ([-1.3, 0, 1.2], 0.6, False),  # beyond the end
        ([21.3, 0, 1.2], 0.6, False),
        ([9, 0, 1.8], 0.6, True),
        ([9, 0, 2.2], 0.6, False),  # ends too early
        ([9, 0, -0.3], 0.6, False),  # goes through
        ([9, 0.8, 1.2], 0.6, False),  # passes
        ([9, 0, 1.2], 1.5, False),  # wider
    ],
)
def test_where_a_branch_meets_a_straight(place, radius, meets):
    chains = [chain_of([[0, 0, 0], [20, 0, 0]], [], 1.0), chain_of([place, [place[0], place[1], 9]], [], radius)]
    points = np.concatenate([sampled(chain, np.random.default_rng(0), 5.0, 0.01)[0] for chain in chains])
    tree, here = cKDTree(points), np.zeros(3)
    lines = [line_of(tree, here, chain, np.eye(chain.n_parameters), 0.02, ("end", "end")) for chain in chains]
    tees = with_tees(lines, tree, here)[1]
    assert len(tees) == meets
    for tee in tees:
        assert_allclose(tee.start, [*place[:2], 0], atol=0.05)


@pytest.mark.parametrize("shape", ["wall", "ball", "ring", *nightly("dust")])
def test_there_are_none_where_there_is_no_pipe(shape):
    rng = np.random.default_rng(0)
    ball = rng.normal(size=(2000, 3))
    points = {
        "wall": rng.uniform([0, 0, 0], [10, 10, 0.01], (2000, 3)),
        "ball": ball / np.linalg.norm(ball, axis=1)[:, None],
        "ring": sm.torus(100, 40).vertices,
        "dust": rng.uniform(0, 10, (1000, 3)),
    }[shape]
    plant = sm.extract_pipes(points)
    assert plant.lines == ()
    assert (plant.labels == -1).all()
    with pytest.raises(ValueError, match=r"^the plant has no lines$"):
        plant.mesh()


def test_a_radius_in_another_unit_is_told():
    points = np.concatenate(two_lines())
    with pytest.warns(sm.SimplexMeshWarning, match=r"^no pipe has the radius .*: cylinders have 0\.\d+ to [01]\.?\d*$"):
        assert sm.extract_pipes(points, radius=1000).lines == ()


@pytest.mark.nightly
def test_walls_beside_a_long_line_are_no_pipes():
    drawn = random_line(1)
    plant = sm.extract_pipes(drawn.points)
    assert len(plant.lines[0].elements) == 13
    assert (plant.labels[~drawn.on_pipe] >= 0).mean() < 0.02


def test_lines_stand_out_of_what_is_beside_them():
    rng = np.random.default_rng(0)
    pipe, clutter = rng.normal(0, 0.01, 1000), rng.uniform(-0.3, 0.3, 4000)
    assert is_peaked(pipe, 0.01)
    assert is_peaked(np.concatenate([pipe, clutter[:500]]), 0.01)
    assert not is_peaked(np.concatenate([pipe, clutter]), 0.01)
    for deviation in (0.01, 0.06, 0.1):
        assert not is_peaked(clutter, deviation)


def square_bar(rng, count=4000):
    """Points on two sides of a bar of 2 by 2, 40 long."""
    side, along, across = rng.integers(2, size=count), rng.uniform(0, 40, count), rng.uniform(-1, 1, count)
    return np.stack([along, np.where(side, 1, across), np.where(side, across, 1)], axis=1)


def test_bars_are_not_round():
    rng = np.random.default_rng(0)
    chain, width = chain_of([[0, 0, 0], [40.0, 0, 0]], [], 1.1), rng.normal(size=(4000, 3))
    assert not is_round(chain, square_bar(rng) + 0.02 * width)
    assert not is_round(chain, square_bar(rng) + 0.05 * width)
    bent = random_chain(rng)
    for noise in (0, 0.02, 0.2):
        for one in (chain, bent):
            assert is_round(one, sampled(one, rng, 4.0, noise)[0])


@pytest.mark.parametrize(("oval", "apart"), [(0.03, 0.0), (0.0, 0.06)])
def test_oval_pipes_and_those_of_stations_apart_are_round(oval, apart):
    """They were thrown out, from 1.5 % of the radius on."""
    rng = np.random.default_rng(1)
    chain, turn = chain_of([[0, 0, 0], [40.0, 0, 0]], [], 1.1), rng.uniform(-np.pi, np.pi, 4000)
    radius = 1.1 * (1 + oval * np.cos(2 * turn))
    y, z = radius * np.cos(turn) + 0.5 * 1.1 * apart * np.sign(np.cos(turn)), radius * np.sin(turn)
    points = np.column_stack([rng.uniform(0, 40, 4000), y, z]) + 0.005 * rng.normal(size=(4000, 3))
    assert is_round(chain, points)


def test_lines_that_are_not_round_are_none(monkeypatch):
    monkeypatch.setattr("simplexmesh.cloud.pipes.plant.is_round", lambda *_: False)
    assert sm.extract_pipes(two_lines()[1]).lines == ()


def test_what_was_followed_and_refused_is_not_tried_again(monkeypatch):
    monkeypatch.setattr("simplexmesh.cloud.pipes.plant.is_round", lambda *_: False)
    tree = cKDTree(two_lines()[0])
    taken, tried = np.zeros((2, tree.n), bool)
    start = beginning(tree, np.array([6.0, 0, 1]), (0, np.inf), 5.0)
    assert not _lines(tree, np.zeros(3), [start], taken, tried, lambda *_: None)
    assert not taken.any()
    assert tried.mean() > 0.95


def test_likely_picks_are_on_pipes_not_on_bars_or_above_a_scanner():
    rng = np.random.default_rng(0)
    pipe = sampled(chain_of([[0, 0, 9], [40, 0, 9.0]], [], 1.0), rng, 15.0, 0.0)[0]
    pipe = pipe[pipe[:, 2] > 9.5]  # an arc of 120 degrees
    turn = rng.uniform(-np.pi, np.pi, 3000)  # of rays at the pole of a scanner, on a ceiling
    ring = np.column_stack([0.01 * np.cos(turn), 0.01 * np.sin(turn) + 20, 0.01 * rng.normal(size=3000)])
    clean = np.concatenate([pipe, square_bar(rng)])
    points = np.concatenate([clean + 0.01 * rng.normal(size=clean.shape), ring])
    first = likely_picks(points, 0.01, rng)[:200]
    assert (first < len(pipe)).mean() > 0.95


def test_a_pipe_is_followed_of_whose_middle_little_is_seen():
    rng = np.random.default_rng(0)
    points = sampled(chain_of([[0, 0, 0], [30.0, 0, 0]], [], 1.0), rng, 15.0, 0.01)[0]
    turn = np.abs(np.arctan2(points[:, 1], points[:, 2]))
    seen = turn < np.where(np.abs(points[:, 0] - 15) < 5, 0.3, 1.8)
    (line,) = sm.extract_pipes(points[seen]).lines
    assert line.length > 29


def test_picks_are_not_tried_beside_each_other(monkeypatch):
    places, points = [], np.concatenate(two_lines())

    def refused(tree, place, *_):
        places.append(place)
        raise ValueError

    monkeypatch.setattr("simplexmesh.cloud.pipes.plant.beginning", refused)
    even, none = scan_lines.even(cKDTree(points)), np.zeros(len(points), bool)
    assert not [*_picked(even, (0, np.inf), 5.0, none, none.copy(), 0.01, np.random.default_rng(0))]
    apart = np.linalg.norm(np.array(places)[:, None] - places, axis=2)[np.triu_indices(len(places), 1)]
    assert len(places) > 10
    assert apart.min() > 0.5  # of the thin pipe 100 points are within 0.6


@pytest.mark.parametrize("around", [False, *nightly(True)])
def test_lines_of_a_scanner_far_apart_are_followed(around):
    chain = chain_of([[0, 0, 0], [12, 0, 0], [12, 12.0, 0]], [3.0], 1.0)
    along, turns = (0.52, 0.02) if around else (0.02, 0.52)  # radii between points
    stations, turn = (
        each.ravel() for each in np.meshgrid(np.arange(0, chain.stations[-1], along), np.arange(-1.8, 1.8, turns))
    )
    axis, direction = chain.at(stations)
    out = np.cos(turn)[:, None] * [0, 0, 1.0] + np.sin(turn)[:, None] * np.cross(direction, [0, 0, 1.0])
    points = axis + (1 + 0.01 * np.random.default_rng(0).normal(size=len(axis)))[:, None] * out
    for line in (sm.follow_pipe(points, [5, 0, 1]), *sm.extract_pipes(points).lines):
        assert [element.kind for element in line.elements] == ["straight", "bend", "straight"]
        assert_allclose([element.radius for element in line.elements], 1, rtol=0.01)
        assert (line.labels >= 0).mean() > 0.95


def test_radii_may_be_bounded():
    plant = sm.extract_pipes(np.concatenate(two_lines()), radius=(0.3, 0.7))
    assert [len(line.elements) for line in plant.lines] == [1]
