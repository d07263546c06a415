"""Gain in accuracy by redistribution of vertices, against evenly spaced ones of the same number.

Usage: SIMPLEXMESH_DATA=folder python tests/benchmarks/bench_refine.py [head|fandisk|lion|vase|rim|speed|picture]

Even: `reconstruct(..., placement="even")`. Adaptive: `reconstruct(...)`. Redistributed: `redistribute` of the even
mesh, to at most its number of vertices. Distances are from the points of the data to the surface of the mesh. For the
head, points that either model closes over are excluded, walls of airways more than 4 mm deep. Rim: from vertices to a
frustum with an acute rim, three draws of noisy points, where faces smaller than these show are divided too and not.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pyvista as pv
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from simplexmesh.motion.density.face_edits import face_distance, face_score
from simplexmesh.motion.density.refine import refine_round
from simplexmesh.motion.model.state import Stage
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.motion.start.primitives import primitive_around
from simplexmesh.motion.targets.triangles import inside_surface, surface_distance
from tests.motion.reconstruct.test_strays import from_frustum, frustum_points

CASES = {
    "head": ("head_ct.mhd", 500, (1500, 3000, 6000), 4.0),
    "fandisk": ("fandisk.off", None, (1000, 2000, 4000), None),
    "lion": ("lion_head.off", None, (1500, 3000, 6000), None),
}


def folder() -> Path:
    return Path(os.environ["SIMPLEXMESH_DATA"])


def distances(mesh, points, deep=None):
    """Return the distances of points to a mesh, and whether they are inside, deeper than `deep`."""
    surface = mesh.triangulated(method="fan")
    away = surface_distance(points, surface.vertices, surface.faces)
    closed = np.zeros(len(points), bool)
    if deep is not None:
        far = np.flatnonzero(away > deep)
        closed[far] = inside_surface(points[far], surface.vertices, surface.faces)
    return away, closed


def rms(values):
    return float(np.sqrt((values**2).mean()))


def table(name: str) -> None:
    """Print the distances of even and redistributed meshes of the same size."""
    file, _, sizes, _ = CASES[name]
    print(f"\n{file}, vertices: rms from data to mesh in % of the diagonal; tangled; seconds of one core")
    for size in sizes:
        rows = [compared(name, size, seed) for seed in range(3)]
        cells = [f"{what} {min(each):.3g} to {max(each):.3g}" for what, each in
                 ((what, [row[what] for row in rows]) for what in rows[0])]  # fmt: skip
        print(f"{size:,}: {', '.join(cells)}", flush=True)


def nudged(data, seed):
    """Return data moved a little at random: surfaces by 1e-6 of the diagonal, volumes by so much of their range."""
    rng, size = np.random.default_rng(seed), 1e-6 if seed else 0.0
    if isinstance(data, sm.Volume):
        values = data.values + size * np.ptp(data.values) * rng.normal(size=data.values.shape)
        return sm.Volume(values, spacing=data.spacing, origin=data.origin, direction=data.direction)
    return sm.TriangleMesh(data.vertices + size * data.diagonal * rng.normal(size=data.vertices.shape), data.faces)


def compared(name: str, size: int, seed: int) -> dict[str, float]:
    """Return what even, redistributed and adaptive models of the same size come to."""
    file, level, _, deep = CASES[name]
    data = nudged(sm.read(folder() / file), seed)
    subject, models, seconds = as_input(data, level=level), [], []
    points = subject.points[:: max(1, len(subject.points) // 40_000)]
    for placement in ("even", "adaptive"):
        began = time.process_time()
        models.append(sm.reconstruct(data, level=level, vertices=size, placement=placement))
        seconds.append(time.process_time() - began)
    even, adaptive = models
    assert adaptive.mesh.n_vertices <= even.mesh.n_vertices
    meshes = {"even": even.mesh, "adaptive": adaptive.mesh, "by hand": sm.redistribute(even.mesh, subject.target).mesh}
    away = {what: distances(mesh, points, deep) for what, mesh in meshes.items()}
    counts, percent = ~(away["even"][1] | away["adaptive"][1]), 100 / np.linalg.norm(np.ptp(points, axis=0))
    out = {what: percent * rms(values[counts]) for what, (values, _) in away.items()}
    out |= {"less by": 100 * (1 - out["adaptive"] / out["even"]), "points that count": 100 * counts.mean()}
    return out | {"tangled": adaptive.tangled, "s even": seconds[0], "s adaptive": seconds[1]}


def wrapped(points, target, size, seed):
    """Fit a sphere, moved a little at random, around data, coarse to fine as in the thesis, keeping its topology."""
    mesh = primitive_around(points, "sphere", size, facing=None)
    radius = 0.5 * float(np.linalg.norm(np.ptp(points, axis=0)))
    mesh = mesh.moved(mesh.vertices + 1e-4 * radius * np.random.default_rng(seed).normal(size=mesh.vertices.shape))
    stages = [Stage(6, 2 * radius, 100, beta=0.1), Stage(6, 0.4 * radius, 100), Stage(1, 0.16 * radius, 500, beta=0.3)]
    for stage in stages:
        options = {"alpha": stage.alpha, "beta": stage.beta, "rigidity": stage.rigidity, "reach": stage.reach}
        model = sm.DeformableModel(mesh, target, **options)
        for _ in model.run(stage.iterations):
            pass
        mesh = model.mesh
    return mesh


def vase() -> None:
    """Print how the deep cavity of the vase is filled from a sphere of 720 vertices, three times."""
    volume = sm.read_volume(folder() / "vase_ct.vti")
    points, target = as_input(volume, level=25).points, sm.targets.Isosurface(volume, 25)
    print("\nvase_ct.vti, level 25, from a sphere: vertices, data to mesh in voxels: mean, rms, largest, % beyond 2")
    rows: dict[str, list[tuple[float, ...]]] = {}
    for seed in range(3):
        start = wrapped(points, target, 720, seed)
        refined = {kind: sm.refine(start, target, threshold=kind).mesh for kind in ("coarse", "medium", "fine")}
        for what, mesh in {"fitted": start, **refined}.items():
            away, _ = distances(mesh, points)
            measured = mesh.n_vertices, away.mean(), rms(away), away.max(), 100 * (away > 2).mean()
            rows.setdefault(what, []).append(measured)
    for what, found in rows.items():
        print(f"{what:8}", " | ".join(f"{min(each):.4g} to {max(each):.4g}" for each in zip(*found, strict=True)))


def rim() -> None:
    """Print how far vertices pile up off an acute rim that noise blurs, where faces of any size are divided and not."""
    print("\nfrustum, 30,000 points, 0.5 % noise, 6,000 vertices: mean distance in % of the diagonal, share beyond 1 %")
    for what, resolution in (("no resolution", None), ("resolution", sm.targets.Points.resolution)):
        with patch.object(sm.targets.Points, "resolution", resolution):
            for seed in range(3):
                points = frustum_points(30_000, 0.005, seed)
                mesh = sm.reconstruct(points, vertices=6000, creases="none").mesh
                away = from_frustum(mesh.vertices) * 100 / np.linalg.norm(np.ptp(points, axis=0))
                print(f"{what}, seed {seed}: {away.mean():.3f}, {(away > 1).mean():.1%}", flush=True)


def picture(path="redistributed.jpg") -> None:
    """Draw even meshes above redistributed ones of the same size."""
    plotter = pv.Plotter(off_screen=True, shape=(2, 3), window_size=(1500, 1000), border=False)
    views = {
        "head": ((0.6, -1, -0.2), (0, 0, -1)),
        "fandisk": ((-1, 0.8, 0.3), (0, 0, 1)),
        "lion": ((0.3, 0, 1), (0, 1, 0)),
    }
    for column, (name, (file, level, sizes, _)) in enumerate(CASES.items()):
        even = sm.reconstruct(folder() / file, level=level, vertices=sizes[1], adaptation=0).mesh
        placed = sm.reconstruct(folder() / file, level=level, vertices=sizes[1]).mesh
        for row, mesh in enumerate((even, placed)):
            plotter.subplot(row, column)
            look = {"show_edges": True, "edge_color": "#4a545c", "ambient": 0.25}
            plotter.add_mesh(mesh.to_pyvista(), color="#c9d3dc", **look)
            plotter.view_vector(*views[name])
            plotter.camera.zoom(1.15)
    Image.fromarray(plotter.screenshot(return_img=True)).save(path, quality=85, optimize=True)
    plotter.close()


def least(job, times=5):
    """Return the least time of several runs, in seconds."""
    out = []
    for _ in range(times):
        began = time.perf_counter()
        job()
        out.append(time.perf_counter() - began)
    return min(out)


def speed() -> None:
    """Print the cost per vertex of scoring and of a round of edits, relative to one step of the motion."""
    print("\nnanoseconds per vertex: score without distance, round of edits with all checks, step of motion")
    ball = sm.targets.Triangles(sm.sphere(40).triangulated())
    for frequency in (10, 30, 70):
        mesh = sm.sphere(frequency)
        away = face_distance(mesh, ball, 0.3)[0]
        model = sm.DeformableModel(mesh, ball, reach=0.3)
        jobs = (
            lambda mesh=mesh, away=away: face_score(mesh, away, 0.3),
            lambda mesh=mesh: refine_round(mesh, ball, reach=0.3, threshold=1e-30, budget=mesh.n_vertices // 5),
            model.step,
        )
        print(mesh.n_vertices, *(f"{least(job) / mesh.n_vertices * 1e9:9.0f}" for job in jobs))


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    chosen = sys.argv[1:] or [*CASES, "vase", "rim", "speed"]
    for name in chosen:
        if name in CASES:
            table(name)
        else:
            {"vase": vase, "rim": rim, "speed": speed, "picture": picture}[name]()
