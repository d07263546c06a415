"""Cost of the motion, relative to peers run in the same process.

Run with `python tests/benchmarks/bench_motion.py [tables] [--store]`; a minute or two. Tables are printed in Markdown;
that of `one_thread` is stored.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from simplexmesh.motion.model import _kernels_averages, _kernels_step
from tests.benchmarks.figures import Figures
from tests.motion import reference as reference

PROTOCOL = """Nanoseconds of processor time per vertex and iteration on one thread, five repeats in turns, each the
least of several calls. Internal force: a step of DeformableModel without data, on a rough sphere. Whole step: internal
force and the search of an isosurface along the normals, 100 iterations from a sphere of radius 32 to an ellipsoid of
half axes 36, 32, 28 voxels in a smooth volume of 128 voxels a side. Peer: VTK's windowed sinc, which moves the points
of the triangulated sphere along means of neighbors; 110 iterations less 10."""
SIZES = (7, 22, 71, 224)  # 20 f^2 vertices: about 1e3, 1e4, 1e5, 1e6


def best(function: Callable[[], object], budget: float = 0.5, least: int = 3) -> float:
    """Return the least time of one call in seconds, after a warm-up."""
    function()
    times: list[float] = []
    while len(times) < least or sum(times) < budget:
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def rough_sphere(frequency: int) -> sm.SimplexMesh:
    ball = sm.sphere(frequency)
    noise = np.random.default_rng(0).normal(size=(ball.n_vertices, 1))
    return ball.moved(ball.vertices * (1 + 0.1 / frequency * noise))


def internal_update() -> None:
    """Time the whole internal update through `DeformableModel.step` against its NumPy twin."""
    print(
        "\n| vertices | step, ns/vertex | step, ms | rigidity 6 | adaptation | NumPy twin, ns/vertex | ratio |"
        "\n|--:|--:|--:|--:|--:|--:|--:|"
    )
    for frequency in SIZES:
        mesh = rough_sphere(frequency)
        n = mesh.n_vertices
        model, stiff = sm.DeformableModel(mesh), sm.DeformableModel(mesh, rigidity=6)
        adapting = sm.DeformableModel(mesh, adaptation=0.05)
        step, stiff_step = best(model.step), best(stiff.step)
        adapted = best(lambda: [adapting.step() for _ in range(10)]) / 10  # noqa: B023
        here, metric, gaps = np.array(mesh.vertices), np.full((n, 3), 1 / 3), np.full(n, np.nan)
        twin = best(lambda: reference.update(here, here, mesh.neighbors, metric, 1, gaps), least=2)  # noqa: B023
        print(
            f"| {n:,} | {1e9 * step / n:.1f} | {1e3 * step:.3f} | {1e9 * stiff_step / n:.1f} | {1e9 * adapted / n:.1f} "
            f"| {1e9 * twin / n:.0f} | {twin / step:.0f} |"
        )


def constraints() -> None:
    """Time the constraints and the options at 100,000 vertices."""
    mesh = rough_sphere(71)
    n = mesh.n_vertices
    options: dict[str, dict] = {
        "mean_curvature": {},
        "orientation": {"constraint": "orientation"},
        "free": {"constraint": "free"},
        "angle": {"constraint": "angle"},
        "shape": {"constraint": "shape", "reference": mesh},
        "mixed rigidity 1 to 4": {"rigidity": 1 + np.arange(n) % 4},
        "adaptation": {"adaptation": 0.1},
        "one force": {"forces": [lambda frame: 0.01 * frame.normals]},
    }
    print("\n| what | ns/vertex |\n|---|--:|")
    for name, given in options.items():
        model = sm.DeformableModel(mesh, **given)

        def ten(model: sm.DeformableModel = model) -> None:
            for _ in range(10):
                model.step()

        print(f"| {name} | {1e8 * best(ten) / n:.1f} |")


def processor(function: Callable[[], object], least: int = 3) -> float:
    """Return the least processor time of one call in seconds."""
    times = []
    for _ in range(least):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def one_thread() -> None:
    """Tell internal force, whole step and VTK's best smoother in turns, all on one thread."""
    import numba
    import pyvista

    threads, numba.config.NUMBA_NUM_THREADS = numba.config.NUMBA_NUM_THREADS, 1
    axis = np.arange(128) - 63.5
    r = np.sqrt((axis[:, None, None] / 36) ** 2 + (axis[:, None] / 32) ** 2 + (axis / 28) ** 2)
    volume = sm.Volume((100 / (1 + np.exp(16 * (r - 1)))).astype(np.float32), origin=(-63.5, -63.5, -63.5))
    target = sm.targets.Isosurface(volume, 50.0)
    for frequency in (7, 22, 63):
        mesh, start = rough_sphere(frequency), sm.sphere(frequency, radius=32.0)
        model, n = sm.DeformableModel(mesh), mesh.n_vertices
        surface = mesh.triangulated("fan")
        data = pyvista.PolyData.from_regular_faces(np.array(surface.vertices), np.array(surface.faces))
        times: dict[str, list[float]] = {"internal force": [], "whole step": [], "windowed sinc": []}
        for _ in range(5):
            step = processor(lambda: [model.step() for _ in range(20)]) / 20  # noqa: B023
            whole = processor(lambda: [*sm.DeformableModel(start, target, reach=10.0).run(100, every=100)], 2)  # noqa: B023
            few, many = (processor(lambda: data.smooth_taubin(n_iter=count)) for count in (10, 110))  # noqa: B023
            for what, spent in zip(times, (step / n, whole / 100 / n, (many - few) / 100 / data.n_points), strict=True):
                times[what].append(1e9 * spent)
        for what, spent in times.items():
            FIGURES.add(f"{what}, {n:,} vertices, one thread", spent, "ns")
    numba.config.NUMBA_NUM_THREADS = threads


