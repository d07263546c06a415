"""How often bodies, and views of them as a camera has them, are found by `register`.

Run with `SIMPLEXMESH_DATA=... python tests/benchmarks/bench_register_bodies.py [motions] [what] [names]`, where what
is any of whole, views.
Each body is sampled anew with 40,000 points, both times, with noise of 0.5 % of the diagonal, and turned at random.
A view is what a pinhole camera sees from a random side, at 3 diagonals: one point a pixel, the nearest, of 220 x 220 as
wide as the body; views of 30 to 50 % of the surface, 0.2 % noise. "First" is the likeliest motion before any
refinement on the points. Tables are printed in Markdown.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from simplexmesh.recognition.register import register as registering
from tests.recognition import reference as reference

DATA = Path(os.environ.get("SIMPLEXMESH_DATA", "data"))
NAMES = ("spot", "lion_head", "elephant", "mannequin", "kitten")
COUNT, NOISE = 40_000, 0.005
PIXELS, AWAY, SEEN, VIEW_NOISE = 220, 3.0, (0.3, 0.5), 0.002


def body(name: str) -> sm.TriangleMesh:
    """Return a body as triangles; the kitten's points are reconstructed first, so that they can be sampled anew."""
    if name == "kitten":
        return sm.reconstruct(DATA / "kitten.xyz", vertices=10_000).mesh.triangulated()
    return sm.read_triangles(DATA / ("spot.obj" if name == "spot" else f"{name}.off"))


def moved(T: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return points (n, 3) after a motion (4, 4)."""
    return points @ T[:3, :3].T + T[:3, 3]


def noisy(points: np.ndarray, share: float, diagonal: float, rng: np.random.Generator) -> np.ndarray:
    """Return points with noise, in shares of the diagonal."""
    return points + share * diagonal * rng.normal(size=points.shape)


def seen(triangles: sm.TriangleMesh, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Return what a camera sees from a random side: the nearest point of each pixel, and the share of the area."""
    dense = triangles.sampled(800_000, rng=rng).points
    diagonal = np.linalg.norm(np.ptp(dense, axis=0))
    share = 0.0
    while not SEEN[0] <= share <= SEEN[1]:
        at = (dense - dense.mean(axis=0)) @ reference.random_rotation(rng).T / diagonal
        depth = AWAY - at[:, 2]
        picture = at[:, :2] * (AWAY / depth)[:, None]
        pixel = float(np.ptp(picture, axis=0).max()) / (PIXELS - 1)
        column, row = ((picture - picture.min(axis=0)) / pixel).astype(int).T
        place = column * PIXELS + row
        order = np.lexsort((depth, place))
        first = order[np.concatenate([[True], np.diff(place[order]) > 0])]
        nearest = np.full(PIXELS**2, np.inf)
        nearest[place[first]] = depth[first]
        share = float((depth < nearest[place] + 3 * pixel).mean())
    return dense[first], share


def case(triangles: sm.TriangleMesh, views: bool, rng: np.random.Generator):
    """Return source and target points, the motion between them, and the share of the body that the source shows."""
    diagonal = float(np.linalg.norm(np.ptp(triangles.vertices, axis=0)))
    noise = VIEW_NOISE if views else NOISE
    source, share = seen(triangles, rng) if views else (triangles.sampled(COUNT, rng=rng).points, 1.0)
    target = triangles.sampled(COUNT, rng=rng).points
    source, target = (noisy(points, noise, diagonal, rng) for points in (source, target))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = reference.random_rotation(rng), diagonal * rng.normal(size=3)
    return moved(np.linalg.inv(T), source), target, T, share


def found(source: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the first rotation before refinement and the one of `register`, None when it refuses."""
    firsts = []
    refined_candidates = registering.refined_candidates

    def listening(*arguments):
        firsts.append(refined_candidates(*arguments))
        return firsts[-1]

    registering.refined_candidates = listening
    try:
        last = sm.register(source, target).T_target_source[:3, :3]
    except ValueError:
        last = None
    finally:
        registering.refined_candidates = refined_candidates
    return firsts[0][0].reshape(3, 4)[:, :3], last


def bodies(motions: int, views: bool, names: tuple[str, ...]) -> None:
    """Print how far off rotations are, before refinement and after."""
    limit = 5 if views else 2
    print(
        f"\n| {'view' if views else 'body'} | motions | seen | first within {limit} | after, 0.2 | 5 | median "
        "| 95 % | largest | s |"
        "\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
    )
    for name in names:
        triangles, rng = body(name), np.random.default_rng(5)
        before, after, shares, spent = [], [], [], []
        for _ in range(motions):
            source, target, T, share = case(triangles, views, rng)
            start = time.perf_counter()
            first, last = found(source, target)
            spent.append(time.perf_counter() - start)
            before.append(reference.angle(first, T[:3, :3]))
            after.append(180.0 if last is None else reference.angle(last, T[:3, :3]))
            shares.append(share)
        b, a = np.array(before), np.array(after)
        print(
            f"| {name} | {motions} | {np.mean(shares):.0%} | {np.mean(b < limit):.0%} | {np.mean(a < 0.2):.0%} "
            f"| {np.mean(a < 5):.0%} | {np.median(a):.3f} | {np.quantile(a, 0.95):.3f} | {a.max():.3f} "
            f"| {np.median(spent):.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    words = sys.argv[1:]
    motions = int(words[0]) if words and words[0].isdigit() else 20
    wanted = [word for word in words if word in ("whole", "views")] or ["whole", "views"]
    names = tuple(word for word in words if word in NAMES) or NAMES
    sm.register(sm.sphere(8), sm.sphere(8))
    if "whole" in wanted:
        bodies(motions, False, names)
    if "views" in wanted:
        bodies(motions, True, names)
