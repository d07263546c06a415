"""What is no cloud, no kind and no place to write to: one sentence each, and results that nobody can change."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.cloud.extraction.working import ON_SURFACE
from simplexmesh.numerics.scan_lines import steps
from tests.nightly.marks import nightly


def test_three_points_do_not_tell_a_kind():
    with pytest.raises(ValueError, match=r"^points must be more than determine a plane, 3, to tell its kind, not 3$"):
        sm.fit_primitive(np.eye(3), "any")


def test_kinds_are_names():
    with pytest.raises(TypeError, match=r"^kinds must be a sequence of names, not int"):
        sm.extract_primitives(np.random.default_rng(0).normal(size=(100, 3)), kinds=3)
    with pytest.raises(ValueError, match=r"^kind must be one of 'plane', .*, not \['cylinder'\]$"):
        sm.fit_primitive(pipe(), ["cylinder"])


@pytest.mark.parametrize("progress", [3, "yes", None])
def test_progress_is_shown_or_not(progress):
    with pytest.raises(TypeError, match=r"^progress must be true or false"):
        sm.extract_primitives(np.random.default_rng(0).normal(size=(100, 3)), progress=progress)


def pipe(count=2000, at=(0.0, 0.0, 0.0)):
    """Points on a pipe of radius 1 at a place."""
    turn, height = np.random.default_rng(0).uniform([0, 0], [2 * np.pi, 6], (count, 2)).T
    return np.stack([np.cos(turn), np.sin(turn), height], axis=1) + at


@pytest.mark.parametrize(
    "found",
    [
        lambda points: sm.fit_primitive(points, "cylinder"),
        sm.extract_primitives,
        sm.extract_pipes,
        lambda points: sm.follow_pipe(points, points[0]),
        sm.fit_circle,
        lambda points: sm.reconstruct(points, vertices=100),
    ],
)
def test_coordinates_that_lost_digits_are_told(found):
    far = pipe(300, at=(4e6, 4e6, 0)).astype(np.float32)
    with pytest.warns(sm.SimplexMeshWarning, match=r"^the points are on a grid of 0\.25, as 32-bit numbers are"):
        found(far)


@pytest.mark.parametrize("points", [pipe().astype(np.float32), pipe(at=(4e6, 4e6, 0)), np.round(100 * pipe()) + 1e6])
def test_coordinates_with_all_their_digits_are_not(points):
    assert sm.fit_primitive(points, "cylinder").radius > 0.99


@pytest.mark.parametrize("find", [sm.extract_primitives, sm.extract_pipes])
@pytest.mark.parametrize("message", ["looking", "f"])  # at the points; finding and following
def test_the_user_may_interrupt(find, message):
    said = []

    def interrupt(fraction, words):
        said.append(fraction)
        if words.startswith(message):
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        find(pipe(), progress=interrupt)
    assert said == sorted(said)
    assert 0 <= said[-1] < 1


def test_a_file_that_cannot_be_written_is_as_it_was(tmp_path, monkeypatch):
    line = sm.follow_pipe(pipe(), (1, 0, 3))
    path = tmp_path / "pipes.json"
    path.write_text("old")
    monkeypatch.setattr("simplexmesh.cloud.pipes.saving.json_text", lambda _: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        line.save(path)
    assert [each.read_text() for each in tmp_path.iterdir()] == ["old"]
    with pytest.raises(OSError, match="nowhere"):
        line.save(tmp_path / "nowhere" / "pipes.json")


CURVES = {
    "line": lambda t: np.outer(t, [100, 200, 300]),
    "ring": lambda t: np.stack([np.cos(2 * np.pi * t), np.sin(2 * np.pi * t), 0 * t], axis=1),
    "helix": lambda t: np.stack([np.cos(10 * t), np.sin(10 * t), 10 * t], axis=1),
}


@pytest.mark.parametrize("noise", [0, 0.3])
@pytest.mark.parametrize("count", [300, *nightly(20_000)])
@pytest.mark.parametrize("name", CURVES)
def test_points_on_a_curve_are_no_surface(name, count, noise):
    points = CURVES[name](np.linspace(0, 1, count, endpoint=False))
    points += noise * np.linalg.norm(points[1] - points[0]) * np.random.default_rng(0).normal(size=(count, 3))
    for find in (sm.extract_primitives, sm.extract_pipes):
        with pytest.raises(ValueError, match=r"^cloud must be of surfaces, but its points are on a curve$"):
            find(points)


@pytest.mark.parametrize(("count", "lines", "gap"), [(1000, 34, 30), (100, 3, 10), (100, 10, 40), (500, 2, 1)])
def test_lines_of_a_scanner_are_a_surface(count, lines, gap):
    along, across = np.meshgrid(np.arange(count), gap * np.arange(lines))
    points = np.stack([along.ravel(), across.ravel(), 0 * along.ravel()], axis=1)
    points = points + 0.05 * np.random.default_rng(0).normal(size=points.shape)
    assert (steps(cKDTree(points)) > 0).mean() > ON_SURFACE


@pytest.mark.parametrize("noise", [0, 0.2])
@pytest.mark.parametrize("count", [500, 10_000, 40_000])
@pytest.mark.parametrize("radius", [2.0, 2.5])
def test_pipes_two_points_wide_are_a_surface(radius, count, noise):
    rng = np.random.default_rng(0)
    turn, along = rng.uniform([0, 0], [2 * np.pi, count / (2 * np.pi * radius)], (count, 2)).T
    round_ = radius + noise * rng.normal(size=count)
    points = np.stack([round_ * np.cos(turn), round_ * np.sin(turn), along], axis=1)
    assert (steps(cKDTree(points)) > 0).mean() > ON_SURFACE


def test_wires_over_a_floor_are_no_curve():
    rng = np.random.default_rng(0)
    floor = np.column_stack([rng.uniform(0, 10, (1800, 2)), 0.002 * rng.normal(size=1800)])
    wires = np.column_stack([rng.uniform(0, 10, 4200), 2.0 * rng.integers(0, 4, 4200), np.full(4200, 3.0)])
    points = np.concatenate([floor, wires + 0.002 * rng.normal(size=(4200, 3))])
    assert (steps(cKDTree(points)) > 0).mean() > ON_SURFACE


@pytest.mark.parametrize("find", [sm.extract_primitives, sm.extract_pipes, lambda at: sm.follow_pipe(at, (1, 0, 3))])
def test_other_columns_beside_points_are_no_normals(find):
    beside = np.column_stack([pipe(), np.random.default_rng(0).integers(-1, 2, (2000, 3))])
    with pytest.raises(
        ValueError, match=r"^cloud of shape \(\*, 6\) are points and normals, of which \d+ are zero: .* data"
    ):
        find(beside)


def test_a_list_of_points_has_a_label_for_each(tmp_path):
    points = np.repeat(pipe(500), 2, axis=0)
    sm.PointCloud(points).save(tmp_path / "twice.ply")
    for given in (points, points.tolist(), tmp_path / "twice.ply", sm.PointCloud(points)):
        assert len(sm.extract_primitives(given).labels) == 1000


@pytest.mark.parametrize("find", [sm.extract_primitives, sm.extract_pipes])
def test_what_is_done_is_told_to_the_end(find):
    said = []
    find(pipe(500), progress=lambda fraction, _: said.append(fraction))
    assert said == sorted(said)
    assert said[-1] == 1


def test_how_it_was_fitted_cannot_be_changed():
    plane = sm.fit_primitive(np.random.default_rng(0).uniform(size=(50, 3)) * [1, 1, 1e-3], "plane")
    for array in (plane.covariance, plane.extent):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
