"""What operators cost: edits per second in batches, at several sizes of mesh; regularizing; against a kd-tree query.

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
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.regularize import regularize


def timed(function, rounds: int = 3) -> tuple[float, object]:
    """Return the least time of one call in seconds, and what it returned last."""
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        out = function()
        times.append(time.perf_counter() - start)
    return min(times), out


def batches(mesh: sm.SimplexMesh, edits: int, rng: np.random.Generator) -> list[tuple[str, float, int]]:
    """Return the seconds and the number done of `edits` random swaps, removals and insertions, and of their undoing."""
    c = mesh.connectivity
    out = []
    darts = rng.permutation(c.edge_darts[:, 0])[:edits]
    faces = c.face_offsets[:-1]
    some = rng.integers(0, len(faces), edits)
    one, other = c.face_darts[faces[some]], c.face_darts[faces[some] + 2]
    for name, args in (("swap_edges", (darts,)), ("remove_edges", (darts,)), ("insert_edges", (one, other))):
        best = np.inf
        for _ in range(3):
            edit = EditableMesh(mesh)
            edit._reserve(edits, 2 * edits, edits)
            seconds, batch = timed(lambda edit=edit, name=name, args=args: getattr(edit, name)(*args), 1)
            best = min(best, seconds)
        out.append((name, best, len(darts), int(batch.done.sum())))
    seconds, _ = timed(edit.undo, 1)
    out.append(("undo", seconds, out[-1][3], out[-1][3]))
    return out


def main() -> None:
    rng = np.random.default_rng(0)
    batches(sm.sphere(8), 100, rng)
    print("| vertices | edits | tried | done | tried per s | done per s |\n| --- | --- | --- | --- | --- | --- |")
    for vertices in (10_000, 200_000, 1_000_000):
        mesh = sm.sphere(vertices=vertices)
        for name, seconds, tried, done in batches(mesh, min(vertices // 4, 50_000), rng):
            print(f"| {mesh.n_vertices} | {name} | {tried} | {done} | {tried / seconds:,.0f} | {done / seconds:,.0f} |")
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
