"""What is found of parts and views, and of a million points, when nothing or only kinds are told: counts, CPU, memory.

Usage: SIMPLEXMESH_DATA=folder python tests/benchmarks/bench_primitive_parts.py [parts | views | million]

Parts of Fit4CAD with exact primitives: a shape is found as in `tests/cloud/scenes/scoring.py`. A part of ABC and a
view by a depth camera: the kinds, and the rms of the cylinders. A million: five plants of `bench_primitives.py` in one
cloud, 2 mm of noise, 10 % of outliers.
"""

from __future__ import annotations

import os
import resource
import sys
import time
import warnings
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.cloud.fitting.test_real_parts import part
from tests.cloud.scenes.plant import Scene, plant_scene
from tests.cloud.scenes.scoring import matched, score

PARTS = ("PC18", "PC42", "PC49")
FEW = 50  # points of shapes that are counted apart
APART = 40.0  # metres between plants


def parts(folder: Path) -> None:
    for name in PARTS:
        truth = part(folder, name)
        out = sm.extract_primitives(truth.points)
        pairs = matched(out.primitives, out.labels, truth)
        small = np.bincount(truth.labels) < FEW
        missed = np.delete(small, [true for _, true in pairs])
        print(
            f"{name}: {len(pairs)} of {len(truth.shapes)} found, {len(out) - len(pairs)} that are not there; of those "
            f"missed {missed.sum()} have fewer than {FEW} points",
            flush=True,
        )


def views(folder: Path) -> None:
    for file, kinds in (("abc_00949.xyzc", None), ("osd_learn37.pcd", ("plane", "cylinder"))):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sm.SimplexMeshWarning)  # pixels without a depth are left out
            out = sm.extract_primitives(sm.read_points(folder / file), **({"kinds": kinds} if kinds else {}))
        counts = Counter(each.kind for each in out.primitives)
        rms = [each.rms for each in out.primitives if each.kind == "cylinder"]
        print(f"{file}: {dict(counts)}, rms of cylinders {min(rms):.2g} to {max(rms):.2g}", flush=True)


def million() -> None:
    scenes = [plant_scene(seed, count=200_000) for seed in range(5)]
    shifts = APART * np.arange(5)[:, None] * [1.0, 0, 0]
    shapes = tuple(shape.moved(np.eye(3), by) for one, by in zip(scenes, shifts, strict=True) for shape in one.shapes)
    points = np.concatenate([one.points + by for one, by in zip(scenes, shifts, strict=True)])
    labels = np.concatenate([np.where(one.labels < 0, -1, one.labels + 10 * k) for k, one in enumerate(scenes)])
    sm.extract_primitives(scenes[0].points[:5000])  # compiles
    before, began = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    out = sm.extract_primitives(points)
    seconds = time.process_time() - began
    more = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1e6
    told = score(out.primitives, out.labels, Scene(points, labels, shapes, 0.002))
    print(f"a million points, {len(shapes)} shapes: recall {told.recall:.2f}, precision {told.precision:.2f}, "
          f"{seconds:.1f} CPU seconds, {more:.2f} GB more than before")  # fmt: skip


if __name__ == "__main__":
    wanted = sys.argv[1:] or ["parts", "views", "million"]
    if "parts" in wanted:
        parts(Path(os.environ["SIMPLEXMESH_DATA"]))
    if "views" in wanted:
        views(Path(os.environ["SIMPLEXMESH_DATA"]))
    if "million" in wanted:
        million()