def isosurface() -> None:
    """Time the search along the normals against SciPy sampling as many places as it visits."""
    from scipy.ndimage import gaussian_filter, map_coordinates

    values = gaussian_filter(np.random.default_rng(0).normal(size=(128, 128, 128)), 4)
    axis = np.arange(128) - 63.5
    r = np.sqrt(axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2)
    volume = sm.Volume((40 - r + values / values.std()).astype(np.float32), origin=(-63.5, -63.5, -63.5))
    target = sm.targets.Isosurface(volume, 0.0)
    print(
        "\n| vertices | voxels away | search, ns | samples | map_coordinates of as many, ns | ratio |"
        "\n|--:|--:|--:|--:|--:|--:|"
    )
    for frequency in SIZES[:3]:
        for away in (0.3, 2.0, 8.0):
            mesh = sm.sphere(frequency, radius=40 - away)
            n, v = mesh.normals, mesh.vertices
            gaps = target.gap(v, n, 15.0)
            samples = int(np.nanmean(1 + np.ceil(np.abs(gaps) * np.abs(n).max(axis=1) / 0.7) + 3))
            steps = np.linspace(0, np.nanmean(gaps), samples)
            places = (v[:, None] + steps[:, None] * n[:, None]).reshape(-1, 3).T + 63.5
            ours = best(lambda: target.gap(v, n, 15.0))  # noqa: B023
            theirs = best(lambda: map_coordinates(volume.values, places, order=1), least=2)  # noqa: B023
            count = mesh.n_vertices
            print(
                f"| {count:,} | {away} | {1e9 * ours / count:.0f} | {samples} "
                f"| {1e9 * theirs / count:.0f} | {theirs / ours:.1f} |"
            )


