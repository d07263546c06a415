"""What comparing signatures costs, in ratios to the same sums in NumPy run in the same process, and what they find.

Run with `python tests/benchmarks/bench_match.py`; a quarter of an hour. Tables are printed in Markdown. Bodies and
views by one camera are those of `bench_register_bodies.py`.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from simplexmesh.recognition.sai.match import rotation_differences
from simplexmesh.recognition.sai.partial_signatures import Signature
from simplexmesh.recognition.sai.rotations import rotations
from simplexmesh.recognition.sai.sphere_domain import sphere_domain
from tests.benchmarks.bench_register_bodies import body, case
from tests.recognition import reference as reference


def best(function: Callable[[], object], least: int = 5) -> float:
    """Return the least time of one call in seconds, after a warm-up."""
    function()
    times = []
    for _ in range(least):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def searches() -> None:
    """Time the comparison under all rotations of a table against its NumPy twin."""
    print(
        "| frequency | vertices | rotations | build, s | search, ms | hidden parts, ms | NumPy, ms | ratio |"
        "\n|--:|--:|--:|--:|--:|--:|--:|--:|"
    )
    rng = np.random.default_rng(0)
    for frequency in (5, 9, 12):
        n = 20 * frequency**2
        values = rng.normal(size=(2, n))
        seen = rng.random((2, n)) < 0.7
        start = time.perf_counter()
        table = rotations(frequency)
        building = time.perf_counter() - start
        whole = [Signature(each, np.ones(n, bool), sphere_domain(frequency).vertices) for each in values]
        part = [
            Signature(each, some, sphere_domain(frequency).vertices) for each, some in zip(values, seen, strict=True)
        ]
        search = best(lambda: rotation_differences(*whole, table))  # noqa: B023
        hidden = best(lambda: rotation_differences(*part, table))  # noqa: B023
        rows = reference.all_images(table)
        plain = best(lambda: ((values[0][rows] - values[1]) ** 2).sum(axis=1), 2)  # noqa: B023
        print(
            f"| {frequency} | {n:,} | {len(table):,} | {building:.2f} | {1e3 * search:.2f} "
            f"| {1e3 * hidden:.2f} | {1e3 * plain:.0f} | {plain / search:.0f} |"
        )


def whole_steps() -> None:
    """Time a fit and a whole match."""
    cloud = reference.lumpy(20).triangulated().sampled(40_000, rng=0).points
    print("\n| frequency | fit of 40,000 points, s (processor) | match, ms |\n|--:|--:|--:|")
    for frequency in (5, 9, 12):
        one = sm.sai(cloud, frequency)
        start, used = time.perf_counter(), time.process_time()
        other = sm.sai(cloud @ np.diag([-1.0, -1, 1]), frequency)
        spent, used = time.perf_counter() - start, time.process_time() - used
        print(f"| {frequency} | {spent:.2f} ({used:.2f}) | {1e3 * best(lambda: sm.match(other, one)):.0f} |")  # noqa: B023


def bodies(runs: int = 10) -> None:
    """Match signatures of bodies, and of views of them, turned at random, in degrees from the truth."""
    for views in (False, True):
        print(f"\n| {'view' if views else 'body'} | runs | median | 95 % | largest | first within 5 | one of 20 in 8 |")
        for name in ("spot", "lion_head", "mannequin", "elephant", "kitten"):
            triangles, rng, first, least = body(name), np.random.default_rng(0), [], []
            for _ in range(runs):
                source, target, T, _ = case(triangles, views, rng)
                found = sm.match(sm.sai(source), sm.sai(target), best=20 if views else 1)
                angles = [reference.angle(each.T_target_source[:3, :3], T[:3, :3]) for each in found]
                first, least = [*first, angles[0]], [*least, min(angles)]
            middle, most = np.quantile(first, [0.5, 0.95])
            shares = f"{np.mean(np.array(first) < 5):.0%} | {np.mean(np.array(least) < 8):.0%}"
            print(f"| {name} | {runs} | {middle:.2f} | {most:.2f} | {max(first):.2f} | {shares} |", flush=True)


PATCHES = {"kitten.xyz": "torus", "knot1.off": "torus", "fran_face.vtk": "plane", "part_scan.ply": "plane"}


def other_topologies(runs: int = 10, noise: float = 0.001) -> None:
    """Find objects of other topologies turned at random, with noise in shares of the diagonal."""
    folder = os.environ.get("SIMPLEXMESH_DATA")
    if folder is None:
        return
    print(
        "\n| object | topology | found | median | largest | next distance | sai, s | match, ms |"
        "\n|---|---|--:|--:|--:|--:|--:|--:|"
    )
    for name, topology in PATCHES.items():
        data = sm.read(Path(folder) / name)
        data = data.welded(report=False) if isinstance(data, sm.TriangleMesh) else data.points
        one, rng = sm.sai(data, topology=topology), np.random.default_rng(0)
        angles, ratios, fits, matches = [], [], [], []
        for _ in range(runs):
            R = reference.random_rotation(rng)
            if isinstance(data, sm.TriangleMesh):
                off = noise * data.diagonal * rng.normal(size=data.vertices.shape)
                other = sm.TriangleMesh((data.vertices + off) @ R.T, data.faces)
            else:
                some = data[rng.permutation(len(data))[: int(0.9 * len(data))]]
                other = (some + noise * np.linalg.norm(np.ptp(some, axis=0)) * rng.normal(size=some.shape)) @ R.T
            start = time.perf_counter()
            two = sm.sai(other, topology=topology)
            middle = time.perf_counter()
            found = sm.match(one, two)
            matches.append(time.perf_counter() - middle)
            fits.append(middle - start)
            away = [
                reference.angle(each.T_target_source[:3, :3], R) for each in found[: 3 if name == "knot1.off" else 1]
            ]
            angles.append(min(away))  # the knot has a threefold axis
            ratios.append(found[len(away)].distance / found[0].distance)
        print(
            f"| {name} | {topology} | {np.mean(np.array(angles) < 5):.0%} | {np.median(angles):.2f} "
            f"| {max(angles):.2f} | {np.median(ratios):.1f} times | {min(fits):.2f} | {1e3 * min(matches):.0f} |"
        )


if __name__ == "__main__":
    searches()
    whole_steps()
    other_topologies()
    if "SIMPLEXMESH_DATA" in os.environ:
        bodies()
