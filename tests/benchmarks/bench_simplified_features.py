"""Lines and zones of simplified scans of parts with known creases, and lines of simplified smooth bodies, by tolerance.

Those of bodies need the data folder, and are false but for the few that the bodies have as they are.

Usage: python tests/benchmarks/bench_simplified_features.py [faces] [seed]
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import igl
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.surface.features.parts import SHAPES, noisy, reference, tessellated
from tests.surface.features.scoring import crease_score, paths, rand_index

KINDS, NOISE, TOLERANCES = ("aligned", "scan"), (0.02, 0.05), (0, 1, 2, 4, 10)
BODIES, SHARES = (
    ("elephant.off", "spot.obj", "femur.off", "knot1.off", "avf_surface.vtk"),
    (0, 0.001, 0.002, 0.005, 0.01, 0.02),
)
COLUMNS = ("faces", "precision", "recall", "ARI", "zones/true")


def row(part, tolerance):
    mesh = sm.simplify(part.mesh, tolerance) if tolerance else part.mesh
    network = sm.feature_lines(mesh)
    zones, found = sm.zones(network.mesh, network), crease_score(paths(network), part)
    corners = part.mesh.vertices[part.mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    there = np.ascontiguousarray(zones.mesh.vertices), np.asarray(zones.mesh.faces, np.int64)
    labels = zones.labels[igl.point_mesh_squared_distance(corners.mean(axis=1), *there)[1]]
    index = rand_index(labels, part.patches, areas)
    return [mesh.n_faces, np.nan_to_num(found.precision), found.recall, index, len(zones) / len(part.kinds)]


def print_smooth(folder):
    """Print the number of lines of bodies, and their length over the diagonal, by tolerance over that."""
    for name in BODIES:
        body = sm.read(folder / name).welded(report=False).oriented(outward=False)
        cells = []
        for share in SHARES:
            lines = sm.feature_lines(sm.simplify(body, share * body.diagonal) if share else body).lines
            cells.append(f"{share:.1%}: {len(lines)}, {sum(line.length for line in lines) / body.diagonal:.2g}")
        print(f"{name:16s}", "  ".join(cells), flush=True)


def main() -> None:
    faces, seed = map(int, [*sys.argv[1:], *("12000", "0")[len(sys.argv) - 1 :]])
    bodies = [reference(name, seed) for name in SHAPES]
    print(f"{len(bodies)} parts of {faces:,} faces: mean, worst")
    for kind in KINDS:
        parts = [tessellated(body, kind, body.edge(faces), seed) for body in bodies]
        for noise in NOISE:
            for times in TOLERANCES:
                rows = [row(noisy(part, noise, seed), times * noise * part.edge) for part in parts]
                each = zip(COLUMNS, np.mean(rows, axis=0), np.min(rows, axis=0), strict=True)
                cells = "  ".join(f"{name} {mean:.4g} {least:.3g}" for name, mean, least in each)
                print(f"{kind}, noise {noise:.0%}, {times:2d} deviations: {cells}", flush=True)
    if "SIMPLEXMESH_DATA" in os.environ:
        print_smooth(Path(os.environ["SIMPLEXMESH_DATA"]))


if __name__ == "__main__":
    main()
