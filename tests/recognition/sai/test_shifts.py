"""Stages of the comparison of flat signatures alone: sampling grids, minima between samples, refinement."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simplexmesh.recognition.sai import shift_matching as shifts
from simplexmesh.recognition.sai.flat_domains import flat_domain

PATCHES = ("torus", "cylinder", "plane")


@pytest.mark.parametrize("topology", PATCHES)
def test_a_grid_samples_the_domain_evenly(topology):
    f = 5
    grid, patch = shifts.sample_grid(topology, f), flat_domain(topology, f)
    assert grid.corners.shape == grid.weights.shape == (shifts.ROWS * f, shifts.COLUMNS * f, 3)
    row, column = np.indices(grid.corners.shape[:2])
    turns = column / (shifts.COLUMNS * f)
    along = (row + 0.5 * (topology != "torus")) / (shifts.ROWS * f)
    wanted = np.stack([turns, along], axis=-1)
    if topology == "plane":
        wanted = along[..., None] * np.stack([np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)], axis=-1)
    corners = patch.coordinates[grid.corners]
    off = corners - wanted[:, :, None]
    for axis, periodic in enumerate({"torus": (1, 1), "cylinder": (1, 0), "plane": (0, 0)}[topology]):
        off[..., axis] -= periodic * np.rint(off[..., axis])
    mean = (off * grid.weights[..., None]).sum(axis=2)
    inner = slice(None) if topology == "torus" else slice(2, -2)  # at borders the nearest triangle holds a sample
    assert_allclose(mean[inner], 0, atol=1e-9)
    shares = grid.areas * np.ones((1, shifts.COLUMNS * f))
    assert_allclose(shares.sum(), 1)
    assert_allclose(shares / shares[-1], (2 * row + 1) / (2 * shifts.ROWS * f - 1) if topology == "plane" else 1)


@pytest.mark.parametrize("offset", [-0.4, 0.0, 0.3])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("at", [0, 3, 6])
def test_the_minimum_between_samples_is_that_of_a_parabola(offset, axis, at):
    steps = np.arange(7) - at
    steps = steps - 7 * np.rint(steps / 7)
    line = 2 * (steps - offset) ** 2 + 5
    mean = np.tile(line, (4, 1)) if axis else np.tile(line[:, None], (1, 4))
    row, column = (2, at) if axis else (at, 2)
    assert_allclose(shifts._parabola_minimum(mean, row, column, axis), (at + offset) / 7 % 1)
    unknown = np.where(steps == 1, np.inf, line)
    mean = np.tile(unknown, (4, 1)) if axis else np.tile(unknown[:, None], (1, 4))
    assert_allclose(shifts._parabola_minimum(mean, row, column, axis), at / 7)


def test_shifts_are_apart_by_an_angle_across_the_seam():
    assert_allclose(shifts._angle_between(np.array([0.95, 0.1]), np.array([0.05, 0.1])), 0.2 * np.pi)
    assert_allclose(shifts._angle_between(np.array([0.3, 0.98]), np.array([0.0, 0.02 + 0.36])), np.pi)


@pytest.mark.parametrize("topology", ["torus", "cylinder"])
def test_values_turned_half_are_those_of_the_opposite_places(topology):
    values = np.arange(12.0).reshape(3, 4)
    found = shifts._half_turned(values, topology)
    for row in range(3):
        for column in range(4):
            opposite = -row % 3 if topology == "torus" else 2 - row
            assert found[row, column] == values[opposite, -column % 4]


@pytest.mark.parametrize("topology", PATCHES)
def test_refinement_finds_the_minimum_nearby(topology, monkeypatch):
    """Of a distance known in closed form, flat in what the topology does not shift."""
    best = np.array([0.312, 0.207])
    free = 2 if topology == "torus" else 1

    def distance(sai, a, b, shift, *, flipped):
        off = (shift - best)[:free]
        return float(np.sqrt(0.01 + (off**2).sum())), float(0.8 - 100 * max(shift[0] - 0.3135, 0))

    class Signature:
        frequency = 6

    Signature.topology = topology
    monkeypatch.setattr(shifts, "_distance", distance)
    start = best + 0.3 / (6 * np.array([shifts.COLUMNS, shifts.ROWS]))
    found, overlap, at = shifts._refined(Signature(), None, None, start, 0.5, flipped=False)
    assert_allclose(at[:free], best[:free], atol=1e-6)
    assert_allclose(at[free:], start[free:])
    assert_allclose([found, overlap], [0.1, 0.8], atol=1e-9)
    best = np.array([0.3140, 0.207])  # where too little overlaps
    _, overlap, at = shifts._refined(Signature(), None, None, np.array([0.3130, 0.207]), 0.79, flipped=False)
    assert overlap >= 0.79
    assert at[0] < 0.3137
