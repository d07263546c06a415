"""Plants of ten shapes at random: floor, wall, a line of three pipes and two bends, a thin pipe, a sphere, a cone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tests.cloud.scenes import scanner
from tests.cloud.scenes.clearance import apart, filled
from tests.cloud.scenes.shapes import Shape, ball, bend, cone, perpendicular, pipe, plane, sampled

CLEARANCE = 0.02
"""Between shapes that do not join, in metres."""

LINE = [2, 3, 4, 6, 7]
"""Numbers of the pipes and bends of the line."""

TRIES = 300
"""Arrangements of one part before the room is given up for another."""


@dataclass(frozen=True, eq=False)
class Scene:
    """Points (n, 3), the number of the shape that each is of, -1 for outliers, and the shapes.

    `noise` is the deviation along the normals, of scanned ones along the rays. Scanned ones have `stations` (k, 3),
    from which the points of a `station` (n,), -1 for outliers, were taken, and their `offsets` (k, 3).
    """

    points: np.ndarray
    labels: np.ndarray
    shapes: tuple[Shape, ...]
    noise: float
    stations: np.ndarray | None = None
    station: np.ndarray | None = None
    offsets: np.ndarray | None = None


def plant_scene(seed, noise=0.002, outliers=0.1, count=72_000):
    """A plant sampled evenly, with normal noise in metres and a share of outliers even in the bounding box.

    Noise may be a least and a greatest one: then each shape has its own, the line of pipes one, and the scene's is that
    of the median shape.
    """
    rng = np.random.default_rng(seed)
    shapes, _ = arrangement(rng)
    rogue = round(outliers * count)
    points, normals, labels = sampled(shapes, count - rogue, rng)
    own = np.full(len(shapes), noise) if np.isscalar(noise) else np.exp(rng.uniform(*np.log(noise), len(shapes)))
    own[LINE] = own[LINE[0]]
    points = points + (rng.normal(size=len(points)) * own[labels])[:, None] * normals
    strays = rng.uniform(points.min(axis=0), points.max(axis=0), (rogue, 3))
    order = rng.permutation(count)
    return Scene(
        np.concatenate([points, strays])[order],
        np.append(labels, np.full(rogue, -1))[order],
        tuple(shapes),
        float(np.median(own)),
    )


def scanned_plant(seed, noise=0.002, outliers=0.1, count=72_000, offset=0.003, stations=4):
    """A plant as scanned from stations, each of whose clouds is shifted by an offset but the first's.

    Density falls with the square of the range and with slant; shapes cast shadows; at the edges of depth points lie
    between what is before and behind, and count as outliers beside the given share.
    """
    rng = np.random.default_rng(seed)
    shapes, places = arrangement(rng, stations)
    rogue = round(outliers * count)
    scan = scanner.scanned(shapes, places, count - rogue, rng, noise=noise, offset=offset)
    strays = rng.uniform(scan.points.min(axis=0), scan.points.max(axis=0), (rogue, 3))
    order, none = rng.permutation(count), np.full(rogue, -1)
    return Scene(
        np.concatenate([scan.points, strays])[order],
        np.append(scan.labels, none)[order],
        tuple(shapes),
        noise,
        places,
        np.append(scan.station, none)[order],
        scan.offsets,
    )


def arrangement(rng, stations=1):
    """Ten shapes that do not meet but where pipes bend, in a random pose, and places (k, 3) to scan them from."""
    while (shapes := furnished(room := rng.uniform([2, 1.2, 1.5], [3.2, 2, 2.4]), rng)) is None:
        pass
    places = rng.uniform([-0.2, 1, 0.4], [1.2, 2, 0.9], (stations, 3)) * room
    places[:, 1] += 0.3
    rotation, shift = Rotation.random(random_state=rng).as_matrix(), rng.uniform(-10, 10, 3)
    return [shape.moved(rotation, shift) for shape in shapes], places @ rotation.T + shift


def furnished(room, rng):
    """The shapes of a room whose floor is z = 0 and wall y = 0; None if what was placed first leaves no way."""
    x, y, z = room * np.eye(3)
    shapes = [plane((0, 0, 0), x, y), plane((0, 0, 0), z, x)]
    for part in (pipes, thin_pipe, sphere, frustum):
        placed = part(rng)
        for _ in range(TRIES):
            more = placed(rng.uniform([0, 0, 0], room), perpendicular(np.zeros(3), rng))
            if fits(more, room) and all(apart(a, b, CLEARANCE) for a in more for b in shapes[2:]):
                shapes += more
                break
        else:
            return None
    return [shapes[k] for k in (0, 1, 2, 3, 4, 7, 5, 6, 8, 9)]


def pipes(rng):
    """Three pipes, then the two bends that join them, of one radius: from a point and a direction."""
    radius = 0.045 * (0.15 / 0.045) ** rng.uniform()
    lengths, ratios, turns = rng.uniform(0.3, 1.2, 3), rng.uniform(2, 5, 2), np.radians(rng.uniform(30, 120, 2))

    def placed(at, along):
        straight, curved = [], []
        for k in range(3):
            end = at + lengths[k] * along
            straight.append(pipe(at, end, radius))
            if k < 2:
                axis = perpendicular(along, rng)
                piece, at, along = bend(end, along, axis, radius * ratios[k], radius, turns[k], (2 + k, 3 + k))
                curved.append(piece)
        parts = [*straight, *curved]
        return parts if all(apart(parts[a], parts[b], CLEARANCE) for a, b in [(0, 2), (0, 4), (2, 3), (3, 4)]) else []

    return placed


def thin_pipe(rng):
    length, radius = rng.uniform(0.6, 1.8), rng.uniform(0.03, 0.04)
    return lambda at, along: [pipe(at, at + length * along, radius)]


def sphere(rng):
    radius = rng.uniform(0.12, 0.35)
    return lambda at, along: [ball(at, radius)]


def frustum(rng):
    """A cone whose wide end has a radius of 15 to 35 cm, and which is cut off at up to half its height."""
    half_angle, wide, cut = np.radians(rng.uniform(12, 35)), rng.uniform(0.15, 0.35), rng.uniform(0, 0.5)
    height = wide / np.tan(half_angle)
    return lambda at, along: [cone(at, along, half_angle, (cut * height, height))]


def fits(shapes, room):
    """Whether shapes, if there are any, are within a room."""
    if not shapes:
        return False
    centers, radii = (np.concatenate(each) for each in zip(*(filled(shape) for shape in shapes), strict=True))
    low, high = centers - radii[:, None], centers + radii[:, None]
    return bool((low > CLEARANCE).all() and (high < room).all())
