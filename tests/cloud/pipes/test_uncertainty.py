"""How sure measures of pipes are said to be, against how far they are off in repeated scans."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

import simplexmesh as sm
from simplexmesh.cloud.pipes.chain import chain_of
from tests.cloud.pipes.lines import sampled

CORNERS = [[0, 0, 0], [10, 0, 0], [10, 7.0, 0]]
CHAIN = chain_of(CORNERS, [3.0], 1.0)


def scanned(seed, noise=0.02, station=3.0, **options):
    """What is found of one more scan of a line."""
    points, s = sampled(CHAIN, np.random.default_rng(seed), 15.0, noise, np.array([0.0, 0.0, 1.0]), 220.0)
    return sm.follow_pipe(points, points[np.abs(s - station).argmin()], **options)


def square(off, covariance):
    """The square of a vector in standard deviations; directions that do not vary, as they were not fitted, are 0."""
    return off @ np.linalg.pinv(covariance, 1e-9) @ off


@pytest.fixture(scope="module")
def lines():
    found = [scanned(seed) for seed in range(20)]
    assert all([e.kind for e in line.elements] == ["straight", "bend", "straight"] for line in found)
    return found


@pytest.mark.nightly
def test_covariances_of_tori_are_those_of_repeated_scans(lines):
    squares = []
    for line in lines:
        torus = line.elements[1].primitive
        tilt = torus.frame[:2] @ np.array([0, 0, np.sign(torus.axis[2])])
        sizes = 3 - torus.radius, 1 - torus.tube_radius
        squares.append(
            square(np.array([*tilt, *torus.frame @ (CHAIN.centers[0] - torus.center), *sizes]), torus.covariance)
        )
    assert 5 < np.mean(squares) < 9.5  # of 7 parameters: three standard deviations of a mean of 20


@pytest.mark.nightly
def test_covariances_of_cylinders_are_those_of_repeated_scans(lines):
    squares = []
    for line in lines:
        pipe = min((line.elements[0], line.elements[2]), key=lambda e: np.abs(e.primitive.axis[1])).primitive
        tilt = pipe.frame[:2] @ np.array([np.sign(pipe.axis[0]), 0, 0])
        shift = -pipe.frame[:2] @ pipe.point - tilt * (pipe.axis @ -pipe.point)
        squares.append(square(np.array([*tilt, *shift, 1 - pipe.radius]), pipe.covariance))
    assert 3.3 < np.mean(squares) < 7.2  # of 5 parameters


@pytest.mark.parametrize(("name", "true"), [("bend_radius", 3.0), ("bend_angle", np.pi / 2), ("radius", 1.0)])
def test_deviations_are_those_of_repeated_scans(lines, name, true):
    bends = [line.elements[1] for line in lines]
    off = [(getattr(bend, name) - true) / getattr(bend.deviations, name) for bend in bends]
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.6


def test_ends_are_as_far_off_as_they_are_said_to_be(lines):
    true = CHAIN.at(CHAIN.stations[1:3])[0]
    off = []
    for line in lines:
        bend = line.elements[1]
        for place, deviation in ((bend.start, bend.deviations.start), (bend.end, bend.deviations.end)):
            off.append(np.linalg.norm(true - place, axis=1).min() / deviation)
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.6


def test_lengths_to_an_end_are_as_far_off_as_they_are_said_to_be(lines):
    """They are known to some of the points; what is off across an end says nothing of them."""
    straights = [element for line in lines for element in line.elements[::2]]
    off = [min(abs(e.length - 7), abs(e.length - 4)) / e.deviations.length for e in straights]
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.6


def test_what_is_given_is_certain():
    line = scanned(0, radius=1.0)
    assert max(element.deviations.radius for element in line.elements) < 1e-12
    assert line.elements[1].deviations.bend_radius > 0


def test_twice_the_noise_is_twice_as_uncertain():
    one, two = (scanned(0, noise).elements[1].deviations.bend_radius for noise in (0.01, 0.02))
    assert_allclose(two / one, 2, rtol=0.2)


def test_files_have_them(lines, tmp_path):
    line = lines[0]
    line.save(tmp_path / "line.json")
    line.save(tmp_path / "line.csv")
    (described,) = json.loads((tmp_path / "line.json").read_text())["lines"]
    assert described["elements"][1]["deviations"] == line.elements[1].deviations._asdict()
    assert described["elements"][0]["deviations"]["bend_radius"] is None
    covariance = described["elements"][1]["primitive"]["covariance"]
    assert_allclose(covariance, line.elements[1].primitive.covariance)
    rows = list(csv.DictReader((tmp_path / "line.csv").read_text().splitlines()))
    assert_allclose(
        [float(row["diameter_deviation"]) for row in rows], 2 * line.elements[0].deviations.radius, rtol=1e-6
    )
    assert_allclose(float(rows[1]["bend_radius_deviation"]), line.elements[1].deviations.bend_radius, rtol=1e-6)
    assert rows[0]["bend_radius_deviation"] == ""
