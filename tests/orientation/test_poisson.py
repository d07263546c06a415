"""The indicator of points without normals: sheets hardly thicker than its cells have two sides."""

from __future__ import annotations

import numpy as np
import pytest

from simplexmesh.data.points import PointCloud
from simplexmesh.mesh.shapes import sphere
from simplexmesh.motion.start.from_points import start_from_points
from simplexmesh.numerics.plane_fits import planes
from simplexmesh.orientation.poisson import Fixpoint, Indicator, Poisson, oriented_indicator
from tests.nightly.marks import nightly

CELL = 0.0157


def test_the_border_is_the_outermost_samples():
    values = np.pad(np.zeros((1, 2, 3)), 1, constant_values=1)
    assert (Indicator(None, values).border == 1).all()


def planet(half, noise, seed):
    """Return noisy points of a ball of radius 0.4 in a flat ring of a thickness up to a radius of 1, and normals."""
    rng = np.random.default_rng(seed)
    turn, radius = 2 * np.pi * rng.random(24_000), np.sqrt(0.16 + 0.84 * rng.random(24_000))
    side = rng.choice([-1.0, 1.0], 24_000)
    flat = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), half * side])
    round_ = rng.normal(size=(9_000, 3))
    round_ /= np.linalg.norm(round_, axis=1)[:, None]
    seen = round_[np.abs(0.4 * round_[:, 2]) > half]
    points = np.concatenate([flat, 0.4 * seen])
    normals = np.concatenate([side[:, None] * [0, 0, 1], seen])
    return points + rng.normal(0, noise, points.shape), normals


@pytest.mark.parametrize("seed", [0, *nightly(1)])
@pytest.mark.parametrize(("half", "noise"), [*nightly((0.01, 0.0), (0.014, 0.002)), (0.02, 0.004)])
def test_thin_sheets_have_two_sides(half, noise, seed):
    points, normals = planet(half, noise, seed)
    inward = oriented_indicator(points, planes(points), CELL).at(points)[1]
    assert ((inward * normals).sum(axis=1) > 0).mean() < 0.02


@pytest.mark.parametrize("count", [5, *nightly(9)])
def test_fins_thinner_than_two_spacings_are_solid(count):
    """Fins, 1.2 thick; points are 0.67 apart. Of floods too coarse for gaps a third of the sides is wrong."""
    rng, left, deep, wide = np.random.default_rng(0), 5.0 * np.arange(count), 50.0, 5.0 * count - 3.8
    fins = [corner for x in left for corner in ((x, 4), (x, 22), (x + 1.2, 22), (x + 1.2, 4))]
    profile = np.array([(0, 0), *fins, (wide, 0)])
    step = np.roll(profile, -1, axis=0) - profile
    long = np.linalg.norm(step, axis=1)
    edge = rng.choice(len(long), 3_000 * count, p=long / long.sum())
    x, z = (profile[edge] + rng.random((len(edge), 1)) * step[edge]).T
    outward = np.column_stack([-step[:, 1], 0 * long, step[:, 0]])[edge] / long[edge, None]
    of_ends = int(2540 * wide / 41.2)
    ends = np.column_stack([wide * rng.random(of_ends), rng.choice([0, deep], of_ends), 22 * rng.random(of_ends)])
    ends = ends[(ends[:, 2] < 4) | (ends[:, 0] % 5 < 1.2)]
    points = np.concatenate([np.column_stack([x, deep * rng.random(len(x)), z]), ends])
    normals = np.concatenate([outward, np.sign(ends[:, 1:2] - deep / 2) * [0, 1, 0]])
    inward = oriented_indicator(points, planes(points), 0.53).at(points)[1]
    assert ((inward * normals).sum(axis=1) > 0).mean() < 0.1


@pytest.mark.parametrize("seed", [0, *nightly(1, 2)])
def test_tunnels_of_three_spacings_are_open(seed):
    """A block, 20 spacings thick, bored through at six places; with normals as floods tell them, two or three open."""
    wide, rng, size = 3.0, np.random.default_rng(seed), np.array([60.0, 40.0, 20.0])
    centers = np.array([(x, y) for x in (10, 30, 50) for y in (12, 28)])
    faces = [rng.random((int(size.prod() / size[k]), 3)) * size for k in range(3) for _ in range(2)]
    for k, face in enumerate(faces):
        face[:, k // 2] = size[k // 2] * (k % 2)
    box = np.concatenate(faces)
    inside = (np.linalg.norm(box[:, None, :2] - centers, axis=2) < wide / 2).any(axis=1)
    turn = 2 * np.pi * rng.random((6, int(np.pi * wide * size[2])))
    wall = centers[:, None] + wide / 2 * np.stack([np.cos(turn), np.sin(turn)], axis=2)
    bores = np.concatenate([wall, size[2] * rng.random((*turn.shape, 1))], axis=2).reshape(-1, 3)
    points = np.concatenate([box[~(inside & (box[:, 2] % size[2] == 0))], bores])
    depths = np.linspace(2, 18, 9)
    axes = np.concatenate([np.column_stack([np.tile(center, (9, 1)), depths]) for center in centers])
    values = oriented_indicator(points, planes(points), 0.8).at(axes)[0].reshape(6, 9)
    assert (values.max(axis=1) < 0).sum() >= 5


def cup(rng):
    turn, radius, angle = 2 * np.pi * rng.random(6000), np.sqrt(rng.random(1500)), 2 * np.pi * rng.random(1500)
    side = np.column_stack([np.cos(turn), np.sin(turn), 2 * rng.random(6000)])
    return np.concatenate([side, np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * radius])])


