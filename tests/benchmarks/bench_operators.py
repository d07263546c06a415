"""Cost of the operators: nanoseconds per edit in batches at several mesh sizes, regularization, a kd-tree query.

Run with `python tests/benchmarks/bench_operators.py`; half a minute.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.regularize import regularize


def timed(function, rounds: int = 3) -> tuple[float, object]:
    """Return the smallest time of one call in seconds, and its last result."""
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        out = function()
        times.append(time.perf_counter() - start)
    return min(times), out


def chosen(mesh: sm.SimplexMesh, count: int, rng: np.random.Generator) -> dict[str, tuple[np.ndarray, ...]]:
    """Return random arguments for each batch: `count` edges, pairs of edges of a face, a sixth as many faces."""
    c = mesh.connectivity
    darts = rng.permutation(c.edge_darts[:, 0])[:count]
    some = c.face_offsets[:-1][rng.integers(0, len(c.face_sizes), count)]
    faces = rng.permutation(len(c.face_sizes))[: count // 6]
    return {
        "swap_edges": (darts,),
        "remove_edges": (darts,),
        "insert_edges": (c.face_darts[some], c.face_darts[some + 2]),
        "remove_faces": (faces,),
        "refine_faces": (faces,),
    }


def batches(mesh: sm.SimplexMesh, count: int, rng: np.random.Generator, *, in_order: bool) -> dict[str, float]:
    """Return nanoseconds per random edit of each kind, per undo, and per vertex of the copy and of the result."""
    out = {}
    for name, args in chosen(mesh, count, rng).items():
        best = np.inf
        for _ in range(3):
            copied, edit = timed(lambda: EditableMesh(mesh), 1)
            edit._reserve(2 * count, 4 * count, 2 * count)
            seconds, _ = timed(lambda edit=edit, name=name, args=args: getattr(edit, name)(*args, in_order=in_order), 1)
            best = min(best, seconds)
        out[name] = 1e9 * best / len(args[0])
    edits = edit.n_edits
    closed, _ = timed(edit.result, 1)
    out["undo"] = 1e9 * timed(edit.undo, 1)[0] / edits
    return out | {"copy": 1e9 * copied / mesh.n_vertices, "result": 1e9 * closed / mesh.n_vertices}


def print_rates() -> None:
    """Print the cost of an edit at four mesh sizes, in batches of a quarter of the number of vertices."""
    rng = np.random.default_rng(0)
    batches(sm.sphere(8), 100, rng, in_order=True)
    names = ("swap_edges", "remove_edges", "insert_edges", "remove_faces", "refine_faces", "undo", "copy", "result")
    print("nanoseconds: of an edit tried, of one undone, of a vertex copied and a vertex in the result")
    print("| vertices | order |", " | ".join(names), "|\n|", " --- |" * (2 + len(names)))
    for vertices in (10_000, 50_000, 200_000, 1_000_000):
        mesh = sm.sphere(vertices=vertices)
        for in_order in (False, True):
            costs = batches(mesh, vertices // 4, rng, in_order=in_order)
            row = " | ".join(f"{costs[name]:.0f}" for name in names)
            print(f"| {mesh.n_vertices} | {'random' if in_order else 'of memory'} | {row} |", flush=True)


def main() -> None:
    print_rates()
    rng = np.random.default_rng(0)
    uneven = EditableMesh(sm.sphere(vertices=65_000))
    uneven.swap_edges(rng.integers(0, 3 * uneven.n_slots, 20_000))
    mesh = uneven.result().mesh
    seconds, out = timed(lambda: regularize(mesh))
    print(
        f"regularizing {mesh.n_vertices} vertices: {seconds:.3f} s, {out.swaps} swaps, {len(out.exceptions)} exceptions"
    )
    points = rng.normal(size=(200_000, 3))
    tree = cKDTree(points)
    seconds, _ = timed(lambda: tree.query(points[:50_000]))
    print(f"a kd-tree of 200,000 points answers {50_000 / seconds:,.0f} queries a second on one core")


if __name__ == "__main__":
    main()
