"""The surface behind points: exact or with little noise, and independent of earlier calls."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplexmesh.data.points import PointCloud
from simplexmesh.motion.targets.points import Points
from simplexmesh.motion.targets.surfels._kernels_fit import Cloud, fit, new_local
from simplexmesh.motion.targets.surfels.surfels import centers_and_radii, fitted_surfels
from simplexmesh.numerics.kd_tree import kd_tree
from tests.motion.targets import reference as naive
from tests.nightly.marks import nightly

TORUS = 1.0, 0.35
DIAGONAL = float(np.sqrt(2 * 2.7**2 + 0.7**2))


def torus_points(n, rng, R=1.0, r=0.35):
    u, v = rng.uniform(0, 2 * np.pi, (2, 3 * n))
    keep = rng.uniform(0, 1, 3 * n) < (R + r * np.cos(v)) / (R + r)
    u, v = u[keep][:n], v[keep][:n]
    ring = np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)
    normals = np.cos(v)[:, None] * ring + np.sin(v)[:, None] * [0, 0, 1]
    return R * ring + r * normals, normals


def torus_distance(points, R=1.0, r=0.35):
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - R, points[:, 2]) - r


def torus_grid(n=96, m=48, bump=0.02):
    """A wavy torus as an (n, m) grid of vertices, off the true one by up to `bump` diagonals."""
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(m) * 2 * np.pi / m, indexing="ij")
    r = TORUS[1] + bump * DIAGONAL * np.sin(3 * u + 1) * np.cos(2 * v)
    return np.stack([(1 + r * np.cos(v)) * np.cos(u), (1 + r * np.cos(v)) * np.sin(u), r * np.sin(v)], axis=-1)


def grid_normals(grid):
    n = np.cross(np.roll(grid, -1, 0) - np.roll(grid, 1, 0), np.roll(grid, -1, 1) - np.roll(grid, 1, 1))
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def drawn(target, grid, iterations=25):
    """Move the grid by the target alone."""
    for _ in range(iterations):
        normals = grid_normals(grid)
        gap = target.gap(grid.reshape(-1, 3), normals.reshape(-1, 3), 0.3).reshape(grid.shape[:2])
        grid = grid + 0.5 * np.nan_to_num(gap)[..., None] * normals
    return grid.reshape(-1, 3), grid_normals(grid).reshape(-1, 3)


@cache
def target_of(noise, seed=0):
    """What noisy points on a torus draw to."""
    return Points(noisy_torus(noise, seed))


def noisy_torus(noise, seed, n=20_000):
    rng = np.random.default_rng(seed)
    return torus_points(n, rng)[0] + rng.normal(0, noise * DIAGONAL, (n, 3))


def sphere_points(n, rng):
    p = rng.normal(size=(n, 3))
    return p / np.linalg.norm(p, axis=1)[:, None]


# ---- kernels against their twins


@given(seed=st.integers(0, 10_000))
def test_fit_is_weighted_least_squares(seed):
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    points = rng.uniform(-1, 1, (60, 3))
    points -= 0.85 * (points @ normal)[:, None] * normal
    x, u, v = naive.plane_fit(points, np.zeros(3), normal, 1.2)
    surfel, local, none = np.zeros(12), new_local(), np.zeros((0, 3))
    surfel[3:6] = normal
    local.members[:60] = np.arange(60)
    report = fit(Cloud(*kd_tree(points)[:4], none, none), local, 60, 1.2, 1e9, surfel)
    expected = normal - x[1] * u - x[2] * v
    np.testing.assert_allclose(surfel[:3], 1.2 * x[0] * normal, atol=1e-9)
    np.testing.assert_allclose(surfel[3:6], expected / np.linalg.norm(expected), atol=1e-9)
    bend = np.sqrt(x[3] ** 2 + 2 * x[4] ** 2 + x[5] ** 2) / 1.2 / np.linalg.norm(expected)
    np.testing.assert_allclose(report.curvature, bend, rtol=1e-9)


def test_gap_ends_where_the_blended_height_is_zero():
    target = Points(torus_points(3000, np.random.default_rng(4))[0])
    s = target._surfels
    rng = np.random.default_rng(5)
    places, directions = torus_points(200, rng)
    places = places + 0.02 * rng.normal(size=(200, 1)) * directions
    gap = target.gap(places, directions, 0.3)
    ends = places + gap[:, None] * directions - target.center
    for end, direction in zip(ends, directions, strict=True):
        away = np.sort(np.linalg.norm(s.table[:, :3] - end, axis=1))
        if away[1] > 1.02 * away[0]:  # which one counts as nearest may differ by the last step
            at = naive.nearest_facing(s.table, end, direction, False, 1.0)
            assert abs(naive.blended_height(s.table, s.heads[:, 6], s.neighbors, at, end, False)[0]) < 2e-5


# ---- points in order


def ring_of(u, v, R=1.0, r=0.45):
    out = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1).reshape(-1, 3)
    return r * out + R * np.stack([np.cos(u), np.sin(u), 0 * u], axis=-1).reshape(-1, 3), out


def tube_of(u, z):
    out = np.stack([np.cos(u), np.sin(u), 0 * u], axis=-1).reshape(-1, 3)
    return out + np.stack([0 * z, 0 * z, z], axis=-1).reshape(-1, 3), out


def ball_of(theta, u):
    out = np.stack([np.sin(theta) * np.cos(u), np.sin(theta) * np.sin(u), np.cos(theta)], axis=-1).reshape(-1, 3)
    return out, out


TURN = 2 * np.pi
GOLDEN = np.arange(4000) * (np.sqrt(5) - 1) / 2
LATTICES = {
    "golden angles on a torus": (ring_of, np.arange(4000) * TURN / 4000, GOLDEN * TURN),
    "golden angles on a sphere": (ball_of, np.arccos(1 - (2 * np.arange(4000) + 1) / 4000), GOLDEN * TURN),
    "grid on a torus": (ring_of, *np.meshgrid(np.arange(110) * TURN / 110, np.arange(48) * TURN / 48)),
    "rows on a torus": (ring_of, *np.meshgrid(np.arange(33) * TURN / 33, np.arange(151) * TURN / 151)),
    "rows on a tube": (tube_of, *np.meshgrid(np.arange(322) * TURN / 322, np.linspace(-1.5, 1.5, 15))),
    "few rows on a tube": (tube_of, *np.meshgrid(np.arange(454) * TURN / 454, np.linspace(-1.5, 1.5, 11))),
    "columns on a tube": (tube_of, *np.meshgrid(np.arange(32) * TURN / 32, np.linspace(-1.5, 1.5, 156))),
    "meridians and parallels": (ball_of, *np.meshgrid((np.arange(45) + 0.5) * np.pi / 45, np.arange(90) * TURN / 90)),
}


@pytest.mark.parametrize("noise", [*nightly(0.0), 0.002])
@pytest.mark.parametrize("lattice", LATTICES)
def test_points_in_order_are_as_good_as_points_without(lattice, noise):
    """Within 0.2 % of the diagonal, 0.1 % nearly everywhere; rows lie up to 20 times as far apart as their points."""
    shape, *at = LATTICES[lattice]
    points, _ = shape(*at)
    rng = np.random.default_rng(0)
    diagonal = np.linalg.norm(np.ptp(points, axis=0))
    target = Points(points + noise * diagonal * rng.normal(size=points.shape))
    u, v = rng.uniform(0, TURN, (2, 3000))
    if shape is tube_of:
        v = rng.uniform(-1.2, 1.2, 3000)
    elif shape is ball_of:
        u = np.arccos(rng.uniform(-1, 1, 3000))
    places, normals = shape(u, v)
    for away in (0.0, 0.02 * diagonal):
        off = np.abs(target.gap(places - away * normals, normals, 0.3) - away) / diagonal
        assert off.max() < 0.002 + noise  # fails for NaN too
        assert np.quantile(off, 0.95) < 0.001 + 0.25 * noise


# ---- exact where it can be


@given(seed=st.integers(0, 10_000), shift=st.floats(-1e6, 1e6), scale=st.floats(1e-3, 1e3))
def test_plane_is_exact(seed, shift, scale):
    rng = np.random.default_rng(seed)
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = scale * (np.column_stack([rng.uniform(-1, 1, (400, 2)), np.zeros(400)]) @ frame.T) + shift
    inside = np.column_stack([rng.uniform(-0.5, 0.5, (50, 2)), rng.uniform(-0.3, 0.3, 50)])
    normals = np.repeat(frame[:, 2][None], 50, axis=0)
    gap = Points(points).gap(scale * (inside @ frame.T) + shift, normals, 2 * scale)
    np.testing.assert_allclose(gap, -scale * inside[:, 2], atol=1e-6 * scale + 1e-9 * abs(shift))


def test_sphere_error_falls_with_the_fourth_power_of_the_spacing():
    errors, gaps = [], []
    for n in (500, 2000, 8000):
        rng = np.random.default_rng(n)
        target = Points(sphere_points(n, rng))
        errors.append(np.median(np.abs(np.linalg.norm(target.samples()[0], axis=1) - 1)))
        out = sphere_points(500, rng)
        gaps.append(np.abs(target.gap(0.97 * out, out, 0.5) - 0.03).mean())
    assert errors[0] / errors[1] > 10
    assert errors[1] / errors[2] > 10
    assert gaps[2] < 1e-5


def test_survey_coordinates_keep_precision():
    points = noisy_torus(0.002, 3, n=4000)
    places, normals = torus_points(300, np.random.default_rng(8))
    far = np.array([4.5e5, 5.4e6, 100.0])
    here = Points(points).gap(places, normals, 0.3)
    there = Points(points + far).gap(places + far, normals, 0.3)
    np.testing.assert_allclose(there, here, atol=2e-3)
    assert np.abs(there - here).mean() < 1e-5


@pytest.mark.parametrize("scale", [1e-6, 1e5])
def test_scale_only_scales(scale):
    points = noisy_torus(0.002, 3, n=4000)
    places, normals = torus_points(300, np.random.default_rng(8))
    here = Points(points).gap(places, normals, 0.3)
    there = Points(scale * points).gap(scale * places, normals, 0.3 * scale)
    np.testing.assert_allclose(there / scale, here, atol=1e-4)


def test_turning_the_cloud_turns_the_surface():
    # the selection of surfels follows a grid: answers agree within a part of the noise, not to the digit
    points = noisy_torus(0.002, 3)
    places, normals = torus_points(500, np.random.default_rng(8))
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    here = Points(points).gap(places, normals, 0.3)
    there = Points(points @ turn.T).gap(places @ turn.T, normals @ turn.T, 0.3)
    assert np.abs(there - here).mean() < 0.1 * 0.002 * DIAGONAL


# ---- quiet where the points are not


@pytest.mark.parametrize(("noise", "bar"), [(0.0, 0.001), (0.002, 0.025), (0.01, 0.10)])
@pytest.mark.parametrize("seed", [0, *nightly(1)])
def test_noise_of_unknown_size_is_averaged_out(noise, bar, seed):
    """Mean distance to the true torus, in % of the diagonal: 0.04 and 0.14 are asked of the whole reconstruction."""
    vertices, normals = drawn(target_of(noise, seed), torus_grid())
    assert np.abs(torus_distance(vertices)).mean() < bar / 100 * DIAGONAL
    ring = np.column_stack(
        [vertices[:, :2] / np.hypot(vertices[:, 0], vertices[:, 1])[:, None], np.zeros(len(vertices))]
    )
    true = (vertices - ring) / np.linalg.norm(vertices - ring, axis=1)[:, None]
    angle = np.degrees(np.arccos(np.clip((normals * true).sum(axis=1), -1, 1)))
    assert angle.mean() < 3.5


def test_noise_is_measured():
    assert target_of(0.01).noise == pytest.approx(0.01 * DIAGONAL, rel=0.15)
    assert target_of(0.0).noise < 1e-4 * DIAGONAL


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_noise_hides_details_whatever_the_unit(scale):
    places, _ = torus_points(500, np.random.default_rng(7))
    clean, noisy = (target_of(noise).resolution(places) for noise in (0.0, 0.01))
    assert clean.min() > 0
    assert (noisy > 1.5 * clean).all()
    np.testing.assert_allclose(Points(scale * noisy_torus(0.01, 0)).resolution(scale * places), scale * noisy, 1e-6)


def test_outliers_hardly_matter():
    points = noisy_torus(0.002, 0)
    places, normals = torus_points(2000, np.random.default_rng(7))
    stray = np.random.default_rng(8).uniform(points.min(axis=0), points.max(axis=0), (1000, 3))
    clean = target_of(0.002).gap(places, normals, 0.3)
    spoiled = Points(np.concatenate([points, stray])).gap(places, normals, 0.3)
    assert np.abs(spoiled).mean() < 1.2 * np.abs(clean).mean()


# ---- which surface counts


def test_nothing_within_reach_is_nan():
    points, normals = torus_points(2000, np.random.default_rng(1))
    target = Points(points)
    gap = target.gap(points[:100] + 0.2 * normals[:100], normals[:100], 0.1)
    assert np.isnan(gap).all()
    assert np.isfinite(target.gap(points[:100] + 0.05 * normals[:100], normals[:100], 0.1)).all()
    assert np.isnan(target.gap(points[:5], np.zeros((5, 3)), 1.0)).all()


def test_polarity_counts_where_it_is_known():
    points, normals = torus_points(2000, np.random.default_rng(1))
    known, unknown = Points(PointCloud(points, normals)), Points(points)
    places = points[:200] - 0.01 * normals[:200]
    assert np.isfinite(known.gap(places, normals[:200], 0.1)).all()
    assert np.isnan(known.gap(places, -normals[:200], 0.1)).all()
    np.testing.assert_allclose(unknown.gap(places, -normals[:200], 0.1), -0.01, atol=2e-3)


def test_walls_of_a_thin_sheet_are_kept_apart():
    rng = np.random.default_rng(2)
    flat = rng.uniform(-1, 1, (4000, 2))
    top = np.repeat([[0, 0, 1.0]], 2000, axis=0)
    z = np.where(np.arange(4000) < 2000, 0.01, -0.01)
    target = Points(PointCloud(np.column_stack([flat, z]), np.concatenate([top, -top])))
    inside = np.column_stack([rng.uniform(-0.5, 0.5, (50, 2)), np.zeros(50)])
    np.testing.assert_allclose(target.gap(inside, top[:50], 0.1), 0.01, atol=1e-6)
    np.testing.assert_allclose(target.gap(inside, -top[:50], 0.1), 0.01, atol=1e-6)


def test_over_a_hole_there_is_no_data():
    rng = np.random.default_rng(4)
    flat = rng.uniform(-1, 1, (6000, 2))
    flat = flat[np.hypot(*flat.T) > 0.5]
    up = np.array([[0, 0, 1.0]])
    target = Points(np.column_stack([flat, 0 * flat[:, 0]]))
    assert np.isnan(target.gap(np.array([[0, 0, -0.05]]), up, 1.0)).all()
    np.testing.assert_allclose(target.gap(np.array([[0.75, 0, -0.05]]), up, 1.0), 0.05, atol=1e-6)


# ---- clouds that are hardly clouds


@pytest.mark.parametrize(
    "points",
    [
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
        np.zeros((6, 3)),
        np.linspace(0, 1, 50)[:, None] * [1, 2, 3],
        np.repeat(np.eye(3), 3, axis=0),
    ],
    ids=["four", "one place", "line", "copies"],
)
def test_few_or_flat_points_draw_like_points(points):
    target = Points(np.asarray(points, dtype=float))
    place = np.array([[0.1, 0.1, -0.3]])
    gap = target.gap(place, np.array([[0, 0, 1.0]]), 2.0)
    closest = np.asarray(points)[np.argmin(np.linalg.norm(np.asarray(points) - place, axis=1))]
    assert gap[0] == pytest.approx(closest[2] + 0.3, abs=1e-9)


def test_duplicate_points_change_nothing():
    points = noisy_torus(0.002, 5, n=3000)
    places, normals = torus_points(300, np.random.default_rng(8))
    once = Points(points).gap(places, normals, 0.3)
    thrice = Points(np.concatenate([points, points, points])).gap(places, normals, 0.3)
    np.testing.assert_allclose(thrice, once, atol=1e-6)


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_most_fits_are_kept_however_thick_the_layer_of_points(noise):
    rng = np.random.default_rng(0)
    points = torus_points(20_000, rng)[0]
    points = points + noise * rng.normal(size=points.shape)
    tree, none = kd_tree(points), np.zeros((0, 3))
    fits = len(centers_and_radii(Cloud(*tree[:4], none, none))[0])
    assert len(fitted_surfels(points).points) > 0.65 * fits
