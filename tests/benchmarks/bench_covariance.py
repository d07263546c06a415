"""How far covariances of extracted primitives hold: squared errors in those stated, over shapes seen alone.

Usage: python tests/benchmarks/bench_covariance.py [points] [scenes]

Spheres, cylinders and cones of 200 degrees, planes, and bends with radii of 1.25 to 10 tubes that turn by 20 to 100
degrees, with 2 mm of noise. Of a normal law, the mean squared error of one parameter is the variance stated: 1.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.cloud.scenes.shapes import ball, bend, cone, pipe, plane, sampled

P = sm.primitives
NOISE, ARC, STEP = 0.002, np.radians(200), 1e-6


def shapes(rng):
    """Shapes as they are seen, each with its primitive."""
    turn, ratio = np.radians(rng.uniform(20, 100)), np.exp(rng.uniform(np.log(1.25), np.log(10)))
    elbow = bend(np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), 0.1 * ratio, 0.1, turn)[0]
    side = rng.uniform(0, 2 * np.pi)
    flat, round_ = plane((0, 0, 0), (1, 0, 0), (0, 0.6, 0)), ball((0, 0, 0), 0.3)
    tube, taper = pipe((0, 0, 0), (0, 0, 0.5), 0.1), cone((0, 0, 0), (0, 0, 1), 0.4, (0.2, 0.8))
    yield flat, P.Plane(flat.origin, flat.axis)
    yield replace(round_, extent=np.array([(0, ARC), (-0.6, 1)])), P.Sphere(round_.origin, round_.radius)
    yield replace(tube, extent=np.array([(0, ARC), (0, 0.5)])), P.Cylinder(tube.origin, tube.axis, tube.radius)
    yield replace(taper, extent=np.array([(0, ARC), (0.2, 0.8)])), P.Cone(taper.origin, taper.axis, taper.half_angle)
    seen = np.array([(0, turn), (side, side + ARC)])
    yield replace(elbow, extent=seen), P.Torus(elbow.origin, elbow.axis, elbow.radius, elbow.tube_radius)


def squared_error(found, true, points):
    """The mean squared error of parameters in that stated, by the step that leads to the true ones."""
    on = true.projected(points)
    ways = STEP * np.eye(found.n_parameters)
    slopes = [(found.stepped(way).distance(on) - found.stepped(-way).distance(on)) / (2 * STEP) for way in ways]
    step = np.linalg.lstsq(np.stack(slopes, axis=1), -found.distance(on), rcond=1e-12)[0]
    return step @ np.linalg.solve(found.covariance, step) / len(step)


def main() -> None:
    count, scenes = (int(x) for x in [*sys.argv[1:], *("4000", "40")[len(sys.argv) - 1 :]])
    errors: dict[str, list[float]] = {}
    for seed in range(scenes):
        rng = np.random.default_rng(9000 + seed)
        for shape, true in shapes(rng):
            points, normals, _ = sampled([shape], count, rng)
            found = sm.extract_primitives(points + rng.normal(0, NOISE, (count, 1)) * normals).primitives
            of_kind = errors.setdefault(true.kind, [])
            if [each.kind for each in found] == [true.kind]:
                of_kind.append(squared_error(found[0], true, points))
    for kind, values in errors.items():
        told = f"mean squared error {np.mean(values):.2f} times that stated, at most {np.max(values):.1f}"
        print(f"{kind}: {len(values)} of {scenes} of {count} points; {told}", flush=True)


if __name__ == "__main__":
    main()
