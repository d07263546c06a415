"""Lines and zones of parts with known creases: precision, recall, pieces and Rand index beside dihedral angles.

"soft" are creases of 5 to 30 degrees, "20" the one of 20 degrees on the block; of zones, how many
say rightly what they are.

Usage: python tests/benchmarks/bench_features.py [faces] [seeds], or SIMPLEXMESH_DATA=folder python
tests/benchmarks/bench_features.py files, which counts lines and zones of files made by CAD.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.surface.features.parts import KINDS, SHAPES, noisy, reference, tessellated
from tests.surface.features.scoring import crease_score, kinds_told, labels_between, paths, rand_index

NOISE = (0.0, 0.05, 0.1, 0.2)  # in mean edges; slivers, of no even size, only without
ANGLES = (10, 15, 20, 30, 45)
LARGE = (100_000, 1_000_000)
FILES = ("fandisk.off", "anchor.off", "coupling.off", "featuretype.stl", "fixed_top.ply", "tray_bottom.stl", "abc8.stl")
COLUMNS = ("precision", "recall", "soft", "20", "over", "pieces", "loose", "ARI", "seconds")


def row(lines, labels, part, seconds):
    found = crease_score(lines, part)
    index = rand_index(labels, part.patches)
    fold = found.soft_recall if part.name == "block" else np.nan
    shares = [found.precision, found.recall, found.soft_recall, fold]
    return [*shares, found.excess, found.pieces, found.loose, index, seconds]


def ours(part):
    began = time.perf_counter()
    network = sm.feature_lines(part.mesh)
    seconds = time.perf_counter() - began
    zones = sm.zones(part.mesh, network)
    return row(paths(network), zones.labels, part, seconds), kinds_told(zones, part)


def of_vtk(part):
    """Edges at the threshold that fits best, by precision and recall together."""
    body, rows = part.mesh.to_pyvista(), []
    for angle in ANGLES:
        began = time.perf_counter()
        edges = body.extract_feature_edges(angle, boundary_edges=False, non_manifold_edges=False, manifold_edges=False)
        seconds = time.perf_counter() - began
        ends = edges.lines.reshape(-1, 3)[:, 1:] if edges.n_cells else np.zeros((0, 2), int)
        rows.append(row_of_edges(np.asarray(edges.points, float)[ends], part, seconds))
    return best(rows), []


def of_trimesh(part):
    body = trimesh.Trimesh(part.mesh.vertices, part.mesh.faces, process=False)
    began = time.perf_counter()
    angles, edges = np.degrees(body.face_adjacency_angles), body.face_adjacency_edges
    seconds = time.perf_counter() - began
    return best([row_of_edges(part.mesh.vertices[edges[angles > angle]], part, seconds) for angle in ANGLES]), []


def row_of_edges(segments, part, seconds):
    _, ids = np.unique(np.concatenate([part.mesh.vertices, segments.reshape(-1, 3)]), axis=0, return_inverse=True)
    vertex = np.full(ids.max() + 1, -1)
    vertex[ids.ravel()[: part.mesh.n_vertices]] = np.arange(part.mesh.n_vertices)
    ends = vertex[ids.ravel()[part.mesh.n_vertices :]].reshape(-1, 2)
    assert (ends >= 0).all()
    return row(list(segments), labels_between(part.mesh, ends), part, seconds)


def best(rows):
    """The row with the best mean of precision, which is none where no edge is found, and recall."""
    return max(rows, key=lambda each: np.nan_to_num(each[0] * each[1] / max(each[0] + each[1], 1e-9)))


METHODS = {"ours": ours, "VTK, best": of_vtk, "trimesh, best": of_trimesh}


def table(title, rows):
    """Print the mean over parts, and the worst part: the least share, the most pieces, free ends and seconds."""
    rows = np.array(rows)
    worst = np.where([1, 1, 1, 1, 0, 0, 0, 1, 0], np.nanmin(rows, axis=0), np.nanmax(rows, axis=0))
    cells = " ".join(f"{mean:6.2f}/{bad:6.2f}" for mean, bad in zip(np.nanmean(rows, axis=0), worst, strict=True))
    print(f"{title:32s} {cells}", flush=True)


def print_kinds(title, told):
    """Print of each kind how many patches are zones that say so, of how many; small ones and lost ones count."""
    kinds = sorted({true for true, _ in told})
    right = {kind: [found == kind for true, found in told if true == kind] for kind in kinds}
    right["all"] = [found == true for true, found in told]
    print(f"{title:32s}", ", ".join(f"{kind} {sum(x)}/{len(x)}" for kind, x in right.items()), flush=True)


def files() -> None:
    for name in FILES:
        network = sm.feature_lines(Path(os.environ["SIMPLEXMESH_DATA"]) / name)
        zones = sm.zones(network.mesh, network)
        print(f"{name}: {network.mesh.n_faces:,} triangles, {len(network.lines)} lines, {len(zones)} zones", flush=True)


def main() -> None:
    if "files" in sys.argv:
        files()
        return
    faces, seeds = map(int, [*sys.argv[1:], *("35000", "1")[len(sys.argv) - 1 :]])
    warnings.simplefilter("ignore", RuntimeWarning)  # means of no soft creases
    sm.feature_lines(sm.sphere(8))
    print(f"{len(SHAPES)} parts of {faces:,} faces, {seeds} of each: mean/worst")
    print(" " * 32, " ".join(f"{name:>13s}" for name in COLUMNS))
    for kind in KINDS:
        rows, told = defaultdict(list), defaultdict(list)
        for name in SHAPES:
            for seed in range(seeds):
                body = reference(name, seed)
                part = tessellated(body, kind, body.edge(faces), seed)
                for noise in NOISE if kind != "sliver" else (0.0,):
                    for method, function in METHODS.items():
                        found, kinds = function(noisy(part, noise, seed))
                        rows[noise, method].append(found)
                        told[noise].extend(kinds)
        for (noise, method), each in rows.items():
            table(f"{kind}, noise {noise:.0%}: {method}", each)
        for noise, pairs in told.items():
            print_kinds(f"{kind}, noise {noise:.0%}: kinds", pairs)
    for count in LARGE:
        body = reference("bracket", 0)
        part = tessellated(body, "scan", body.edge(count / 16))
        fine = part.mesh.to_pyvista().subdivide(2, "linear")
        part = noisy(replace(part, mesh=sm.TriangleMesh(fine.points, fine.regular_faces), edge=part.edge / 4), 0.1)
        print(f"{part.mesh.n_faces:,} faces, noise 10%:", end=" ")
        began = time.perf_counter()
        network = sm.feature_lines(part.mesh)
        middle = time.perf_counter()
        sm.zones(part.mesh, network)
        print(f"lines {middle - began:.2f} s, zones {time.perf_counter() - middle:.2f} s", flush=True)


if __name__ == "__main__":
    main()
