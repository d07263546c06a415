"""Whole reconstructions, warm and in a fresh process, on the data folder named by SIMPLEXMESH_DATA.

Run: SIMPLEXMESH_DATA=... python tests/benchmarks/bench_reconstruct.py
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np

import simplexmesh as sm

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
    }


def main():
    """Print one row per job: seconds warm, topology, distances in % of the diagonal."""
    warnings.simplefilter("ignore")
    folder = Path(os.environ["SIMPLEXMESH_DATA"])
    for name, (data, options) in jobs(folder).items():
        sm.reconstruct(data, **options)
        seconds = []
        for _ in range(3):
            start = time.perf_counter()
            model = sm.reconstruct(data, **options)
            seconds.append(time.perf_counter() - start)
        mesh, distance = model.mesh, model.distance
        share = 100 / np.linalg.norm(np.ptp(mesh.vertices, axis=0))
        print(
            f"{name:46s} {min(seconds):.2f} s  {mesh.n_vertices} vertices  genus {mesh.genus}  "
            f"mesh to data rms {share * distance.mesh_to_data.rms:.3f} %  data to mesh rms "
            f"{share * distance.data_to_mesh.rms:.3f} %  tangled {model.tangled}"
        )
    name, (data, options) = next(iter(jobs(folder).items()))
    program = (
        "import time; t = time.perf_counter(); import simplexmesh as sm; i = time.perf_counter() - t\n"
        f"sm.reconstruct({str(data)!r}, **{options!r}); a = time.perf_counter() - t\n"
        f"t = time.perf_counter(); sm.reconstruct({str(data)!r}, **{options!r}); b = time.perf_counter() - t\n"
        "print(f'import {i:.2f} s, first {a:.2f} s, second {b:.2f} s')"
    )
    print("fresh process:", subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout)


if __name__ == "__main__":
    main()
