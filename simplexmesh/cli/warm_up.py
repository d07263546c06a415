"""`simplexmesh warm-up`: compile the kernels by a small example of each function, so that later calls start at once."""

from __future__ import annotations

import multiprocessing
import os
import signal
import tempfile
import time
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import typer

from simplexmesh._base.errors import SimplexMeshWarning
from simplexmesh.cli.report import progress

EXAMPLE = "Example: simplexmesh warm-up"
PROCESSES = 4
"""At most: each compiles again what another has not yet finished, and takes half a gigabyte."""

SAMPLES = "float32", "float64", "int16", "uint16", "uint8"
"""Kinds of numbers that volumes in files are of, for each of which some kernels are compiled."""


def command() -> None:
    """Compile all common kernels, which otherwise happens at first use: once after installation and each upgrade."""
    from simplexmesh._base._kernels_compiled import compiling

    began = time.perf_counter()
    context, count = multiprocessing.get_context("spawn"), min(os.cpu_count() or 1, PROCESSES)
    with (
        ProcessPoolExecutor(count, context, signal.signal, (signal.SIGINT, signal.SIG_IGN)) as pool,
        progress("compiling") as report,
        compiling(lambda: None, lambda: None),  # says nothing, or where no bar is drawn the first use would be told
    ):
        names = list(examples())
        compiled = pool.map(run_example, names)
        try:
            for place, name in enumerate(names):
                report(place / len(names), name)
                next(compiled)
        except KeyboardInterrupt:  # which ends the processes, as each takes up to a minute for its example
            for process in multiprocessing.active_children():
                process.terminate()
            raise
    typer.echo(f"kernels are compiled, {time.perf_counter() - began:.0f} s")


def run_example(name: str) -> None:
    """Run one example, which compiles kernels."""
    from simplexmesh._base._kernels_compiled import compiling

    with warnings.catch_warnings(), compiling(lambda: None, lambda: None):
        warnings.simplefilter("ignore", SimplexMeshWarning)  # the examples are coarse
        examples()[name]()


def examples() -> dict[str, Callable[[], Any]]:
    """Return examples of each door, by name; first those that take long and share few kernels, as processes do them."""
    import numpy as np

    import simplexmesh as sm
    from simplexmesh.surface.curvature import estimate as curvatures
    from simplexmesh.surface.normals import estimate as normals

    ball = sm.sphere(14)
    triangles = ball.triangulated("dual")
    bowl = triangles.vertices[triangles.vertices[:, 2] > 0]
    x, y, z = np.mgrid[-12:13, -12:13, -12:13].astype(float)
    grid, drilled = np.sqrt(x**2 + y**2 + z**2), np.hypot(x, y) > 1.5
    egg = ball.vertices[::2] * [3, 2, 1]
    pipe = sm.cylinder(60, 100, height=12.0).vertices
    small: dict[str, Any] = {"vertices": 800, "iterations": 50}

    return {
        "reconstruct a volume": lambda: [
            sm.reconstruct((20 * (9.5 - grid)).clip(0).astype(kind), level=50.0, **small) for kind in SAMPLES
        ],
        "curvature": lambda: (
            [sm.curvature(triangles, method=name) for name in curvatures.METHODS],
            [sm.curvature(each) for each in (ball, ball.vertices)],
            sm.curvature(sm.sphere(8), "simplex_angle"),
            sm.curvature(triangles, "sine", neighborhood=sm.ball(0.1)),
        ),
        "decimate": lambda: (sm.decimate(ball, vertices=2000), sm.decimate(sm.sphere(4), tolerance=0.05)),
        "register": lambda: sm.register(egg[egg[:, 0] > -1], egg),
        "library": recognize,
        "reconstruct a label": lambda: sm.reconstruct(((grid < 9) & drilled).astype(np.uint8), tunnels=6.0, **small),
        "reconstruct points": lambda: sm.reconstruct(ball.vertices, **small),
        "reconstruct triangles": lambda: sm.reconstruct(triangles, **small),
        "reconstruct open data": lambda: sm.reconstruct(bowl, init="sphere", **small),
        "reconstruct a handle": lambda: sm.reconstruct(sm.torus(40, 16).vertices, init="sphere", **small),
        "check": lambda: sm.sphere(4).check(self_intersections=True),
        "edit": edit,
        "move": lambda: [
            list(sm.DeformableModel(ball, sm.targets.Points(egg), constraint=constraint, rigidity=2).run(2))
            for constraint in ("angle", "mean_curvature")
        ],
        "normals": lambda: (
            [sm.vertex_normals(triangles, method=name) for name in normals.METHODS],
            sm.vertex_normals(ball.vertices),
            sm.spread(triangles),
        ),
        "saliency": lambda: (sm.saliency(triangles), sm.hk_classes(triangles)),
        "simplify": lambda: sm.simplify(triangles, 0.05),
        "features": lambda: sm.zones(sm.clipped(triangles, (0, 0, 0), (0, 0, 1), cap=True), tolerance=0.5).kinds,
        "primitives": fit_primitives,
        "pipes": lambda: (sm.extract_pipes(pipe), sm.follow_pipe(pipe, pick=pipe[len(pipe) // 2])),
        "deviation": lambda: sm.deviation(triangles, sm.sphere(16).triangulated("dual")),
        "signatures": lambda: [sm.match(sm.sai(egg), sm.sai(seen)) for seen in (egg, bowl)],
    }


def recognize() -> None:
    """Add a model to a library, and recognize it."""
    import simplexmesh as sm

    egg = sm.sphere(14).vertices * [3, 2, 1]
    with tempfile.TemporaryDirectory() as folder:
        models = sm.ModelLibrary(Path(folder, "models.sml"))
        models.add("egg", egg)
        models.recognize(egg)


def edit() -> None:
    """Edit meshes, by operators on many edges and faces, and undo it."""
    import simplexmesh as sm

    mesh = sm.sphere(20)
    edited = sm.EditableMesh(mesh)
    edited.refine_faces([0])
    edited.remove_faces([100])
    edited.undo()
    mesh.connectivity.rings(1)
    sm.regularize(sm.sphere(6))
    sm.redistribute(sm.sphere(8), mesh.vertices)


def fit_primitives() -> None:
    """Find a cylinder in points, fit one to them, and move it."""
    import numpy as np

    import simplexmesh as sm

    pipe = sm.cylinder(60, 100, height=12.0).vertices
    sm.extract_primitives(pipe)
    cylinder = sm.fit_primitive(pipe, "cylinder")
    cylinder.stepped(np.zeros(cylinder.n_parameters)).derivatives(pipe)
