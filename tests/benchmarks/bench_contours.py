"""What contours with conditions end at: heights of caps, tilts of the demo vase, and a nut decimated with its creases.

Run as `python tests/benchmarks/bench_contours.py`; three minutes. Caps: a disk over a circle, whose plane it should
meet at 45 degrees. Vase: the surface should tilt by 45 degrees at two contours. Nut: three draws of the points of the
demo `sharp`, 4,000 vertices decimated to 1,000, with and without its contours, in ratios to the noise; the peer is
libigl's `qslim` of the triangles to as many vertices.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import igl
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from demos import sharp, vase
from simplexmesh.motion.targets.triangles import surface_distance
from tests.motion.model.test_contours import cap


def caps() -> None:
    """Print by how much caps are too low, by the number of faces across."""
    wanted = np.tan(np.pi / 8)
    for size in (6, 10, 14):
        print(
            f"cap, {size} faces across: {1 - cap(size, -np.pi / 4).vertices[:, 2].max() / wanted:.1%} too low",
            flush=True,
        )


def tilts() -> None:
    """Print how far the surface of the vase tilts at its wavy contours."""
    for size in ("large", "small"):
        angles = vase.main(size)["angles"].items()
        print(
            f"vase, {size}:", ", ".join(f"{name} {np.degrees(angle):.1f} degrees" for name, angle in angles), flush=True
        )


def nuts() -> None:
    """Print how far the points are from decimated models, in units of their noise."""
    away: dict[str, list[float]] = {}
    for seed in range(3):
        points = sharp.nut(20_000, np.random.default_rng(seed))
        mesh = sm.reconstruct(points, vertices=4000).mesh
        bare = mesh.with_contours(**dict.fromkeys(mesh.contours))
        few = {what: sm.decimate(each, vertices=1000).mesh for what, each in (("contours", mesh), ("none", bare))}
        shown = {what: each.triangulated() for what, each in (("4,000 vertices", mesh), *few.items())}
        dual = mesh.triangulated("dual")
        peer, corners, *_ = igl.qslim(dual.vertices, dual.faces.astype(np.int64), 2000)
        shown["qslim"] = sm.TriangleMesh(peer, corners)
        for what, surface in shown.items():
            distance = surface_distance(points, surface.vertices, surface.faces)
            away.setdefault(what, []).append(float(np.sqrt((distance**2).mean())) / sharp.NOISE)
    for what, rms in away.items():
        print(f"nut, {what}: rms {np.mean(rms):.2f} ({min(rms):.2f} to {max(rms):.2f}) of the noise")


if __name__ == "__main__":
    warnings.simplefilter("ignore", sm.SimplexMeshWarning)  # of faces that fold where the nut is decimated
    caps()
    tilts()
    nuts()
