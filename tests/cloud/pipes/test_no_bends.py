"""Pipes that end at what looks like a bend of theirs: runs that they branch off, hoppers and heads of vessels."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import simplexmesh as sm
from simplexmesh.cloud.pipes.chain import chain_of
from tests.cloud.pipes.lines import sampled
from tests.nightly.marks import nightly

SEEN = np.radians(110)
"""Angle on both sides of the x axis within which pipes and what is on them are seen."""


def along_z(rng, count, length, noise=0.01):
    """A pipe of radius 1 from z = 0 on."""
    turn = rng.uniform(-SEEN, SEEN, count)
    return np.column_stack([np.cos(turn), np.sin(turn), rng.uniform(0, length, count)]) + rng.normal(
        0, noise, (count, 3)
    )


def branch(rng, radius, half):
    """A run along x and a branch along z that leaves it at 0, all round or the half of them that faces a view."""
    run = sampled(chain_of([[-12.0, 0, 0], [12, 0, 0]], [], 1.0), rng, 30.0)[0]
    own = sampled(chain_of([[0.0, 0, 0], [0, 0, 12]], [], radius), rng, 30.0)[0]
    run = run[(np.hypot(run[:, 0], run[:, 1]) > radius) | (run[:, 2] < 0)]
    own = own[np.hypot(own[:, 1], own[:, 2]) > 1]
    out = np.concatenate([run * [0, 1, 1], own * [1, 1, 0]])
    points = np.concatenate([run, own])
    return points[out @ [0.3, -1, 0.5] > 0] if half else points


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("radius", [1.0, 0.8])
@pytest.mark.parametrize("seed", [1, *nightly(0, 2, 3)])
def test_a_branch_ends_at_its_run(seed, radius, half):
    points = branch(np.random.default_rng(seed), radius, half)
    line = sm.follow_pipe(points, pick=(0, -radius, 6))
    assert [element.kind for element in line.elements] == ["straight"]
    ends = sorted([line.elements[0].start[2], line.elements[0].end[2]])
    assert_allclose(ends[1], 12, atol=0.1)
    assert -1 < ends[0] < 1.2


@pytest.mark.parametrize("degrees", [30, 40])
@pytest.mark.parametrize("seed", [0, *nightly(1, 2, 3)])
def test_an_outlet_ends_at_its_hopper(seed, degrees):
    rng = np.random.default_rng(seed)
    rho, turn = np.sqrt(rng.uniform(1, 25, 20000)), rng.uniform(-SEEN, SEEN, 20000)
    height = 4 + (rho - 1) / np.tan(np.radians(degrees))
    cone = np.column_stack([rho * np.cos(turn), rho * np.sin(turn), height]) + rng.normal(0, 0.01, (20000, 3))
    line = sm.follow_pipe(np.concatenate([along_z(rng, 4000, 4), cone]), pick=(1, 0, 2))
    assert [element.kind for element in line.elements] == ["straight"]
    assert_allclose(line.length, 4, atol=0.15)


@pytest.mark.parametrize("seed", [0, *nightly(1, 2, 3)])
def test_the_head_of_a_vessel_is_no_bend(seed):
    rng = np.random.default_rng(seed)
    polar, turn = np.arccos(rng.uniform(0, 1, 4000)), rng.uniform(-SEEN, SEEN, 4000)
    out = np.sin(polar)
    head = np.column_stack([out * np.cos(turn), out * np.sin(turn), 6 + np.cos(polar) / 2])
    points = np.concatenate([along_z(rng, 6000, 6), head + rng.normal(0, 0.01, (4000, 3))])
    line = sm.follow_pipe(points, pick=(1, 0, 3))
    assert [element.kind for element in line.elements] == ["straight"]
    assert_allclose(line.length, 6, atol=0.3)
