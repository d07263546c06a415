"""Whole reconstructions, warm and in a fresh process, on the data folder named by SIMPLEXMESH_DATA.

Run: SIMPLEXMESH_DATA=... python tests/benchmarks/bench_reconstruct.py [words of jobs] [--store]
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.benchmarks.figures import Figures

PROTOCOL = """Whole calls, reading included, after a first one: seconds of processor time, of all threads, and of the
clock, three repeats; rms distances in % of the diagonal."""
SCANS = ("000", "045", "090", "180", "270", "315")


def jobs(folder):
    """Return name, data and options of each job."""
    return {
        "head CT, level 500, 3,000 vertices": (folder / "head_ct.mhd", {"level": 500, "vertices": 3000}),
        "head CT, level 500, 12,000 vertices": (folder / "head_ct.mhd", {"level": 500, "vertices": 12_000}),
        "tooth CT, level 655, 4,000 vertices": (folder / "tooth.nhdr", {"level": 655, "vertices": 4000}),
        "head MR, level 8, 3,000 vertices": (folder / "head_mr.mhd", {"level": 8, "vertices": 3000}),
        "six bunny scans, 4,000 vertices": (
            [folder / f"bun{angle}.ply" for angle in SCANS],
            {"poses": folder / "bun.conf", "vertices": 4000},
        ),
        "kitten, 5,210 oriented points, 3,000 vertices": (folder / "kitten.xyz", {"vertices": 3000}),
        "ellipsoid, 128^3 voxels, 10,000 vertices": (ellipsoid(), {"level": 0.0, "vertices": 10_000}),
        **{f"spot, 200,000 points, 0.5 % noise, {vertices:,} vertices": (noisy(folder), {"vertices": vertices})
           for vertices in (10_000, 30_000, 100_000)},
    }  # fmt: skip


def ellipsoid():
    """Return a volume whose level 0 is an ellipsoid, without noise."""
    x, y, z = np.mgrid[:128, :128, :128] - 63.5
    return sm.Volume(40 * (1 - np.sqrt((x / 50) ** 2 + (y / 40) ** 2 + (z / 30) ** 2)))


def noisy(folder):
    """Return points on the cow, without normals."""
    rng = np.random.default_rng(0)
    points = sm.read(folder / "spot.obj").sampled(200_000, rng=rng).points
    return points + rng.normal(scale=0.005 * np.linalg.norm(np.ptp(points, axis=0)), size=points.shape)


def told(figures, name, data, options):
    """Tell seconds warm, topology and distances of a job."""
    sm.reconstruct(data, **options)
    seconds = []
    for _ in range(3):
        start = np.array([time.process_time(), time.perf_counter()])
        model = sm.reconstruct(data, **options)
        seconds.append(np.array([time.process_time(), time.perf_counter()]) - start)
    mesh, distance = model.mesh, model.distance
    share = 100 / np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    figures.add(f"{name}, processor time", [each[0] for each in seconds], "s")
    figures.add(f"{name}, time by the clock", [each[1] for each in seconds], "s")
    figures.add(f"{name}, genus", [mesh.genus], "")
    figures.add(f"{name}, mesh to data", [share * distance.mesh_to_data.rms], "% of the diagonal")
    figures.add(f"{name}, data to mesh", [share * distance.data_to_mesh.rms], "% of the diagonal")
    figures.add(f"{name}, tangled", [model.tangled], "vertices")


def fresh(name, data, options):
    """Print the times of a new process."""
    program = (
        "import time; t = time.perf_counter(); import simplexmesh as sm; i = time.perf_counter() - t\n"
        f"sm.reconstruct({str(data)!r}, **{options!r}); a = time.perf_counter() - t\n"
        f"t = time.perf_counter(); sm.reconstruct({str(data)!r}, **{options!r}); b = time.perf_counter() - t\n"
        "print(f'import {i:.2f} s, first {a:.2f} s, second {b:.2f} s')"
    )
    out = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout
    print(f"fresh process, {name}:", out)


def main():
    """Tell the jobs that have one of the words given, or all."""
    warnings.simplefilter("ignore")
    figures = Figures("reconstruct", PROTOCOL)
    all_jobs = jobs(Path(os.environ["SIMPLEXMESH_DATA"]))
    wanted = [name for name in all_jobs if not sys.argv[1:] or any(word in name for word in sys.argv[1:])]
    for name in wanted:
        told(figures, name, *all_jobs[name])
        figures.keep()
    if not sys.argv[1:]:
        name = next(iter(all_jobs))
        fresh(name, *all_jobs[name])


if __name__ == "__main__":
    main()
