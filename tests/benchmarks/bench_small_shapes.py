"""Small spheres, cylinders and cones in a large cloud: which are found, by their points, and CPU seconds.

Usage: python tests/benchmarks/bench_small_shapes.py [points] [first seed] [scenes]

Over a floor of 80 and a wall of 40 square metres, 2 mm of noise, 5 % of strays. First all of the cloud is looked at,
then what that leaves over, as small shapes have few points among the 100,000 in which shapes are looked for.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.cloud.scenes.shapes import ball, cone, perpendicular, pipe, plane, sampled

SIZES = (150, 300, 600, 1200, 2500, 5000, 10_000)
EACH = 2
NOISE, STRAYS, FEWEST = 0.002, 0.05, 100
PLACES = [np.array([x, y, 2.0]) for x in np.arange(0.7, 9.6, 1.15) for y in np.arange(1, 7.6, 1.2)]


def small(kind, area, place, rng):
    """A shape of an area about a place."""
    if kind == "sphere":
        return ball(place, np.sqrt(area / 4 / np.pi))
    if kind == "cylinder":
        radius, along = np.sqrt(area / 10 / np.pi), perpendicular(np.zeros(3), rng)
        return pipe(place - 2.5 * radius * along, place + 2.5 * radius * along, radius)
    half_angle = np.radians(25)
    height = np.sqrt(area / np.pi / 0.75 / np.tan(half_angle) * np.cos(half_angle))
    return cone(place, (0, 0, 1), half_angle, (height / 2, height))


def scene(count, seed):
    """Points, labels, shapes, and the size of each."""
    rng = np.random.default_rng(seed)
    shapes = [plane((0, 0, 0), (10, 0, 0), (0, 8, 0)), plane((0, 0, 0), (10, 0, 0), (0, 0, 4))]
    sizes = [0, 0, *(size for size in SIZES for _ in range(3 * EACH))]
    places = rng.permutation(PLACES)
    for size, place, kind in zip(sizes[2:], places, ("sphere", "cylinder", "cone") * len(sizes), strict=False):
        shapes.append(small(kind, 120 * size / (0.9 * count), place, rng))
    points, normals, labels = sampled(shapes, round((1 - STRAYS) * count), rng)
    points = points + rng.normal(0, NOISE, (len(points), 1)) * normals
    strays = rng.uniform(points.min(axis=0), points.max(axis=0), (count - len(points), 3))
    order = rng.permutation(count)
    return np.concatenate([points, strays])[order], np.append(labels, np.full(len(strays), -1))[order], shapes, sizes


def scored(found, labels, shapes):
    """Numbers of the shapes that are found, and how many are found that are none."""
    true, none = set(), 0
    for k, each in enumerate(found.primitives):
        own = found.labels == k
        counts = np.bincount(labels[own] + 1, minlength=len(shapes) + 1)[1:]
        best = int(counts.argmax())
        if each.kind == shapes[best].kind and 2 * counts[best] > (own | (labels == best)).sum():
            true.add(best)
        else:
            none += 1
    return true, none


def told(name, true, none, sizes, began):
    """Print what is found."""
    counts = Counter(sizes[k] for k in true)
    found = ", ".join(f"{counts[size]} of {3 * EACH} of {size}" for size in SIZES)
    print(f"{name}: {found} points; {none} that are none; CPU {time.process_time() - began:.1f} s", flush=True)


def main() -> None:
    count, first, scenes = (int(x) for x in [*sys.argv[1:], *("1000000", "0", "1")[len(sys.argv) - 1 :]])
    sm.extract_primitives(scene(30_000, 0)[0])  # compiles
    for seed in range(first, first + scenes):
        points, labels, shapes, sizes = scene(count, seed)
        began = time.process_time()
        whole = sm.extract_primitives(points)
        true, none = scored(whole, labels, shapes)
        told(f"seed {seed}, all", true, none, sizes, began)
        rest, began = whole.leftovers, time.process_time()
        again = sm.extract_primitives(points[rest], noise=whole.noise, fewest=FEWEST)
        more, none = scored(again, labels[rest], shapes)
        told(f"seed {seed}, left over", more, none, sizes, began)


if __name__ == "__main__":
    main()