def crossover() -> None:
    """Time each kernel on one thread and on all, to find the size from which on all are faster."""
    print(
        "\n| vertices | frames 1 | all | averages 1 | all | step 1 | all, microseconds |\n|--:|--:|--:|--:|--:|--:|--:|"
    )
    for frequency in (3, 5, 7, 10, 14, 20, 32):
        m = sm.DeformableModel(rough_sphere(frequency))
        frame = (m._vertices, m._neighbors, *m._frames)
        moving = _kernels_step.Moving(m._vertices, m._previous, m._neighbors, m.metric)
        forces = _kernels_step.Forces(m.alpha, m.beta, m.damping, m._no_gap)
        out = _kernels_step.Step(m._next, m._moves, m._energy)
        step = (m._frames.curvature, moving, m._frames, forces, out)
        average = (m._frames.curvature, m._neighbors, m._averages._scratch[0])
        cells = []
        for kernel, arguments in (
            (_kernels_step.frames, frame),
            (_kernels_averages.averages, average),
            (_kernels_step.curvature_step, step),
        ):
            n = len(m._vertices)
            one = best(lambda: kernel.kernel(0, n, *arguments), budget=0.1)  # noqa: B023
            every = best(lambda: kernel(n, *arguments), budget=0.1)  # noqa: B023
            cells += [f"{1e6 * one:.1f}", f"{1e6 * every:.1f}"]
        print(f"| {len(m._vertices):,} | " + " | ".join(cells) + " |")


def vertex_order() -> None:
    """Time a step with vertices as they come, along a Morton curve, by reverse Cuthill-McKee, and at random."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    print("\n| vertices | as made | Morton | reverse Cuthill-McKee | random, ns/vertex |\n|--:|--:|--:|--:|--:|")
    for frequency in SIZES[2:]:
        mesh = rough_sphere(frequency)
        n = mesh.n_vertices
        cells = np.int64((mesh.vertices - mesh.vertices.min(axis=0)) * 255)
        code = sum(((cells[:, k] >> bit) & 1) << (3 * bit + k) for bit in range(9) for k in range(3))
        graph = csr_matrix((np.ones(3 * n, np.int8), mesh.neighbors.ravel(), 3 * np.arange(n + 1)), shape=(n, n))
        orders = [
            np.arange(n),
            np.argsort(code, kind="stable"),
            reverse_cuthill_mckee(graph, symmetric_mode=True),
            np.random.default_rng(0).permutation(n),
        ]
        times = []
        for order in orders:
            place = np.argsort(order)
            twin = mesh.connectivity.twin[order]
            twin = 3 * place[twin // 3] + twin % 3
            other = sm.SimplexMesh(mesh.vertices[order], sm.Connectivity(twin.astype(np.int32)))
            times.append(1e9 * best(sm.DeformableModel(other).step) / n)
        print(f"| {n:,} | " + " | ".join(f"{t:.1f}" for t in times) + " |")


def million() -> None:
    """Evolve a million vertices for 100 iterations; print the peak memory beyond the mesh's own."""
    mesh = rough_sphere(224)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # the peak while making the sphere
    now = int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() // 1024
    model = sm.DeformableModel(mesh)
    start = time.perf_counter()
    for _ in model.run(100, every=10):
        pass
    spent = time.perf_counter() - start
    end = int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() // 1024
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    grown = peak - now if peak > before else end - now
    print(
        f"\n{mesh.n_vertices:,} vertices, 100 iterations: {spent:.2f} s; at rest {now / 1024:.0f} MB before, "
        f"{end / 1024:.0f} MB after; the run added {grown / 1024:.0f} MB at most (peak of making the sphere: "
        f"{before / 1024:.0f} MB)"
    )


TABLES = {
    table.__name__: table
    for table in (internal_update, constraints, one_thread, isosurface, crossover, vertex_order, million)
}

FIGURES = Figures("motion", PROTOCOL, ["vtk"])

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="*", choices=[[], *TABLES], help="which tables; all when none is named")
    wanted = parser.parse_args().tables
    for name in wanted or TABLES:
        if name == "million" and not wanted:
            # in a process of its own, whose memory is measured
            subprocess.run([sys.executable, __file__, "million"], check=True)
        else:
            TABLES[name]()
    FIGURES.keep()
