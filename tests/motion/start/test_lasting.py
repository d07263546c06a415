"""The level at which an indicator is cut: where the genus lasts, though noise opens holes at other levels."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from simplexmesh.data.points import PointCloud
from simplexmesh.motion.start import from_points
from simplexmesh.motion.start.lasting import NEARBY, lasting_genus
from simplexmesh.motion.start.topology import genus
from simplexmesh.orientation.poisson import Grid, Indicator


def plate(*holes):
    """Return an indicator of a plate that has another value in columns through it, each far from the others."""
    field = np.full((12 * len(holes) + 6, 12, 10), -0.5, np.float32)
    field[3:-3, 3:-3, 3:-3] = 0.4
    for k, value in enumerate(holes):
        field[8 + 12 * k : 10 + 12 * k, 5:7, 3:-3] = value
    return field


@pytest.mark.parametrize(("value", "holes"), [(-0.4, 1), (-0.06, 1), (0.06, 0), (0.35, 0)])
def test_a_genus_that_is_the_same_nearby_is_believed(value, holes):
    found = lasting_genus(plate(value))
    assert (found.genus, found.level, len(found.places)) == (holes, 0, 0)


def test_holes_that_open_one_after_the_other_are_closed():
    field = plate(-0.02, -0.01, 0.01, 0.04, 0.08, 0.12, 0.16, 0.2, 0.24)
    assert genus(field > 0) == 2
    found = lasting_genus(field)
    assert found.level == pytest.approx(-0.025)
    assert genus(field > found.level) == found.genus == len(found.places) == 0


@pytest.mark.parametrize(("first", "end", "level"), [(12, 40, 0.0), (9, 40, 0.0), (9, 14, -0.025)])
def test_no_larger_piece_and_no_lid_that_is_only_below_is_taken(first, end, level):
    """A slab beside the plate or on its side, nothing of which is there at level 0; a low one on its side may be."""
    field = plate(-0.02, -0.01, 0.01, 0.04, 0.08, 0.12, 0.16, 0.2, 0.24)
    field = np.pad(field, ((0, 0), (0, 34), (0, 0)), constant_values=-0.5)
    field[3:-3, first:end, 3:-3] = -0.015
    assert lasting_genus(field).level == pytest.approx(level)


@pytest.mark.parametrize("margin", [0, 4])
def test_places_are_told_where_two_genera_last(margin):
    found = lasting_genus(np.pad(plate(-0.02, 0.4, -0.01, 0.03), margin, constant_values=-0.5))
    assert (found.level, found.genus) == (0, 0)
    np.testing.assert_allclose(np.sort(found.places[:, 0]), margin + np.array([8.5, 32.5, 44.5]), atol=1)
    np.testing.assert_allclose(found.places[:, 1], margin + 5.5, atol=1)
    np.testing.assert_allclose(found.places[:, 2], margin + 4.5, atol=2)


@pytest.mark.parametrize(
    "holes",
    [
        np.arange(-0.29, 0.3, 0.025),  # none lasts
        np.delete(np.arange(-0.29, 0.3, 0.025), [8, 9]),  # three levels are few
        [-0.16, -0.11, -0.09, -0.06, -0.01, 0.01, 0.04, 0.09, 0.14, 0.19, 0.24],  # only far below
        [-0.24, -0.2, -0.16, -0.12, -0.08, -0.04, -0.01, 0.01],  # only above
    ],
)
def test_a_genus_that_lasts_nowhere_near_is_not_taken(holes):
    found = lasting_genus(plate(*holes))
    assert found.level == 0
    assert len(found.places) == np.count_nonzero(np.abs(holes) < NEARBY)


@pytest.mark.parametrize(
    ("holes", "handles", "places"),
    [
        ((-0.02, -0.01, 0.01, 0.04, 0.08, 0.12, 0.16, 0.2, 0.24), 0, []),
        ((-0.02, 0.4, -0.01, 0.03), 2, [5.25, 17.25, 23.25]),
        ((-0.02, 0.4, 0.03), 1, [5.25, 17.25]),
        ((-0.21, 0.03, 0.19), 1, []),  # the genus of 10 levels in a row, of 6 there is another
    ],
)
def test_starts_have_a_genus_that_lasts_or_tell_of_doubt(monkeypatch, holes, handles, places):
    values = plate(*holes)
    indicator = Indicator(Grid(np.array([1.0, 2.0, 3.0]), 0.5, values.shape), values)
    monkeypatch.setattr(from_points, "_indicator", lambda cloud, vertices, least=0: indicator)
    monkeypatch.setattr(from_points, "screened", lambda indicator, points: indicator)  # which needs points of a surface
    cloud = PointCloud(indicator.grid.to_world(np.argwhere(values > 0)))
    start = from_points.start_from_points(cloud, 600)
    assert start.mesh.genus == start.report.genus == handles
    np.testing.assert_allclose(sorted(x for x, _, _ in start.report.doubtful), places, atol=0.5)


@pytest.mark.parametrize(("handles", "doubtful"), [(1, 3), (2, 0)])
def test_what_is_in_doubt_by_screening_alone_is_told_where_the_genus_differs(monkeypatch, handles, doubtful):
    through = [-0.4] * handles + [0.4] * (4 - handles)
    smooth, near = (
        Indicator(Grid(np.zeros(3), 1.0, values.shape), values)
        for values in (plate(*through), plate(-0.02, 0.4, -0.01, 0.03))
    )
    monkeypatch.setattr(from_points, "_indicator", lambda cloud, vertices, least=0: smooth)
    monkeypatch.setattr(from_points, "screened", lambda indicator, points: near)
    start = from_points.start_from_points(PointCloud(np.argwhere(smooth.values > 0).astype(float)), 600)
    assert start.mesh.genus == start.report.genus == handles
    assert len(start.report.doubtful) == doubtful


@pytest.mark.parametrize(
    ("cell", "noise", "finer", "bare", "doubtful"),
    [(0.8, 0.1, 3, 0, 0), (0.95, 0.1, 3, 0, 3), (0.8, 0.5, 3, 0, 3), (0.8, 0.1, -1, 0, 3), (0.8, 0.1, 3, 1, 3)],
)
def test_doubt_is_settled_by_cells_that_are_finer_than_others_and_wider_than_noise(
    monkeypatch, cell, noise, finer, bare, doubtful
):
    unsure = plate(-0.02, 0.4, -0.01, 0.03)
    through = plate(*[-0.4] * finer, *[0.4] * (4 - finer)) if finer >= 0 else unsure
    grids = [Indicator(Grid(np.zeros(3), size, v.shape), v) for size, v in ((1.0, unsure), (cell, through))]
    monkeypatch.setattr(from_points, "_indicator", lambda cloud, vertices, least=0: grids[least > 0])
    monkeypatch.setattr(from_points, "planes", lambda points: SimpleNamespace(spacing=1.0, noise=noise))
    monkeypatch.setattr(from_points, "share_bare", lambda mesh, points: float(bare and mesh.genus == finer))
    monkeypatch.setattr(from_points, "_cell", lambda points, spacing, vertices, least: cell)
    monkeypatch.setattr(from_points, "screened", lambda indicator, points: indicator)
    start = from_points.start_from_points(PointCloud(np.argwhere(unsure > 0).astype(float)), 600)
    assert len(start.report.doubtful) == doubtful
    assert start.report.cell == (cell if not doubtful else 1.0)
    assert doubtful or start.mesh.genus == start.report.genus == finer


def test_the_cells_tried_in_doubt_are_as_fine_as_points_allow():
    points = np.random.default_rng(0).uniform(size=(20_000, 3))
    side = float(np.ptp(points, axis=0).max())
    assert from_points._cell(points, 0.004, 600) == pytest.approx(side / from_points.COARSEST)
    assert from_points._cell(points, 0.004, 600, from_points.FINEST) == pytest.approx(side / from_points.FINEST)
    assert from_points._cell(points, 0.1, 600, from_points.FINEST) == pytest.approx(0.08)