def tray(rng, size=(1.0, 1.0, 1.0)):
    sides = np.repeat(np.prod(size) / np.array(size), 2)[:5]
    side, points = rng.choice(5, 8000, p=sides / sides.sum()), rng.random((8000, 3))
    points[np.arange(8000), side // 2] = side % 2
    return points * size


@pytest.mark.parametrize("seed", [0, *nightly(1)])
@pytest.mark.parametrize("shape", [cup, tray, *nightly(lambda rng: tray(rng, (1.0, 1.0, 0.2)))])
def test_open_containers_are_full(shape, seed):
    """The flood enters them: the side of their walls is that of bodies that they would be with a lid."""
    points = shape(np.random.default_rng(seed))
    start = start_from_points(PointCloud(points), 1500)
    assert (start.mesh.genus, start.mesh.n_components) == (0, 1)
    assert start.mesh.volume > 0.75 * np.prod(np.ptp(points, axis=0)) * (np.pi / 4 if shape is cup else 1)


def test_the_indicator_is_most_alike_at_all_points_with_the_true_normals():
    ball = sphere(20)
    problem = Poisson.of(ball.vertices, 0.1)

    def spread(normals):
        found = Fixpoint(normals, problem.indicator(normals), settled=True)
        return found.spread(ball.vertices, problem.areas)

    cap = np.where(ball.vertices[:, 2:] > 0.5, -1, 1)
    assert spread(ball.normals * cap) > 10 * spread(ball.normals)


def turned(profile, count, rng):
    """Points at random of the surface that a closed profile (k, 2) of radii and heights makes about the z axis."""
    start, along = profile, np.roll(profile, -1, axis=0) - profile
    areas = np.hypot(*along.T) * (2 * start[:, 0] + along[:, 0])
    side = rng.choice(len(profile), count, p=areas / areas.sum())
    (r, z), (dr, dz), u = start[side].T, along[side].T, rng.uniform(size=count)
    grows = np.abs(dr) > 1e-12  # the share along a side at which its area is a share u of the whole
    share = np.where(grows, (np.sqrt(r**2 + u * dr * (2 * r + dr)) - r) / np.where(grows, dr, 1), u)
    angle = rng.uniform(0, 2 * np.pi, count)
    radius = r + share * dr
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z + share * dz])


def volume_of_revolution(profile):
    (r, z), (s, w) = profile.T, np.roll(profile, -1, axis=0).T
    return abs(np.pi / 3 * ((w - z) * (r * r + r * s + s * s)).sum())


PIPE = np.array([[1.0, 0], [1.0, 3], [0.8, 3], [0.8, 0]])
CUP = np.array([[0.0, 0], [1, 0], [1, 2], [0.9, 2], [0.9, 0.1], [0, 0.1]])
TUBE = np.array([[0.4, 0], [0.4, 1], [0.3, 1], [0.3, 0]])


@pytest.mark.nightly
def test_walls_of_two_distances_between_points_have_hardly_any_tunnels():
    """Normals of planes through neighbors on both sides would leave ten in some."""
    wall = 2 * np.sqrt(8 * np.pi / 12_000)
    cup = np.array([[0.0, 0], [1, 0], [1, 1.5], [1 - wall, 1.5], [1 - wall, wall], [0, wall]])
    genera = [
        start_from_points(PointCloud(turned(cup, 12_000, np.random.default_rng(seed))), 3000).mesh.genus
        for seed in range(4)
    ]
    assert sum(genera) <= 4


@pytest.mark.parametrize("noise", [*nightly(0.0), 0.002])
@pytest.mark.parametrize(("profile", "genus"), [(PIPE, 1), (CUP, 0), *nightly((TUBE, 1))])
def test_closed_walls_are_not_filled(profile, genus, noise):
    """Cups and pipes with walls of a few distances between points are bodies: their inside is outside."""
    rng = np.random.default_rng(3)
    points = turned(profile, 20_000, rng)
    points += noise * np.linalg.norm(np.ptp(points, axis=0)) * rng.normal(size=points.shape)
    mesh = start_from_points(PointCloud(points), 4000).mesh
    assert (mesh.genus, mesh.n_components) == (genus, 1)
    assert mesh.volume == pytest.approx(volume_of_revolution(profile), rel=0.1)
